# SPDX-License-Identifier: Apache-2.0
"""Cameras, rings and fingers: flying, orbiting, turning an object by its ring, touching, measuring."""

from __future__ import annotations

import numpy as np


def camera_pose(viewer) -> np.ndarray:
    return np.array(viewer.state()["camera"]["pose"]).reshape(4, 4).T


def corner(viewer) -> tuple[float, float]:
    """A place of the picture with nothing to drag."""
    box = viewer.state()["canvas"]
    return box["left"] + 0.9 * box["width"], box["top"] + 0.15 * box["height"]


def test_flying_goes_where_one_looks_and_the_mouse_turns_the_head(viewer):
    before, light = camera_pose(viewer), viewer.state()["server"]["revision"]
    viewer.press("f")
    viewer.page.keyboard.down("w")
    viewer.until(f"Math.abs(deltalux.state().camera.pose[14] - {before[2, 3]}) > 0.05")
    viewer.page.keyboard.up("w")
    viewer.settle()
    there = camera_pose(viewer)
    way = there[:3, 3] - before[:3, 3]
    assert np.allclose(there[:3, :3], before[:3, :3], atol=1e-6)
    assert way @ -before[:3, 2] > 0.999 * np.linalg.norm(way)  # cameras look along their -Z
    viewer.drag(corner(viewer), (-40, 15))
    viewer.settle()
    turned = camera_pose(viewer)
    assert np.allclose(turned[:3, 3], there[:3, 3], atol=1e-6)
    assert turned[:3, 2] @ there[:3, 2] < 0.999
    assert abs(turned[1, 0]) < 1e-6  # the horizon stays level
    viewer.press("f")
    viewer.drag(corner(viewer), (-40, 15))  # orbits again, around what was looked at
    viewer.settle()
    orbited = camera_pose(viewer)
    assert np.linalg.norm(orbited[:3, 3] - turned[:3, 3]) > 0.05
    assert viewer.state()["server"]["revision"] == light  # nothing was moved


def test_ring_turns_the_object_in_steps_of_fifteen_degrees(viewer, server, session):
    before = viewer.pose("crate")
    viewer.press("e")
    viewer.press("s")
    viewer.settle()
    start = viewer.ask("deltalux.gizmoHandle('X')")  # the rings about the other axes pass here
    viewer.page.mouse.move(*start)
    viewer.until("['Y', 'Z'].includes(deltalux.gizmoAxis())")
    axis = "XYZ".index(viewer.ask("deltalux.gizmoAxis()"))
    viewer.after(lambda: viewer.drag(start, (25, 25)), "deltalux.state().server.undo !== null")
    turn = viewer.pose("crate")[:3, :3] @ before[:3, :3].T
    steps = np.degrees(np.arccos((np.trace(turn) - 1) / 2)) / 15
    assert abs(steps - round(steps)) < 1e-6 and round(steps) != 0
    assert np.allclose(turn[:, axis], np.eye(3)[axis], atol=1e-9)
    pose = viewer.pose("crate")
    viewer.end(server)
    assert (session.pose("crate") == pose).all()


def test_one_finger_drags_an_object_and_two_zoom(viewer):
    before, camera = viewer.pose("post"), camera_pose(viewer)
    start = tuple(viewer.ask("deltalux.project('post')"))
    viewer.after(lambda: viewer.touch((start, (-25, 10))), "deltalux.state().server.undo !== null")
    way = viewer.pose("post")[:3, 3] - before[:3, 3]
    assert way[0] < -0.05 and way[1] == 0 and (camera_pose(viewer) == camera).all()
    revision = viewer.state()["server"]["revision"]
    x, y = corner(viewer)
    viewer.touch(((x - 30, y), (-60, 0)), ((x, y), (60, 0)))
    viewer.settle()
    shift = camera_pose(viewer)[:3, 3] - camera[:3, 3]
    assert shift @ -camera[:3, 2] > 0.1  # nearer
    assert viewer.state()["server"]["revision"] == revision
    assert viewer.page.locator(".pin").count() == 0


def test_fit_shows_the_selected_object_and_no_wall_before_it(open_page, server):
    behind = [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, -1.05, 1.0, -5, 1, -1.05, 1.0, 0, 35]
    viewer = open_page(server.url, "#eye=" + ",".join(map(str, behind)))
    viewer.settle()

    def seen() -> str:
        (x, y), canvas = viewer.ask("deltalux.project('crate')"), viewer.state()["canvas"]
        return viewer.probe(x - canvas["left"], y - canvas["top"])["name"]

    assert viewer.state()["selected"] == "crate" and seen() == "left cell"  # its back wall, from outside
    viewer.press("Home")
    viewer.settle()
    assert seen() == "crate"
    eye = camera_pose(viewer)[:3, 3]
    assert 0.5 < np.linalg.norm(eye - viewer.pose("crate")[:3, 3]) < 3


def test_measuring_page_takes_the_light_and_draws_next_to_nothing(open_page, server):
    viewer = open_page(server.url, "&bench")
    viewer.settle()
    viewer.after(lambda: viewer.press("ArrowLeft"))
    assert viewer.state()["frame"]["done"] == 1
    assert len(viewer.ask("deltalux.latencies")) == 1 and len(viewer.ask("deltalux.frames")) >= 1
    viewer.press("Escape")  # its outline and arrows
    viewer.settle()
    picture = viewer.picture()[2:-4]  # without its frame
    assert 0 < (picture != picture[0, 0]).any(axis=2).mean() < 0.01  # a triangle of each object


def test_isolux_lines_lie_on_the_ticks_of_a_logarithmic_scale(viewer):
    viewer.press("Escape")
    viewer.show("falseColour")
    viewer.page.get_by_role("checkbox", name="Logarithmic").check()
    viewer.settle()
    scale = viewer.state()["scale"]
    assert scale["logarithmic"]
    plain = viewer.picture()
    viewer.press("i")
    viewer.settle()
    lines = np.abs(viewer.picture() - plain).max(axis=2) > 60
    rows, columns = np.nonzero(lines)
    assert 0.0005 < lines.mean() < 0.2
    decades = np.arange(np.floor(np.log10(scale["low"])), np.ceil(np.log10(scale["high"])) + 1)
    mantissas = (1, 2, 5) if scale["high"] / scale["low"] < 1e3 else (1,)
    ticks = np.sort(np.concatenate([m * 10.0**decades for m in mantissas]))

    def crosses(row, column):
        """Whether the values around a pixel have a tick between them; None where an edge is near."""
        # A line is two pixels wide, with soft edges.
        around = [
            viewer.probe(column + 0.5 + x, row + 0.5 + y) for x, y in ((-3, 0), (3, 0), (0, -3), (0, 3))
        ]
        if None in around or len({h["name"] for h in around}) > 1 or not all(h["sampled"] for h in around):
            return None
        values = [hit["reading"]["value"] for hit in around]
        return ((ticks >= min(values)) & (ticks <= max(values))).any()

    def share_crossing(pixels):
        found = [crosses(*pixel) for pixel in pixels]
        found = [one for one in found if one is not None]
        assert len(found) > 20
        return np.mean(found)

    on_lines = [(rows[k], columns[k]) for k in range(0, len(rows), max(1, len(rows) // 60))]
    anywhere = np.random.default_rng(1).integers(0, lines.shape, size=(60, 2))
    assert share_crossing(on_lines) > 0.9
    assert share_crossing(anywhere) < 0.5
