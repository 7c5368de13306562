# SPDX-License-Identifier: Apache-2.0
"""Connections of HTTP: strangers that never finish a request neither stay nor keep others out."""

from __future__ import annotations

import asyncio
import resource
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_SECONDS = 10.0  # for a request's first line and headers, and between two requests
STALL_SECONDS = 30.0  # for a reader to take some of what waits for it
MOST = 256  # connections without WebSockets: 32 pages with what a browser opens at once
OF_FILES = 0.25  # share of the files that this process may have open
AT_ONCE = 64  # connections that are accepted before any is counted, and that wait for that


def most_connections() -> int:
    """As many as leave this process files to open."""
    allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return MOST if allowed == resource.RLIM_INFINITY else max(1, min(MOST, int(OF_FILES * allowed)))


class Connections:
    """The open connections; for a new one too many, the one that waits longest is closed.

    WebSockets are none of them: each has shown the token, and `Hub` limits them.

    Parameters
    ----------
    most : connections that may be open at once
    """

    def __init__(self, most: int) -> None:
        self._most = most
        # Both in the order of coming.
        self._waiting: dict[Connection, None] = {}
        self._served: dict[Connection, None] = {}

    def __len__(self) -> int:
        return len(self._waiting) + len(self._served)

    def wait(self, connection: Connection) -> None:
        """A connection begins to wait for a request; a new one may push out another."""
        new = connection not in self._waiting and connection not in self._served
        if new and len(self) >= self._most:
            next(iter(self._waiting or self._served)).end()
        self.leave(connection)
        self._waiting[connection] = None

    def serve(self, connection: Connection) -> None:
        """A connection's request has come."""
        if connection in self._waiting:
            self.leave(connection)
            self._served[connection] = None

    def leave(self, connection: Connection) -> None:
        """A connection is closed, or a WebSocket from now on."""
        self._waiting.pop(connection, None)
        self._served.pop(connection, None)


class Connection(H11Protocol):
    """One connection of uvicorn with the time-outs that it lacks.

    Parameters
    ----------
    others : all connections of the server
    options : as uvicorn gives them
    """

    def __init__(self, others: Connections, **options: Any) -> None:
        super().__init__(**options)
        self._others = others
        self._timer: asyncio.TimerHandle | None = None
        self._ended = False  # here: closed, or a WebSocket's

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for the first request."""
        super().connection_made(transport)
        self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget everything."""
        super().connection_lost(exc)
        self._leave()

    def data_received(self, data: bytes) -> None:
        """Take what came; bytes of an unfinished request gain no time."""
        super().data_received(data)
        if self._is_answering() and not self._ended:
            self._others.serve(self)
            self._set_timer(None)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Leave the connection to the WebSocket."""
        self._leave()
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        """Wait for the next request, unless that is here already."""
        super().on_response_complete()
        if not self._ended and not self._is_answering():
            self._wait()

    def pause_writing(self) -> None:
        """Too much waits for a reader, who has some time to take it."""
        super().pause_writing()
        self._set_timer(STALL_SECONDS)

    def resume_writing(self) -> None:
        """The reader goes on."""
        super().resume_writing()
        if self._is_answering():
            self._set_timer(None)

    def end(self) -> None:
        """Close the connection now, whatever waits to be sent."""
        self._leave()
        self.transport.abort()

    def _is_answering(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete

    def _wait(self) -> None:
        self._others.wait(self)
        self._set_timer(HEAD_SECONDS)

    def _leave(self) -> None:
        self._ended = True
        self._others.leave(self)
        self._set_timer(None)

    def _set_timer(self, seconds: float | None) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = None if seconds is None else self.loop.call_later(seconds, self.end)
