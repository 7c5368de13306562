# SPDX-License-Identifier: Apache-2.0
"""A page without a picture: talks the protocol, applies frames, waits on messages."""

from __future__ import annotations

import json
import urllib.request
from collections.abc import Callable
from typing import Any

import numpy as np
from deltalux.server.protocol.frames import PREVIEW, apply_frame
from deltalux.server.web.serving import Server
from websockets.sync.client import ClientConnection, connect

TIMEOUT = 30  # seconds; a message that has not come by then never will


def decoded(rows: np.ndarray, scale: float) -> np.ndarray:
    """(n, 4) R, G, B irradiance and photopic standard error."""
    return rows.view("<f2").reshape(-1, 4).astype(np.float64) / scale


class PageClient:
    """One connection; `rows` are the values that the frames so far make."""

    def __init__(self, server: Server, **options: Any) -> None:
        self._context = connect(
            f"ws://127.0.0.1:{server.port}/ws?token={server.token}",
            max_size=None,
            max_queue=None,  # else a page that does not read does not see the connection's end either
            compression=None,
            **options,
        )
        self.connection: ClientConnection = self._context.__enter__()
        self.rows: np.ndarray | None = None
        self.frame: dict[str, Any] = {}
        self.state: dict[str, Any] = {}
        self.acknowledging = True
        self.revision = 0  # that holds the last accepted edit
        self._ids = 0

    def __enter__(self) -> PageClient:
        return self

    def __exit__(self, *_: Any) -> None:
        self._context.__exit__(None, None, None)

    def take(self) -> dict[str, Any]:
        """The next message; frames are applied and come as type "values"."""
        message = self.connection.recv(TIMEOUT)
        if isinstance(message, bytes):
            header, self.rows = apply_frame(message, self.rows)
            self.frame = header._asdict()
            if self.acknowledging:
                self.acknowledge()
            return {"type": "values", **self.frame}
        data = json.loads(message)
        if data["type"] == "state":
            self.state = data
        elif data["type"] == "accepted":
            self.revision = data["revision"]
        return data

    def acknowledge(self) -> None:
        """Say that the last frame is on the screen."""
        self.connection.send(json.dumps({"type": "ack", "seq": self.frame["seq"]}))

    def until(self, wanted: str | Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Take messages up to the first one of a type, or that a predicate likes."""
        while True:
            data = self.take()
            if data["type"] == wanted if isinstance(wanted, str) else wanted(data):
                return data

    def send(self, kind: str, **fields: Any) -> int:
        """Send a request; returns its id."""
        self._ids += 1
        self.connection.send(json.dumps({"type": kind, "id": self._ids, **fields}))
        return self._ids

    def ask(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Send a request and take messages up to its answer."""
        number = self.send(kind, **fields)
        return self.until(lambda data: data.get("id") == number)

    def rest(self) -> None:
        """Take messages until the engine has done everything and the values of it are here."""
        while not (
            self.state.get("phase") == "ready"
            and self.state["revision"] >= self.revision
            and self.frame.get("revision") == self.state["revision"]
            and not self.frame["flags"] & PREVIEW
        ):
            self.take()

    def digest(self) -> str:
        """The digest that a check finds, which must be that of a computation from scratch."""
        self.send("check")
        checked = self.until("checked")
        assert checked["same"]
        return checked["digest"]


def get(
    server: Server, path: str, token: str | None = None, more: str = "", **headers: str
) -> urllib.request.addinfourl:
    """GET an address of the server; `more` comes after the token."""
    query = f"?token={server.token if token is None else token}{more}"
    request = urllib.request.Request(f"http://127.0.0.1:{server.port}{path}{query}", headers=headers)
    return urllib.request.urlopen(request, timeout=TIMEOUT)
