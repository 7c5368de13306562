# SPDX-License-Identifier: Apache-2.0
"""Light does not depend on where the origin of coordinates is: offsets of shadow rays do not vanish there."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import box
from scenes_for_tests import sphere
from thoroughness import slow

BY_KIND = pytest.mark.parametrize("lamp", ["box", "ball", "point"])
BY_SIZE = pytest.mark.parametrize("size", [0.005, slow(0.05), slow(0.3)])


def lamp_of(kind: str, size: float, at) -> tuple[list[dl.Mesh], list[dl.PointLight]]:
    if kind == "point":  # on the upper side of a plate
        plate = dl.Mesh("plate", *box((size, 0.1 * size, size), np.add(at, (0, 0.05 * size, 0))), "wall")
        return [plate], [dl.PointLight("lamp", at, intensity=(1, 1, 1))]
    vertices, triangles = box((size,) * 3)
    if kind == "ball":
        inside_out = sphere(6, size / 2)
        vertices, triangles = inside_out.vertices, inside_out.triangles[:, ::-1]
    return [dl.Mesh("lamp", vertices + at, triangles, "glow")], []


def light(kind: str, size: float, shift, **options) -> np.ndarray:
    """Irradiance on the floor of a room with a lamp 2 m above, everything moved by `shift`."""
    meshes, points = lamp_of(kind, size, np.add(shift, (0, 2, 0)))
    walls = dl.Mesh("walls", *box((10, 3, 10), np.add(shift, (0, 1.5, 0)), inward=True), "wall")
    glow = dl.Material("glow", (0, 0, 0), (1 / size**2,) * 3)
    scene = dl.Scene([walls, *meshes], [dl.Material("wall", (0.5,) * 3), glow], points)
    places = np.add(shift, [(1, 0, 1), (-4, 0, 3), (0.1, 0, 0), (2.5, 0, -2)])
    with dl.Session(scene, dl.Samples(places, (0, 1, 0)), paths=4_000, seed=1, **options) as session:
        session.bake()
        return session.irradiance[:, 1]


@BY_KIND
@BY_SIZE
def test_a_lamp_at_the_origin_of_coordinates_shines(lamp, size):
    """The remaining difference is that of random numbers that depend on places: 36 rays, and gathers."""
    there = light(lamp, size, (3.1, 0.2, -1.7), gather=1024)
    for shift in ((0, -2, 0), (100, 0, 0), (450_000, 0, 5_200_000)):
        np.testing.assert_allclose(light(lamp, size, shift, gather=1024), there, rtol=0.05)
