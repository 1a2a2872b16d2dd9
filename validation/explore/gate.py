"""Who may come in: pages of this address alone, and from elsewhere than this machine only who has the token."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from collections.abc import Awaitable, Callable

from aiohttp import web

COOKIE = "ice_explore"
_RULES = "; ".join([
    "default-src 'none'", "script-src 'self'", "style-src 'self'", "img-src 'self' data:", "connect-src 'self'",
    "form-action 'none'", "frame-ancestors 'none'", "base-uri 'none'",
])  # fmt: skip
_HEADERS = {
    "Content-Security-Policy": _RULES,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def is_loopback(host: str) -> bool:
    """Whether an address is one of this machine alone.

    >>> is_loopback("127.0.0.1"), is_loopback("localhost"), is_loopback("::1"), is_loopback("0.0.0.0")
    (True, True, True, False)
    """
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def new_token() -> str:
    """128 random bits as text."""
    return secrets.token_urlsafe(16)


def gate(token: str | None) -> Callable:
    """A middleware for aiohttp.

    Without a token only requests that name the loopback address are let in, so that no page of elsewhere can reach this
    one through a name of its own. With one it is given once, as ``?token=``, and kept as a cookie. A WebSocket must
    come from a page of the same address. Who is refused gets status 403 and one line.
    """

    @web.middleware
    async def middleware(request: web.Request, handler: Handler) -> web.StreamResponse:
        refused = refusal(request, token)
        if refused:
            return web.Response(status=403, text=f"{refused}\n", headers=_HEADERS)
        if token and "token" in request.query and request.path == "/":
            answer = web.HTTPFound("/", headers=_HEADERS)
            answer.set_cookie(COOKIE, token, httponly=True, samesite="Strict")
            raise answer
        response = await handler(request)
        if not response.prepared:
            response.headers.update(_HEADERS)
        return response

    return middleware


def refusal(request: web.Request, token: str | None) -> str:
    """Why not; empty if it may come in."""
    try:
        name, given = request.url.host or "", request.query.get("token") or request.cookies.get(COOKIE, "")
    except ValueError:  # a port beyond 65535, a bracket that does not close
        return f"host must be one that can be, got {request.host[:80]!r}"
    origin = request.headers.get("Origin")
    if origin is not None and origin != f"http://{request.host}":
        return f"origin must be that of this page, got {origin[:80]!r}"
    if token is None:
        return "" if is_loopback(name) else f"host must be a loopback address, got {name[:80]!r}"
    if not hmac.compare_digest(given.encode(errors="surrogateescape"), token.encode()):
        return "token must be the one that ice explore printed, got another or none"
    return ""
