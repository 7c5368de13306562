# SPDX-License-Identifier: Apache-2.0
"""Fuzz target: the viewer's hub and engine by messages, and its server by raw sockets.

Afterwards the engine must rest, a check must find the digest of a recompute, and the export folder must hold
nothing that was not asked for properly.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import shutil
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import deltalux as dl
from deltalux.server.exports import SUFFIXES, Exports
from deltalux.server.hub import Hub
from deltalux.server.page import Page
from deltalux.server.protocol.arrays import read_arrays
from deltalux.server.protocol.frames import FrameHeader, apply_frame
from deltalux.server.web.serving import Server
from viewer.page_client import PageClient
from viewer.served_room import make_session

from fuzz.harness import MIB, Limits
from fuzz.mutate_json import Rng
from fuzz.viewer_messages import connections, steps

PATHS = 1000
PATIENCE = 60.0  # seconds until the engine must rest
OVER_SOCKETS = 0.15  # share of cases
THEIRS = "theirs.csv"  # a file of somebody else in the export folder


class ViewerTarget:
    """Plays random sequences of messages."""

    name = "viewer"
    limits = Limits(growth=384 * MIB, wall_seconds=180.0)

    def prepare(self, seeds: Path, scenes: Path | None) -> None:
        """A baked session of the room."""
        with make_session(PATHS) as session:
            session.bake()
            session.save(seeds / "room.dlx")

    def load(self, seeds: Path) -> None:
        """Remember where it is."""
        self._session = (seeds / "room.dlx").read_bytes()

    def make(self, rng: Rng, folder: Path) -> None:
        """A session and what is sent."""
        (folder / "room.dlx").write_bytes(self._session)
        case: dict[str, Any] = {}
        if rng.random() < OVER_SOCKETS:
            case["connections"] = connections(rng)
        else:
            case["steps"] = steps(rng)
        (folder / "case.json").write_text(json.dumps(case))

    def run(self, folder: Path) -> None:
        """Play it."""
        case = json.loads((folder / "case.json").read_text())
        exports = folder / "exports"
        shutil.rmtree(exports, ignore_errors=True)
        exports.mkdir()
        (exports / THEIRS).write_text("mine")
        (exports / "link.dlx").symlink_to(folder / "elsewhere.dlx")
        with dl.Session.open(folder / "room.dlx", threads=1) as session, no_errors_logged():
            if "steps" in case:
                asyncio.run(play_messages(session, case["steps"], exports))
            else:
                play_connections(session, case["connections"], exports)
        assert (exports / THEIRS).read_text() == "mine"
        assert {path.name for path in folder.iterdir()} == {"room.dlx", "case.json", "exports"}
        assert all(path.suffix in SUFFIXES for path in exports.iterdir())


class _Records(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.texts.append(logging.Formatter().format(record))


@contextlib.contextmanager
def no_errors_logged() -> Iterator[None]:
    """AssertionError where something logs an error: what a server's loop does with exceptions."""
    records = _Records()
    logging.getLogger().addHandler(records)
    try:
        yield
    finally:
        logging.getLogger().removeHandler(records)
    assert not records.texts, "\n".join(records.texts)


class _Reader:
    """Takes what a page of the hub gets, as a browser does; strictly."""

    def __init__(self, hub: Hub) -> None:
        self.page: Page = hub.connect()
        self.state: dict[str, Any] = {}
        self.told: dict[str, dict[str, Any]] = {}
        self._rows: Any = None
        self.frame: FrameHeader | None = None

    def fetch(self) -> None:
        """Take everything that waits."""

        def refuse(constant: str) -> None:
            raise AssertionError(f"a message holds {constant}")

        while (written := self.page.next_text()) is not None:
            message = json.loads(written, parse_constant=refuse)
            self.told[message["type"]] = message
            if message["type"] == "state":
                self.state = message
        if isinstance(answer := self.page.next_answer(), bytes):
            assert read_arrays(answer)[0]["type"] == "values"
        elif answer is not None:
            assert json.loads(answer, parse_constant=refuse)["type"] in ("finished", "error")
        while self.page._latest is not None and (frame := self.page.next_frame()) is not None:
            self.frame, self._rows = apply_frame(frame, self._rows)
            self.page.acknowledge(self.frame.seq)


async def play_messages(session: dl.Session, sequence: list[list[Any]], folder: Path) -> None:
    """Let pages come, send, leave; then check."""
    hub = Hub(session, Exports(folder), None)
    hub.open()
    try:
        readers: dict[int, _Reader] = {}
        for kind, subject, *more in sequence:
            if kind == "wait":
                await asyncio.sleep(subject)
                continue
            if kind == "leave":
                if subject in readers:
                    hub.disconnect(readers.pop(subject).page)
                continue
            if subject not in readers:
                readers[subject] = _Reader(hub)
            reader = readers[subject]
            if kind == "fetch":
                reader.fetch()
            else:
                hub.receive(reader.page, more[0])
        for reader in readers.values():
            hub.disconnect(reader.page)
        await _check_rest(hub)
    finally:
        await asyncio.to_thread(hub.close)


async def _check_rest(hub: Hub) -> None:
    """The engine rests with light of the last revision, which is that of a recompute."""
    reader = _Reader(hub)
    await _until(reader, lambda: reader.state.get("phase") in ("ready", "empty"))
    if reader.state["phase"] == "empty":
        await _ask(hub, reader, "bake")
        await _until(reader, lambda: reader.state["phase"] == "ready")
    for _ in range(2):
        reader.told.pop("checked", None)
        await _ask(hub, reader, "check")
        await _until(reader, lambda: "checked" in reader.told)
        assert reader.told["checked"]["same"], "the light is not that of a recompute"
    await _until(reader, lambda: reader.state["phase"] == "ready" and _is_shown(reader))


async def _ask(hub: Hub, reader: _Reader, kind: str) -> None:
    """Give the engine a task, after those that it has."""
    while True:
        reader.told.pop("error", None)
        reader.told.pop("accepted", None)
        hub.receive(reader.page, json.dumps({"type": kind, "id": 1}))
        await _until(reader, lambda: "error" in reader.told or "accepted" in reader.told)
        if "accepted" in reader.told:
            return
        assert "still at work" in reader.told["error"]["message"], reader.told["error"]["message"]
        await asyncio.sleep(0.005)


def _is_shown(reader: _Reader) -> bool:
    return reader.frame is not None and reader.frame.revision == reader.state["revision"]


async def _until(reader: _Reader, arrived: Any) -> None:
    async def wait() -> None:
        while True:
            reader.fetch()
            if arrived():
                return
            await asyncio.sleep(0.002)

    await asyncio.wait_for(wait(), PATIENCE)


def play_connections(session: dl.Session, found: list[dict[str, Any]], folder: Path) -> None:
    """Send to a real server what sockets can carry; afterwards a good page must be served."""
    page = folder.parent / "case.json"  # any folder with an index.html will do
    stub = folder / "stub"
    stub.mkdir()
    (stub / "index.html").write_text(f"<p>{page.name}")
    with Server(session, folder=folder, page=stub) as server:
        for connection in found:
            _send_all(server, connection)
        with PageClient(server) as client:
            client.rest()
            client.digest()
    shutil.rmtree(stub)


def _send_all(server: Server, connection: dict[str, Any]) -> None:
    """Send the pieces and take what comes, until one side has had enough."""
    with (
        socket.create_connection(("127.0.0.1", server.port), timeout=2) as link,
        contextlib.suppress(OSError),
    ):
        if connection["handshake"]:
            link.sendall(
                f"GET /ws?token={server.token} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n"
                "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
            )
            assert link.recv(1 << 16).startswith(b"HTTP/1.1 101")
        for piece in connection["data"]:
            data = piece.encode("latin-1")
            data = data.replace(b"TOKEN", server.token.encode()).replace(b"PORT", str(server.port).encode())
            link.sendall(data)
        link.settimeout(0.05)
        while link.recv(1 << 16):
            pass
