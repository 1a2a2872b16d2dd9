"""``ice explore``: the interactive page."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated

import typer

import scenes
from validation.batch.stopped import Interrupted
from validation.cli.common import Json, SceneName, check_number, commands, scene_of
from validation.strict_json import dumps

commands = commands()

Host = Annotated[str, typer.Option(metavar="ADDRESS", help="Where to listen; any but this machine's needs the token.")]
Port = Annotated[int, typer.Option(help="0: any that is free.")]
Open = Annotated[bool, typer.Option("--open", help="Open it in the default browser.")]


@commands.command("explore")
def explore_command(
    scene: SceneName, host: Host = "127.0.0.1", port: Port = 0, open_it: Open = False, as_json: Json = False
) -> None:
    """Drag camera and lights around the object and see at once how well it can be measured; ends with Ctrl-C."""
    check_number("--port", port, 0, 65535)
    loaded = scene_of(scene)
    _ = loaded.quantities  # or one line
    try:
        import aiohttp  # noqa: F401
    except ImportError:
        raise scenes.InvalidInput(
            'aiohttp must be installed for ice explore (pip install "ice-vision[explore]"), got none'
        ) from None
    import asyncio

    from validation.explore.gate import is_loopback, new_token
    from validation.explore.server import serve
    from validation.explore.session import Place

    def told(address: str) -> None:
        facts = {"scene": loaded.name, "url": address}  # in one line and at once, for whoever reads a pipe
        print(dumps(facts, indent=None) if as_json else f"{loaded.name}: {address} (Ctrl-C ends)", flush=True)
        if open_it:
            import webbrowser

            webbrowser.open(address)

    place = Place(loaded, str(scene), Path.cwd())
    asyncio.run(_until_interrupted(serve, place, host, port, None if is_loopback(host) else new_token(), told))


async def _until_interrupted(serve, *how) -> None:
    """Serve until Ctrl-C or SIGTERM: an event loop swallows what a signal's own handler raises."""
    import asyncio

    stop, came, loop = asyncio.Event(), [], asyncio.get_running_loop()

    def interrupted(number: int) -> None:
        came.append(number)
        stop.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, interrupted, number)
    await serve(*how, stop)
    word = "interrupted" if came[0] == signal.SIGINT else "terminated"
    raise Interrupted(word, 128 + came[0])
