# SPDX-License-Identifier: Apache-2.0
"""A browser, two cells that were baked once, and pages that show them; skipped only without a Chromium."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import deltalux as dl
import pytest
from deltalux.server.web.serving import Server

from viewer.page.browsers import CHROMIUM, launched
from viewer.page.driver import Viewer
from viewer.page.two_cells import make_session
from viewer.served_room import saved

SIZE = {"width": 940, "height": 440}  # leaves 640 × 360 to the picture


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed; `apt-get install chromium` brings one")
    with launched(tmp_path_factory.mktemp("browser"), SIZE) as context:
        yield context


@pytest.fixture
def pages() -> list[Any]:
    """The pages that a test has opened."""
    return []


@pytest.fixture
def open_page(browser: Any, pages: list[Any]) -> Iterator[Callable[..., Viewer]]:
    """Opens pages; at the end none of them may have complained."""
    complaints: list[str] = []

    def opened(url: str, link: str = "") -> Viewer:
        page = browser.new_page()
        pages.append(page)
        return Viewer(page, f"{url}&aa=0{link}", complaints)

    yield opened
    for page in pages:
        page.close()
    assert complaints == []


@pytest.fixture(scope="session")
def baked_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return saved(make_session(), tmp_path_factory.mktemp("baked") / "cells.dlx")


@pytest.fixture
def session(baked_file: Path) -> Iterator[dl.Session]:
    with dl.Session.open(baked_file) as session:
        yield session


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path


@pytest.fixture
def server(session: dl.Session, folder: Path, pages: list[Any]) -> Iterator[Server]:
    """A server whose pages end before it: a page complains of a server that is gone."""
    with Server(session, folder=folder) as server:
        yield server
        for page in pages:
            page.close()


@pytest.fixture
def viewer(server: Server, open_page: Callable[..., Viewer]) -> Viewer:
    """A page that shows the baked cells."""
    viewer = open_page(server.url)
    viewer.settle()
    return viewer
