# SPDX-License-Identifier: Apache-2.0
"""Scenes of movables only, after all of them were removed: results of nothing, no traceback, no warning."""

from __future__ import annotations

import warnings

import deltalux as dl
import numpy as np
import pytest
from deltalux.cli import run
from deltalux.outputs.images import SURROUNDINGS
from deltalux.outputs.tone import encode_srgb
from deltalux.rendering import render_session
from deltalux.rendering.pictures import false_colour_picture, lit_picture
from deltalux.samples import Samples

SQUARE = np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1.0)])
UP, DOWN = [(0, 2, 1), (0, 3, 2)], [(0, 1, 2), (0, 2, 3)]
CAMERA = dl.Camera("eye", np.eye(4), 1.0)
OUTPUTS = ("a.png", "a.glb", "a.csv", "a.npz", "a.dlx")


def scene_of(tables: int, lamp: str, cameras: tuple[dl.Camera, ...] = ()) -> dl.Scene:
    """Tables to remove, lit by a bulb, or by a luminous mesh that can be removed, too."""
    meshes = [
        dl.Mesh(f"table {i}", np.add(SQUARE, (0, 0.3 * i, 0)), UP, "grey", movable=True)
        for i in range(tables)
    ]
    lights = [dl.PointLight("bulb", (0, 2, 0))] if lamp == "bulb" else []
    if lamp == "mesh":
        meshes.append(dl.Mesh("lamp", 0.1 * SQUARE + (0, 2, 0), DOWN, "glow", movable=True))
    materials = [dl.Material("grey"), dl.Material("glow", emission=(10, 10, 10))]
    return dl.Scene(meshes, materials, lights, cameras=cameras)


@pytest.fixture(params=[(1, "bulb", ()), (3, "bulb", ()), (2, "mesh", ()), (1, "bulb", (CAMERA,))], ids=str)
def emptied(request):
    """A session without anything."""
    scene = scene_of(*request.param)
    with dl.Session(scene, Samples.on_vertices(scene, spacing=0.6), paths=500, gather=8) as session:
        session.bake()
        for name in scene.movable:
            session.remove(name)
        session.update()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            yield session


def test_a_picture_shows_nothing_but_the_surroundings(emptied):
    rendering = render_session(emptied, size=(12, 8), rays=8)
    assert not rendering.seen.hit.any()
    assert not rendering.irradiance.any()
    nothing = encode_srgb(np.broadcast_to(SURROUNDINGS, (8, 12, 3)))
    assert (lit_picture(rendering).pixels == nothing).all()
    assert (false_colour_picture(rendering).pixels[:, :12] == nothing).all()


def test_what_was_removed_comes_back(emptied):
    for name in emptied.scene.movable:
        emptied.add(name)
    emptied.update()
    assert render_session(emptied, size=(24, 16), rays=8).seen.hit.any() or emptied.scene.cameras
    updated = emptied.digest()
    emptied.recompute()
    assert emptied.digest() == updated


def test_commands_write_every_kind_of_result(emptied, tmp_path, capsys):
    source, outputs = tmp_path / "empty.dlx", [str(tmp_path / name) for name in OUTPUTS]
    emptied.save(source)
    assert run(["update", str(source), "-q", "--size", "16x10", "-o", *outputs]) == 0, capsys.readouterr()
    picture = str(tmp_path / "false.png")
    assert run(["render", outputs[-1], "-q", "--size", "16x10", "--false-colour", "-o", picture]) == 0
    assert run(["info", outputs[-1], "--json"]) == 0
    assert run(["compare", str(source), outputs[-1], "--json"]) == 0


def test_a_view_of_nothing_opens(emptied):
    view = pytest.importorskip("deltalux.server.drawn.geometry")
    geometry = view.geometry_of(emptied)
    assert geometry.description and geometry.data
