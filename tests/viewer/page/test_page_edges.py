# SPDX-License-Identifier: Apache-2.0
"""Antialiasing mixes what is beside an edge, and shows nothing else there: no dots of hidden sides."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.server.serving import Server
from rooms import box, translation, turn
from scipy.ndimage import maximum_filter, minimum_filter

from viewer.page.driver import Viewer
from viewer.served_room import saved

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
            viewer.page.close()
    assert complaints == []
    plain, smooth = pictures
    darker = smooth < minimum_filter(plain, size=(3, 3, 1)) - ROUNDED
    brighter = smooth > maximum_filter(plain, size=(3, 3, 1)) + ROUNDED
    assert (darker | brighter).any(axis=2).sum() <= 3
