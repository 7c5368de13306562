# SPDX-License-Identifier: Apache-2.0
"""Holes where alpha cuts out: light passes them, and what is left reflects as if it were cut by hand."""

from __future__ import annotations

from dataclasses import replace

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import png
from deltalux.scene.look import NEAREST, Look, Texture
from rooms import box
from test_panes import FACES
from thoroughness import slow

SIDE = 5  # squares along the card, every other one cut out
CARD = 1.5  # metres
ABOVE = [(x, 1.45, z) for x in (-0.3, 0, 0.3) for z in (-0.3, 0, 0.3)]
GREEN = np.array([0.15, 0.5, 0.1])


def is_solid(row: np.ndarray, column: np.ndarray) -> np.ndarray:
    return (row + column) % 2 == 0


def card(by_hand: bool) -> list[dl.Mesh]:
    """A horizontal card at a height of 1 m whose middle is (0, 1, 0): by alpha, or square by square."""
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    if not by_hand:
        at = (corners - 0.5) * CARD
        vertices = np.stack([at[:, 0], np.ones(4), at[:, 1]], axis=1)
        return [dl.Mesh("card", vertices, FACES, "leaf", coordinates=corners[np.array(FACES)])]
    squares = []
    for row, column in np.argwhere(is_solid(*np.indices((SIDE, SIDE)))):
        at = ((np.array([column, row]) + corners) / SIDE - 0.5) * CARD
        squares.append(np.stack([at[:, 0], np.ones(4), at[:, 1]], axis=1))
    faces = np.concatenate([np.array(FACES) + 4 * k for k in range(len(squares))])
    return [dl.Mesh("card", np.concatenate(squares), faces, "leaf")]


def room(by_hand: bool) -> dl.Scene:
    texels = np.full((SIDE, SIDE, 4), 255, np.uint8)
    texels[..., 3] = np.where(is_solid(*np.indices((SIDE, SIDE))), 255, 100)
    texture = Texture(png(texels), (1, 1, 1), mag_filter=NEAREST)
    leaf = dl.Material("leaf", GREEN)
    if not by_hand:
        leaf = replace(leaf, look=Look(texture, alpha_mode="MASK"))
    return dl.Scene(
        [dl.Mesh("walls", *box((4, 3, 3), (0, 1.5, 0), inward=True), "wall"), *card(by_hand)],
        [dl.Material("wall", (0.6, 0.6, 0.6)), leaf],
        [dl.PointLight("lamp", (0.1, 2.7, 0.2), (200, 200, 200))],
        unit="lux",
    )


def places() -> tuple[np.ndarray, np.ndarray]:
    """On the floor and the ceiling, on both sides of a solid square, and above the card, facing down."""
    x, z = (each.ravel() for each in np.meshgrid(np.linspace(-1.1, 1.1, 12), np.linspace(-0.9, 0.9, 7)))
    floor = np.stack([x, 0 * x, z], axis=1)
    ceiling = np.stack([x, 0 * x + 3, z], axis=1)
    points = np.concatenate([floor, ceiling, [(0, 1, 0)] * 2, ABOVE])
    normals = np.repeat(
        [(0, 1, 0), (0, -1, 0)] * 2 + [(0, -1, 0)], [len(x), len(x), 1, 1, len(ABOVE)], axis=0
    )
    return points, normals


def light(scene: dl.Scene, gather: int | str) -> tuple[np.ndarray, np.ndarray]:
    samples = dl.Samples(*places(), radius=0.15)
    with dl.Session(scene, samples, paths=400_000, gather=gather, seed=2) as session:
        session.bake()
        return session.irradiance.copy(), session.standard_error.copy()


@pytest.mark.parametrize("gather", [slow(512), "off"])
def test_what_alpha_cuts_out_is_as_if_cut_by_hand(gather):
    """Null hypothesis: equal light. The mean of 170 values has a standard error of 0.1 %: 1 % is ten."""
    (found, error), (expected, other) = light(room(False), gather), light(room(True), gather)
    # What sees most of the card sees how bright it is.
    count = len(ABOVE)
    np.testing.assert_allclose(found[-count:].mean(axis=0), expected[-count:].mean(axis=0), rtol=0.015)
    bias = found.mean(axis=0) / expected.mean(axis=0) - 1
    assert np.abs(bias).max() < 0.01
    far = np.abs(found - expected) / np.hypot(error, other)
    assert np.quantile(far, 0.9) < 2.5
    apart = np.abs(found - expected).max(axis=1) / expected.mean()
    assert apart.max() < 0.1


def test_shadows_have_the_holes():
    scene = room(False)
    points, normals = places()
    shadows = []
    for by_hand in (False, True):
        with dl.Session(room(by_hand), dl.Samples(points, normals), paths=2000, gather=16) as session:
            session.bake()
            shadows.append(session.at(points, normals, part="direct"))
    np.testing.assert_allclose(*shadows, rtol=1e-5)
    lit = shadows[0][:84, 0] > 0
    assert 0.2 < lit.mean() < 0.95
    assert scene.material("leaf").look.opacity is not None


def test_a_card_without_coordinates_has_no_holes():
    scene = room(False)
    whole = dl.scene.replace_scene(scene, meshes=[replace(m, coordinates=None) for m in scene.meshes])
    points, normals = [(0.2, 0, 0.1)], [(0, 1, 0)]
    with dl.Session(whole, dl.Samples(points, normals), paths=2000, gather=16) as session:
        session.bake()
        assert session.at(points, normals, part="direct").max() == 0
