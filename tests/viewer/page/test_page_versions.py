# SPDX-License-Identifier: Apache-2.0
"""What takes another bake, asked for in the page: a lamp in a dark scene, moving what could not be moved."""

from __future__ import annotations

import threading

import deltalux as dl
import numpy as np
import pytest
from deltalux.server.engine import bakes
from deltalux.server.engine.remaking import samples_like
from deltalux.server.web.serving import Server
from rooms import box, translation

from viewer.served_room import saved

BAKE = 120.0  # seconds that a small bake has


def dark_cell() -> dl.Session:
    """A cell that is open to the front, without lamps, and nothing in it can be moved."""
    vertices, triangles = box((2.0, 2.0, 2.0), (0.0, 1.0, 0.0), inward=True)
    is_front = (vertices[triangles][:, :, 2] > 0.99).all(axis=1)
    meshes = [
        dl.Mesh("cell", vertices, triangles[~is_front], "plaster"),
        dl.Mesh("crate", *box((0.5, 0.5, 0.5), (0.0, 0.25, 0.0)), "oak", pose=translation(-0.4, 0.001, 0.1)),
    ]
    materials = [dl.Material("plaster", (0.7, 0.68, 0.65)), dl.Material("oak", (0.5, 0.35, 0.2))]
    camera = dl.scene.Camera("front", translation(0.0, 1.0, 4.3), np.radians(35))
    scene = dl.Scene(meshes, materials, unit="lux", cameras=[camera])
    samples = dl.Samples.on_vertices(scene, spacing=0.5, radius=0.2)
    return dl.Session(scene, samples, paths=20_000, gather="off", threads=2)


@pytest.fixture(scope="module")
def dark_file(tmp_path_factory):
    return saved(dark_cell(), tmp_path_factory.mktemp("dark") / "dark.dlx")


@pytest.fixture
def dark(dark_file, open_page):
    with dl.Session.open(dark_file) as session, Server(session) as server:
        viewer = open_page(server.url)
        viewer.settle()
        yield viewer
        viewer.end(server)


def said(viewer) -> str:
    return viewer.page.locator(".light-state").inner_text()


def close_notes(viewer) -> None:
    """Notes may cover what is to be clicked."""
    for note in viewer.page.locator(".note button").all()[::-1]:
        note.click()


def test_a_dark_scene_is_offered_a_lamp_that_undo_takes_back(dark):
    page = dark.page
    assert "There is no light in this scene" in said(dark)
    clay = dark.picture()
    assert np.percentile(clay, 90) > 60  # shapes can be seen
    camera = dark.state()["camera"]
    dark.button("Add a lamp").click()
    dark.until("deltalux.state().server.factors.lamp === 1 && deltalux.idle()", BAKE)
    assert not page.locator(".light-state").is_visible()
    assert np.percentile(dark.picture(), 90) > 90  # metered anew
    assert (dark.picture() != clay).mean() > 0.5
    page.get_by_label("Light of lamp", exact=True).wait_for()
    assert dark.state()["camera"] == camera
    dark.after(lambda: dark.press("Control+z"), "deltalux.state().server.dark")
    assert "No lamp shines" in said(dark)
    assert dark.picture().max() < 60
    dark.after(lambda: dark.button("Switch them on").click(), "!deltalux.state().server.dark")


def test_something_fixed_becomes_movable_and_the_view_stays(dark):
    page = dark.page
    dark.button("Add a lamp").click()
    dark.until("deltalux.state().server.factors.lamp === 1 && deltalux.idle()", BAKE)
    dark.press("m")
    close_notes(dark)
    page.mouse.click(*dark.ask("deltalux.project('crate')"))
    assert dark.state()["selected"] == "crate"
    assert dark.ask("deltalux.gizmoHandle('X')") is None
    camera = dark.state()["camera"]
    dark.button("Make movable").click()
    dark.until("'crate' in deltalux.state().poses && deltalux.idle()", BAKE)
    assert dark.state()["camera"] == camera
    assert dark.state()["selected"] == "crate"
    # What was remembered is known where the mesh has the same vertices: nearly everywhere.
    dark.show("difference")
    changes = [dark.probe(x, y) for x, y in dark.places(12, 8)]
    known = [p["reading"]["change"] is not None for p in changes if p and p["reading"]]
    assert sum(known) > 0.7 * len(known)
    before = dark.pose("crate")
    page.get_by_label("Position X, m").fill("-0.6")
    dark.after(lambda: dark.press("Enter"))
    assert dark.pose("crate")[0, 3] == pytest.approx(before[0, 3] - 0.2)
    dark.press("x")
    dark.until("deltalux.state().checked?.same === true", BAKE)


def test_it_can_be_cancelled(dark, monkeypatch):
    cancelled = threading.Event()

    def slowly(*made):
        cancelled.wait(BAKE)
        return samples_like(*made)

    monkeypatch.setattr(bakes, "samples_like", slowly)
    close_notes(dark)
    dark.page.mouse.click(*dark.ask("deltalux.project('crate')"))
    dark.button("Make movable").click()
    dark.button("Cancel").click()
    cancelled.set()
    dark.page.get_by_text("The bake was cancelled").wait_for()
    dark.until("deltalux.state().server.phase === 'ready'", BAKE)
    assert "crate" not in dark.state()["poses"]
    assert dark.button("Make movable").is_enabled()
