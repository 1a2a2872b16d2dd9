"""The page's files, and a WebSocket for each visitor."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web
from aiohttp.http_exceptions import HttpProcessingError

from scenes import InvalidInput
from validation.explore.gate import gate
from validation.explore.session import Place, Session
from validation.explore.tools import Tools, open_tools

PAGE = Path(__file__).parent / "page"
_NAMES = "address", "history", "labels", "page", "panel", "picture", "solid", "view"
_FILES = {"/": "index.html", "/page.css": "page.css"} | {f"/{name}.js": f"{name}.js" for name in _NAMES}
_MOST = 1 << 16  # bytes of a visitor's message
_MOST_VISITORS = 16


def application(place: Place, tools: Tools, token: str | None = None) -> web.Application:
    """The application that serves the page of a scene."""
    visitors: set[web.WebSocketResponse] = set()

    async def file(request: web.Request) -> web.StreamResponse:
        return web.FileResponse(PAGE / _FILES[request.path])

    async def socket(request: web.Request) -> web.StreamResponse:
        if len(visitors) >= _MOST_VISITORS:
            return web.Response(status=503, text=f"visitors must be at most {_MOST_VISITORS}\n")
        connection = web.WebSocketResponse(max_msg_size=_MOST, heartbeat=30.0)
        await connection.prepare(request)
        visitors.add(connection)
        try:
            await Session(place, tools, _sender(connection)).run(_messages(connection))
        finally:
            visitors.discard(connection)
        return connection

    async def leave(_: web.Application) -> None:
        for connection in set(visitors):
            await connection.close()

    made = web.Application(middlewares=[gate(token)])
    made.add_routes([web.get(path, file) for path in _FILES])
    made.add_routes([web.get("/socket", socket)])
    made.on_shutdown.append(leave)
    return made


def _sender(connection: web.WebSocketResponse) -> Callable:
    async def send(message: dict[str, Any]) -> None:
        if not connection.closed:
            await connection.send_str(json.dumps(message, allow_nan=False, separators=(",", ":")))

    return send


async def _messages(connection: web.WebSocketResponse) -> AsyncIterator[str]:
    async for message in connection:
        if message.type == WSMsgType.TEXT:
            yield message.data


def _log() -> logging.Logger:
    """Of errors of ours: aiohttp would print a traceback for each request that is no HTTP, which it answers by 400."""
    log = logging.getLogger("validation.explore")
    if _is_ours not in log.filters:
        log.addFilter(_is_ours)
    return log


def _is_ours(record: logging.LogRecord) -> bool:
    return not (record.exc_info and isinstance(record.exc_info[1], HttpProcessingError))


async def serve(
    place: Place,
    host: str,
    port: int,
    token: str | None,
    told: Callable[[str], None],
    stop: asyncio.Event | None = None,
) -> None:
    """Serve until ``stop``, or for ever; ``told`` is called with the page's address once it answers.

    Raises
    ------
    InvalidInput
        If the address cannot be listened at.
    """
    with open_tools() as tools:
        runner = web.AppRunner(application(place, tools, token), access_log=None, logger=_log(), shutdown_timeout=1.0)
        await runner.setup()
        try:
            site = web.TCPSite(runner, host, port)
            try:
                await site.start()
            except (OSError, ValueError) as error:
                reason = getattr(error, "strerror", None) or error
                raise InvalidInput(
                    f"--host and --port must be free to listen at, got {host}:{port} ({reason})"
                ) from None
            address = runner.addresses[0]
            shown = f"[{address[0]}]" if ":" in address[0] else address[0]
            told(f"http://{shown}:{address[1]}/" + (f"?token={token}" if token else ""))
            await (stop or asyncio.Event()).wait()
        finally:
            await runner.cleanup()
