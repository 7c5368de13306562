# SPDX-License-Identifier: Apache-2.0
"""Access control of the server: Host, Origin, token and rate of messages."""

from __future__ import annotations

import hmac
import ipaddress
import re
import socket
import time
from urllib.parse import parse_qs

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from .hosts import LOOPBACK_NAMES, is_loopback

RATE, BURST = 300.0, 200.0  # messages of one page: per second, and at once
_AUTHORITY = re.compile(r"(?:\[([0-9a-fA-F:.]+)\]|([A-Za-z0-9._-]+))(?::\d{1,5})?")


class Guard:
    """ASGI middleware that refuses requests without the right Host, Origin and token.

    Parameters
    ----------
    app : the application to guard
    host : address that the server is bound to
    token : secret that requests must carry, except those for static files
    needs_token : prefixes of the paths that require the token
    """

    def __init__(self, app: ASGIApp, host: str, token: str, needs_token: tuple[str, ...]) -> None:
        self._app, self._host, self._token, self._needs_token = app, host, token, needs_token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on and add security headers to the answer, or refuse it with 403."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        authority = headers.get("host", "")
        reason = self._objection(scope, headers, authority)
        if reason is None:
            await self._app(scope, receive, _with_headers(send, scope, authority))
        elif scope["type"] == "websocket":
            await WebSocket(scope, receive, send).send_denial_response(PlainTextResponse(reason, 403))
        else:
            await PlainTextResponse(reason, 403)(scope, receive, send)

    def _objection(self, scope: Scope, headers: Headers, authority: str) -> str | None:
        wrong = None
        if len(headers.getlist("host")) != 1 or not self._known_host(authority):
            wrong = "a foreign Host"
        elif headers.get("origin", f"http://{authority}") != f"http://{authority}":
            wrong = "a foreign Origin"
        elif scope["path"].startswith(self._needs_token):
            given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[-1]
            if not hmac.compare_digest(given.encode(), self._token.encode()):
                wrong = "no token, or one of another run"
        return wrong and f"403: found {wrong}; open the address that the server printed\n"

    def _known_host(self, authority: str) -> bool:
        """Accept only host names that a foreign page cannot take over, against DNS rebinding."""
        match = _AUTHORITY.fullmatch(authority)
        if match is None:
            return False
        name = (match[1] or match[2]).lower()
        if name in LOOPBACK_NAMES or name == self._host.lower():
            return True
        if is_loopback(self._host):
            return False
        try:  # the server listens on the network: addresses and this machine's own names cannot be rebound
            ipaddress.ip_address(name)
        except ValueError:
            return name in (socket.gethostname().lower(), socket.getfqdn().lower())
        return True


def _with_headers(send: Send, scope: Scope, authority: str) -> Send:
    """`send` that adds security headers, which restrict the page to this server."""
    policy = (
        "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
        f"worker-src 'self' blob:; connect-src 'self' ws://{authority}; object-src 'none'; "
        "base-uri 'none'; form-action 'none'"
    )
    headers = {
        "Content-Security-Policy": policy,
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Resource-Policy": "same-origin",
    }

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [
                *message["headers"],
                *((name.lower().encode(), value.encode()) for name, value in headers.items()),
            ]
        await send(message)

    return sending if scope["type"] == "http" else send


class RateLimit:
    """Token bucket that limits the rate of messages."""

    def __init__(self, rate: float = RATE, burst: float = BURST) -> None:
        self._rate, self._burst = rate, burst
        self._left, self._then = burst, time.monotonic()

    def allows(self) -> bool:
        """Take one message out of the bucket; False if it is empty."""
        now = time.monotonic()
        self._left = min(self._burst, self._left + (now - self._then) * self._rate)
        self._then = now
        if self._left < 1:
            return False
        self._left -= 1
        return True
