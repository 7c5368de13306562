# SPDX-License-Identifier: Apache-2.0
"""Objects are selected and moved on the page: by arrow, by themselves, by numbers and keys; and back."""

from __future__ import annotations

import re

import numpy as np
import pytest


def checked_digest(viewer) -> str:
    """Digest of the server's present state, which must be that of a recompute."""
    viewer.button("Check exactness").click()  # which clears the verdict before
    viewer.until("document.querySelector('.verdict').textContent !== ''")
    viewer.settle()
    checked = viewer.state()["checked"]
    assert checked["same"]
    return checked["digest"]


def test_first_movable_is_selected_and_the_hint_names_it(viewer):
    hint = viewer.page.locator(".hint")
    assert viewer.state()["selected"] == "crate" and "crate" in hint.inner_text()
    viewer.after(lambda: viewer.drag_arrow("X", (20, 0)))
    assert hint.is_hidden()


def test_arrows_have_no_heads_at_their_far_ends(viewer):
    canvas, handle = viewer.state()["canvas"], np.array(viewer.ask("deltalux.gizmoHandle('X')"))
    pivot = np.array(viewer.ask(f"deltalux.place({viewer.pose('crate')[:3, 3].tolist()})"))
    far = pivot - (handle - pivot) / 1.1  # where the other head was
    x, y = (far - (canvas["left"], canvas["top"])).astype(int)
    red, green, blue = viewer.picture()[y - 6 : y + 7, x - 6 : x + 7].reshape(-1, 3).T
    assert not ((red > 200) & (green < 60) & (blue < 60)).any()


def test_arrow_moves_along_its_axis_and_undo_brings_the_same_digest_back(viewer):
    start, before = checked_digest(viewer), viewer.pose("crate")
    viewer.after(lambda: viewer.drag_arrow("X", (-30, 0)), "deltalux.state().server.undo !== null")
    moved = viewer.pose("crate") - before
    assert moved[0, 3] < -0.1
    assert np.abs(np.delete(moved.ravel(), 3)).max() < 1e-9
    there = checked_digest(viewer)
    assert there != start
    viewer.after(lambda: viewer.press("Control+z"), "deltalux.state().server.undo === null")
    assert (viewer.pose("crate") == before).all()
    assert checked_digest(viewer) == start
    viewer.after(lambda: viewer.press("Control+Shift+z"), "deltalux.state().server.redo === null")
    assert checked_digest(viewer) == there


def test_figures_tell_how_many_of_the_rays_changed(viewer):
    viewer.after(lambda: viewer.drag_arrow("X", (-30, 0)), "deltalux.state().server.undo !== null")
    viewer.settle()
    shown = viewer.page.locator("dl.figures").inner_text().splitlines()
    rays = shown[shown.index("Gather rays cast") + 1]
    assert re.fullmatch(r"[1-9][\d, ]* \((100|\d\d?) % changed\)", rays)


@pytest.mark.parametrize("name", ["post", "crate"])  # the crate is selected: its upright arrow is in the way
def test_object_is_dragged_along_the_floor_by_itself(viewer, name):
    before, camera = viewer.pose(name), viewer.state()["camera"]
    x, y = viewer.ask(f"deltalux.project('{name}')")
    viewer.after(lambda: viewer.drag((x, y), (-25, 10)), "deltalux.state().server.undo !== null")
    way = viewer.pose(name)[:3, 3] - before[:3, 3]
    assert viewer.state()["selected"] == name
    assert way[0] < -0.05 and way[2] > 0.02 and way[1] == 0
    assert viewer.state()["camera"] == camera


def test_light_of_a_drag_reaches_the_picture(viewer, server, session):
    picture = viewer.picture()
    viewer.after(lambda: viewer.drag_arrow("X", (-40, 0)))
    frame = viewer.state()["frame"]
    assert frame["done"] == 1 and 0 < frame["affected_paths"] < frame["paths"]
    assert len(viewer.ask("deltalux.latencies")) > 0
    viewer.press("Escape")
    viewer.settle()
    assert (np.abs(viewer.picture() - picture).max(axis=2) > 8).mean() > 0.01


def test_numbers_place_and_turn_the_object(viewer, server, session):
    def enter(label: str, value: str) -> None:
        field = viewer.page.get_by_label(label)
        field.fill(value)
        field.press("Enter")

    viewer.after(lambda: enter("Position X, m", "-1.3"))
    viewer.after(lambda: enter("Rotation Y, °", "30"))
    pose = viewer.pose("crate")
    turned = np.array([[np.cos(np.pi / 6), 0, 0.5], [0, 1, 0], [-0.5, 0, np.cos(np.pi / 6)]])
    assert np.allclose(pose[:3, :3], turned, atol=1e-12)
    assert np.allclose(pose[:3, 3], (-1.3, 0.001, 0.1), atol=1e-12)
    viewer.end(server)
    assert (session.pose("crate") == pose).all()


def test_snapping_and_keys(viewer):
    viewer.press("s")
    viewer.after(lambda: viewer.drag_arrow("X", (-37, 0)))
    steps = viewer.pose("crate")[0, 3] / 0.1
    assert abs(steps - round(steps)) < 1e-6 and -18 < steps < -11
    before = viewer.pose("crate")[2, 3]
    viewer.after(lambda: viewer.press("ArrowUp"))
    assert abs(viewer.pose("crate")[2, 3] - (before - 0.1)) < 1e-9


def test_removed_object_disappears_and_comes_back(viewer):
    start = checked_digest(viewer)
    viewer.after(lambda: viewer.button("Remove").click(), "deltalux.state().server.poses.crate === null")
    assert viewer.state()["poses"]["crate"] is None
    viewer.after(lambda: viewer.button("Put back").click(), "deltalux.state().server.poses.crate !== null")
    assert checked_digest(viewer) == start


def test_refused_pose_is_explained_and_taken_back(viewer):
    before = viewer.pose("crate")
    field = viewer.page.get_by_label("Position X, m")
    field.fill("2e15")
    field.press("Enter")
    note = viewer.page.locator(".note.error")
    note.wait_for()
    assert "expected a number from" in note.inner_text()
    viewer.settle()
    assert (viewer.pose("crate") == before).all()


def test_time_line_records_and_plays_a_move(viewer):
    start = viewer.pose("crate")
    viewer.button("● Record").click()
    viewer.after(lambda: viewer.drag_arrow("X", (-40, 0)))
    end = viewer.pose("crate")
    viewer.button("● Record").click()
    slider = viewer.page.get_by_label("Time, seconds")
    x = "deltalux.state().server.poses.crate[12]"
    viewer.after(lambda: slider.fill("0"), f"Math.abs({x} - {start[0, 3]}) < 0.1")
    viewer.after(lambda: viewer.button("▶ Play").click(), f"{x} === {end[0, 3]}")
    assert (viewer.pose("crate") == end).all()
