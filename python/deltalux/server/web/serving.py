# SPDX-License-Identifier: Apache-2.0
"""A server in a thread of its own."""

from __future__ import annotations

import os
import secrets
import socket
import threading
from functools import partial
from pathlib import Path
from typing import Any

import uvicorn

from deltalux import threads
from deltalux.errors import Error, OptionError
from deltalux.server.drawn.geometry import geometry_of
from deltalux.server.exports import Exports
from deltalux.server.hub import Hub
from deltalux.server.protocol.messages import MAX_TEXT
from deltalux.session import Session

from .app import make_app
from .connections import AT_ONCE, Connection, Connections, most_connections
from .short_log import keep_short

PAGE = Path(__file__).parents[2] / "viewer"


class Server:
    """Serves one session to any number of pages.

    Parameters
    ----------
    session : Session
        Only the server may use it until `close` has returned.
    host, port : address to listen on; port 0 = a free one
    folder : where pages may export to; None = exports are refused
    page : folder of the page's static files; None = the package's own
    shown : the server is mainly for pages; otherwise values are encoded only while a page is connected, and
        there is no page if the samples are on no display mesh

    Raises
    ------
    OptionError, Error, OSError
    """

    def __init__(
        self,
        session: Session,
        host: str = "127.0.0.1",
        port: int = 0,
        folder: str | os.PathLike[str] | None = None,
        page: Path | None = None,
        shown: bool = True,
    ) -> None:
        page = page or PAGE
        if not (page / "index.html").is_file():
            raise Error(f'view: found no page in "{page}", expected index.html; install the package again')
        exports = Exports(folder, "deltalux view" if shown else "deltalux serve")
        self.has_page = shown or session.samples.display is not None
        geometry = geometry_of(session) if self.has_page else None
        self._socket = _listen(host, port)
        self.port: int = self._socket.getsockname()[1]
        self._host, self.token = host, secrets.token_urlsafe()
        app = make_app(
            Hub(session, exports, geometry, shown),
            exports,
            run=secrets.token_hex(4),
            host=host,
            token=self.token,
            page=page,
        )
        self._server = uvicorn.Server(
            uvicorn.Config(
                app,
                http=partial(Connection, Connections(most_connections())),  # type: ignore[arg-type]
                backlog=AT_ONCE,
                ws="websockets-sansio",
                ws_per_message_deflate=False,
                ws_max_size=MAX_TEXT,
                lifespan="on",
                log_config=None,
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=2,
            )
        )
        keep_short()
        # An event, because Ctrl-C during Thread.join() makes Python 3.11 believe that the thread has ended.
        self._ended = threading.Event()
        thread = threading.Thread(target=self._run, name="deltalux-server", daemon=True)
        try:
            threads.start(thread)
        except Error:
            self._socket.close()
            raise

    def _run(self) -> None:
        try:
            self._server.run([self._socket])
        finally:
            self._ended.set()

    @property
    def _authority(self) -> str:
        host = "localhost" if self._host in ("0.0.0.0", "::") else self._host
        return f"[{host}]:{self.port}" if ":" in host else f"{host}:{self.port}"

    @property
    def url(self) -> str:
        """The page's address, with the token."""
        return f"http://{self._authority}/?token={self.token}"

    @property
    def places(self) -> dict[str, Any]:
        """Addresses of the server's parts, for programs."""
        return {
            "address": self.url,
            "websocket": f"ws://{self._authority}/ws?token={self.token}",
            "token": self.token,
            "port": self.port,
            "page": self.has_page,
        }

    def wait(self, seconds: float | None = None) -> None:
        """Block until the server has stopped, or for at most `seconds`."""
        self._ended.wait(seconds)

    def close(self) -> None:
        """Stop engine and server; the present task is cancelled, and the session stays valid."""
        self._server.should_exit = True
        self._ended.wait()

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


def _listen(host: str, port: int) -> socket.socket:
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
    except (OSError, UnicodeError) as error:
        raise OptionError(
            f"host: found {host[:60]!r}, expected an address of this machine, such as 127.0.0.1 ({error})"
        ) from None
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen()  # from now on connections wait until the server accepts them
    except OSError as error:
        listener.close()
        raise OSError(error.errno, f"{error.strerror}; choose another --port", f"{host}:{port}") from None
    return listener
