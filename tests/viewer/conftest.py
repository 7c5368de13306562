# SPDX-License-Identifier: Apache-2.0
"""A small room, baked once, and servers of copies of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import deltalux as dl
import pytest
from deltalux.server.web.serving import Server

from viewer.served_room import make_session, saved


@pytest.fixture(scope="session")
def baked_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A saved session of the room."""
    return saved(make_session(), tmp_path_factory.mktemp("session") / "room.dlx")


@pytest.fixture
def session(baked_file: Path) -> Iterator[dl.Session]:
    """A baked session of the room."""
    with dl.Session.open(baked_file) as opened:
        yield opened


@pytest.fixture(scope="session")
def stub_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a page."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "index.html").write_text("<p>a page")
    return folder


@pytest.fixture
def serve(stub_page: Path) -> Iterator[Callable[..., Server]]:
    """Serve sessions until the test ends."""
    with ExitStack() as stack:

        def start(session: dl.Session, **options: Any) -> Server:
            return stack.enter_context(Server(session, page=stub_page, **options))

        yield start


@pytest.fixture
def served(session: dl.Session, serve: Callable[..., Server], tmp_path: Path) -> Server:
    """The room, for programs."""
    return serve(session, shown=False, folder=tmp_path)


@pytest.fixture
def client(served: Server) -> Iterator[dl.client.Client]:
    with dl.connect(served.url) as connected:
        yield connected


@pytest.fixture
def own(baked_file: Path) -> Iterator[dl.Session]:
    """Another session of the same file."""
    with dl.Session.open(baked_file) as opened:
        yield opened
