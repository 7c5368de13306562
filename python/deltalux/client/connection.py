# SPDX-License-Identifier: Apache-2.0
"""A connection to a server: sends requests, receives answers, and keeps the state up to date."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit, urlunsplit

import numpy as np

from deltalux import threads
from deltalux.errors import Error, OptionError
from deltalux.server.extra import check_extra
from deltalux.server.protocol.arrays import read_arrays
from deltalux.server.protocol.messages import MAX_TEXT
from deltalux.server.web.short_log import without_tokens

Arrays = dict[str, np.ndarray]
_SCHEMES = {"http": "ws", "https": "wss", "ws": "ws", "wss": "wss"}
MOST_SAID = 300  # characters of another server's answer
_EXAMPLE = "http://127.0.0.1:8000/?token=…"


def socket_address(address: str) -> str:
    """WebSocket address of the server that served this page address.

    Raises
    ------
    OptionError
    """
    try:
        parts = urlsplit(address)
        known = parts.scheme in _SCHEMES and bool(parts.hostname) and (parts.port or 1) > 0
    except (ValueError, TypeError, AttributeError):
        known = False
    if not known:
        raise OptionError(
            f"connect: found {without_tokens(repr(address)):.100}, expected the address that `deltalux "
            f"serve` printed, such as {_EXAMPLE}"
        )
    path = parts.path.rstrip("/")
    query = "&".join(filter(None, [parts.query, "frames=0"]))
    return urlunsplit(
        (_SCHEMES[parts.scheme], parts.netloc, path if path.endswith("/ws") else path + "/ws", query, "")
    )


class Connection:
    """One connection, and the thread that receives its messages.

    Parameters
    ----------
    address : see `socket_address`
    seconds : for connecting

    Raises
    ------
    OptionError, Error
    """

    def __init__(self, address: str, seconds: float) -> None:
        check_extra("connect")
        self._changed = threading.Condition()
        self._state: dict[str, Any] | None = None
        self._answers: dict[int, dict[str, Any]] = {}
        self._wanted: set[int] = set()
        self._ended: str | None = None
        self._ids = 0
        self._socket = _connected(socket_address(address), seconds)
        receiver = threading.Thread(target=self._receive, name="deltalux-client", daemon=True)
        try:
            threads.start(receiver)
        except Error:
            self._socket.close()
            raise
        self._wait(lambda: self._state is not None, seconds)

    @property
    def state(self) -> dict[str, Any]:
        """The newest `state` message of the server."""
        with self._changed:
            assert self._state is not None
            return self._state

    def ask(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Send a request and wait for its answer without a time limit; the answer's arrays are in `values`.

        Raises
        ------
        OptionError
            If the server refuses the request.
        Error
            If the connection has ended.
        """
        from websockets.exceptions import ConnectionClosed

        with self._changed:
            self._ids += 1
            number = self._ids
            self._wanted.add(number)
        try:
            text = json.dumps({"type": kind, "id": number, **fields}, allow_nan=False)
            if len(text) > MAX_TEXT:
                raise OptionError(
                    f"{kind}: found {len(text):,} bytes of edits, expected up to {MAX_TEXT:,}; call update() "
                    "after fewer of them"
                )
            with suppress(ConnectionClosed):  # the receiving thread reports the reason
                self._socket.send(text)
            self._wait(lambda: number in self._answers)
            answer = self._answers.pop(number)
        finally:
            with self._changed:
                self._wanted.discard(number)
                self._answers.pop(number, None)
        if answer["type"] == "error":
            raise OptionError(answer["message"])
        return answer

    def close(self) -> None:
        """End the connection; may be called again."""
        with self._changed:
            self._ended = self._ended or "connection: it was closed; connect again"
        self._socket.close()

    def _wait(self, arrived: Callable[[], bool], seconds: float | None = None) -> None:
        """Wait until `arrived` is true; raise Error if the connection ended before, or time is up."""
        with self._changed:
            self._changed.wait_for(lambda: arrived() or self._ended is not None, seconds)
            if arrived():
                return
            reason = self._ended or f"connect: found no answer within {seconds:g} s, expected a state"
        self.close()
        raise Error(reason)

    def _receive(self) -> None:
        from websockets.exceptions import ConnectionClosed

        reason = "the server has ended the connection"
        try:
            for message in self._socket:
                self._take(message)
        except ConnectionClosed as error:
            said = error.rcvd.reason if error.rcvd else ""
            reason = f"the server has ended the connection ({said or 'without a word'})"
        except Exception as error:  # whatever it is, a waiting caller must learn of it
            reason = f"found no message of a server of Deltalux ({error})"
        with self._changed:
            self._ended = self._ended or f"connection: {reason}; connect again"
            self._changed.notify_all()

    def _take(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            header, arrays = read_arrays(message)
            data = {**header, "values": arrays}
        else:
            data = json.loads(message)
        with self._changed:
            if data["type"] == "state":
                self._state = data
            elif data.get("id") in self._wanted:
                self._answers[data["id"]] = data
            self._changed.notify_all()


def _connected(address: str, seconds: float) -> Any:
    from websockets.exceptions import InvalidHandshake, InvalidStatus, InvalidURI
    from websockets.sync.client import connect

    shown = address.partition("?")[0]
    try:
        # No proxy and no compression: the server is on this machine, or behind a forwarded port.
        options = {"max_size": None, "compression": None, "proxy": None}
        return connect(address, open_timeout=seconds, **options).__enter__()  # closed by `Connection.close`
    except InvalidStatus as error:
        said = (error.response.body or b"").decode("utf-8", "replace").strip()[:MOST_SAID]
        if error.response.status_code == 403:
            raise OptionError(f"connect {shown}: {said or '403'}") from None
        raise Error(
            f"connect {shown}: found another server there (answer {error.response.status_code}), expected "
            "one that `deltalux serve` or `deltalux view` started"
        ) from None
    except (InvalidHandshake, InvalidURI) as error:
        raise Error(
            f"connect {shown}: found no server of Deltalux there ({without_tokens(str(error))})"
        ) from None
    except TimeoutError:
        raise Error(f"connect {shown}: found no answer within {seconds:g} s") from None
    except OSError as error:
        raise Error(
            f"connect {shown}: found no server there ({error.strerror or error}); start one with "
            "`deltalux serve SESSION.dlx`"
        ) from None
