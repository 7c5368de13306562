# SPDX-License-Identifier: Apache-2.0
"""The drawn mesh is refined where shadows lie once light rests; pins and earlier light go along."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.server.web.serving import Server

from viewer.page.two_cells import make_session
from viewer.served_room import saved

DETAIL = 0.04  # metres


@pytest.fixture(scope="module")
def fine_file(tmp_path_factory):
    return saved(make_session(40_000, DETAIL), tmp_path_factory.mktemp("fine") / "cells.dlx")


@pytest.fixture
def fine(fine_file, open_page):
    """A page whose mesh has been refined where the shadows of movables lie, too."""
    with dl.Session.open(fine_file) as session, Server(session) as server:
        viewer = open_page(server.url)
        viewer.until("deltalux.state().geometry === 1")
        viewer.settle()
        yield viewer
        viewer.end(server)


def changes(viewer) -> tuple[list[float], list[float]]:
    """What probes in the left and in the right cell say of the change since the last edit."""
    width = viewer.state()["canvas"]["width"]
    found: tuple[list[float], list[float]] = ([], [])
    for x, y in viewer.places(24, 14):
        probe = viewer.probe(x, y)
        if probe and probe["sampled"] and probe["name"] not in ("crate", "post"):
            found[x > width / 2].append(probe["reading"]["change"])
    return found


def test_the_mesh_follows_a_shadow_and_what_did_not_change_stays_exactly(fine):
    spot = (0.25 * fine.state()["canvas"]["width"], 0.4 * fine.state()["canvas"]["height"])
    canvas = fine.state()["canvas"]
    fine.page.mouse.click(canvas["x"] + spot[0], canvas["y"] + spot[1])
    fine.until("document.querySelectorAll('.pin').length === 1")
    fine.show("difference")
    fine.after(lambda: fine.drag_arrow("X", (-40, 0)))
    fine.until("deltalux.state().geometry === 2")
    fine.settle()
    left, right = changes(fine)
    assert len(right) > 40
    assert set(right) == {0}
    assert np.count_nonzero(left) > 20
    assert fine.page.locator(".pin").count() == 1
    pinned = fine.page.locator(".pin b").inner_text()
    fine.show("lit")
    value = fine.probe(*spot)["reading"]["value"]
    assert float(pinned.replace(",", "")) == pytest.approx(value, rel=0.02)


def test_a_page_that_comes_later_shows_the_same(fine, open_page):
    fine.press("Escape")  # nothing selected, no arrows
    fine.settle()
    picture, link = fine.picture(), fine.ask("location.hash")
    later = open_page(fine.page.url.split("&")[0], link)
    later.settle()
    later.press("Escape")
    later.settle()
    assert later.state()["geometry"] == 1
    assert np.abs(later.picture() - picture).mean() < 0.5
    later.page.goto("about:blank")
