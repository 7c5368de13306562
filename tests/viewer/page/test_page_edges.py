# SPDX-License-Identifier: Apache-2.0
"""Antialiasing mixes what is beside an edge, and shows nothing else there: no dots of hidden sides."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.server.web.serving import Server
from rooms import box, translation, turn
from scipy.ndimage import maximum_filter, minimum_filter

from viewer.page.driver import Viewer
from viewer.served_room import saved

ANTIALIASED = "document.querySelector('canvas').getContext('webgl2').getContextAttributes().antialias"
ROUNDED = 16  # steps of a channel that a mixture may be off, as the tone curve is not linear


def make_session() -> dl.Session:
    """A cell with a lamp and bodies at angles to the view, all bright but for their hidden sides."""
    vertices, triangles = box((2.0, 2.0, 2.0), (0.0, 1.0, 0.0), inward=True)
    is_front = (vertices[triangles][:, :, 2] > 0.99).all(axis=1)
    meshes = [
        dl.Mesh("cell", vertices, triangles[~is_front], "plaster"),
        dl.Mesh("lamp", *box((0.6, 0.02, 0.6), (0.0, 1.9, 0.0)), "glow"),
    ]
    for i, angle in enumerate((0.15, 0.4, 0.75, 1.1)):
        pose = translation(-0.7 + 0.45 * i, 0.4 + 0.2 * (i % 2), 0.1) @ turn(angle)
        meshes.append(dl.Mesh(f"body {i}", *box((0.3, 0.6, 0.25)), "plaster", pose=pose))
    materials = [
        dl.Material("plaster", (0.8, 0.8, 0.8)),
        dl.Material("glow", (0, 0, 0), emission=(900, 900, 900), group="lamp"),
    ]
    camera = dl.scene.Camera("front", translation(0.0, 1.0, 4.3), np.radians(30))
    scene = dl.Scene(meshes, materials, unit="lux", cameras=[camera])
    samples = dl.Samples.on_vertices(scene, spacing=0.1)
    return dl.Session(scene, samples, paths=200_000, gather=64, threads=2)


@pytest.fixture(scope="module")
def bodies_file(tmp_path_factory):
    return saved(make_session(), tmp_path_factory.mktemp("bodies") / "bodies.dlx")


def test_edges_show_what_is_beside_them(bodies_file, browser):
    pictures, complaints = [], []
    with dl.Session.open(bodies_file) as session, Server(session) as server:
        for antialiasing in ("&aa=0", ""):
            viewer = Viewer(browser.new_page(), server.url + antialiasing, complaints)
            viewer.settle()
            viewer.press("Escape")
            viewer.settle()
            pictures.append(viewer.picture())
            as_drawn = viewer.ask(ANTIALIASED)
            viewer.page.close()
    assert complaints == []
    assert not as_drawn  # there is no graphics card: it comes when all is at rest
    plain, smooth = pictures
    assert (smooth != plain).any(axis=2).mean() > 0.002
    darker = smooth < minimum_filter(plain, size=(3, 3, 1)) - ROUNDED
    brighter = smooth > maximum_filter(plain, size=(3, 3, 1)) + ROUNDED
    assert (darker | brighter).any(axis=2).sum() <= 3


def post(radius: float, height: float, sides: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """An upright prism without ends, which counts as round."""
    angles = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(angles), 0 * angles, -radius * np.sin(angles)], axis=1)
    following = np.roll(np.arange(sides), -1)
    near = np.stack([np.arange(sides), following, sides + following], axis=1)
    far = np.stack([np.arange(sides), sides + following, sides + np.arange(sides)], axis=1)
    return np.vstack([ring, ring + np.array([0.0, height, 0.0])]), np.vstack([near, far])


def board_before_posts() -> dl.Session:
    """A cell with thin round posts, of which some facet is seen edge-on, behind a board."""
    vertices, triangles = box((3.0, 2.0, 2.4), (0.0, 1.0, 0.0), inward=True)
    is_front = (vertices[triangles][:, :, 2] > 1.19).all(axis=1)
    meshes = [
        dl.Mesh("cell", vertices, triangles[~is_front], "plaster"),
        dl.Mesh("lamp", *box((1.6, 0.02, 0.6), (0.0, 1.95, 0.3)), "glow"),
        dl.Mesh("board", *box((2.4, 0.7, 0.02), (0.0, 0.6, 0.3)), "plaster"),
    ]
    for i, x in enumerate(np.linspace(-1.1, 1.1, 40)):
        pose = translation(x, 0.15, -0.2 - 0.3 * (i % 3)) @ turn(0.1 * i)
        meshes.append(dl.Mesh(f"post {i}", *post(0.02, 1.5), "oak", pose=pose))
    materials = [
        dl.Material("plaster", (0.8, 0.8, 0.8)),
        dl.Material("oak", (0.1, 0.05, 0.02)),
        dl.Material("glow", (0, 0, 0), emission=(900, 900, 900), group="lamp"),
    ]
    camera = dl.scene.Camera("front", translation(0.0, 1.0, 4.3), np.radians(30))
    scene = dl.Scene(meshes, materials, unit="lux", cameras=[camera])
    samples = dl.Samples.on_vertices(scene, spacing=0.3, radius=0.1)
    return dl.Session(scene, samples, paths=50_000, gather="off", threads=2)


def test_nothing_shines_through_what_stands_before_it(tmp_path, browser):
    complaints = []
    file = saved(board_before_posts(), tmp_path / "posts.dlx")
    with dl.Session.open(file) as session, Server(session) as server:
        viewer = Viewer(browser.new_page(), server.url, complaints)
        viewer.settle()
        corners = [(-1.15, 0.9, 0.31), (1.15, 0.3, 0.31)]
        (left, top), (right, bottom) = (viewer.ask(f"deltalux.place({list(c)})") for c in corners)
        canvas = viewer.state()["canvas"]
        rows = slice(int(top - canvas["top"]), int(bottom - canvas["top"]))
        board = viewer.picture()[rows, int(left) : int(right)].sum(axis=2)
        viewer.page.close()
    assert complaints == []
    assert board.shape[0] > 60 and board.shape[1] > 300
    off = np.argwhere(np.abs(board - np.median(board, axis=0)) > 100)
    assert len(off) == 0, off
