# SPDX-License-Identifier: Apache-2.0
"""A closed shed on ground of small triangles is dark inside, however the ground and the walls are made."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from scenes_for_tests import Shape, box, joined
from thoroughness import slow

LOW, HIGH = np.array((-2.513, -1, -2.017)), np.array((2.487, 3, 1.983))
SUN = dl.SunLight("sun", (0.3, -1, 0.2), (1e5,) * 3)
MATERIALS = [dl.Material("wall", (0.5,) * 3), dl.Material("soil", (0.3,) * 3)]
SIDES = ("left", "right", "ceiling", "back", "front")


def ground(half: float, step: float, bumps: float, seed: int) -> Shape:
    count = int(2 * half / step) + 1
    x, z = np.meshgrid(*[np.linspace(-half, half, count)] * 2, indexing="ij")
    random = np.random.default_rng(seed).uniform(-1, 1, x.shape)
    y = bumps * (np.sin(2.1 * x + seed) * np.cos(1.7 * z) + 0.2 * random)
    i = np.arange(count * count).reshape(count, count)
    a, b, c, d = (part.ravel() for part in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return Shape(points, np.r_[np.c_[a, c, b], np.c_[a, d, c]])


def divided(shape: Shape, times: int) -> Shape:
    for _ in range(times):
        a, b, c = shape.vertices[shape.triangles].transpose(1, 0, 2)
        d, e, f = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.stack([a, d, f, d, b, e, f, e, c, d, e, f], axis=1).reshape(-1, 3)
        shape = Shape(corners, np.arange(len(corners)).reshape(-1, 3))
    return shape


def turned(shape: Shape, angle: float) -> Shape:
    matrix = np.array(((np.cos(angle), 0, np.sin(angle)), (0, 1, 0), (-np.sin(angle), 0, np.cos(angle))))
    return Shape(shape.vertices @ matrix.T, shape.triangles)


def brightest_inside(
    soil: Shape, thick: float, angle: float, times: int, low: np.ndarray = LOW, high: np.ndarray = HIGH
) -> float:
    walls = [box(low, high, SIDES)]
    if thick:
        walls.append(box(low - (thick, 0, thick), high + thick, SIDES).flipped())
    shed = turned(divided(joined(*walls), times), angle)
    x, z = (a.ravel() for a in np.meshgrid(np.linspace(-2.2, 2.2, 8), np.linspace(-1.7, 1.7, 8)))
    above = Shape(np.c_[x, np.full(64, 1.0), z], np.zeros((0, 3), int))
    points = turned(above, angle).vertices
    scene = dl.Scene([shed.mesh("shed", "wall"), soil.mesh("ground", "soil")], MATERIALS, [SUN], unit="lux")
    session = dl.Session(scene, dl.Samples(points, [(0, -1, 0)] * 64), gather=128, paths=50_000)
    session.bake()
    return float(session.irradiance.max())


@pytest.mark.parametrize(
    ("step", "bumps", "thick", "angle", "times"),
    [
        slow(0.2, 0.0, 0.0, 0.0, 0),
        slow(0.1, 0.1, 0.0, 0.0, 0),
        slow(0.1, 0.002, 0.0, 0.4, 0),
        slow(0.05, 0.1, 0.0, 0.0, 0),
        slow(0.05, 0.1, 0.1, 0.0, 0),
        (0.07, 0.05, 0.02, 0.7, 0),
        (0.1, 0.1, 0.0, 0.3, 6),
        slow(0.1, 0.0, 0.0, 0.3, 6),
    ],
)
def test_no_sun_leaks_into_a_shed(step, bumps, thick, angle, times):
    """Walls of triangles down to 6 cm; 1e-5 of the sun is allowed, for paths that hit a wall's very edge."""
    assert brightest_inside(ground(6, step, bumps, seed=1), thick, angle, times) <= 1.0


@pytest.mark.parametrize(("step", "bumps"), [slow(0.2, 0.0), (0.1, 0.1)])
def test_corners_of_sheds_may_lie_anywhere(step, bumps):
    """A wall that ends at a corner may cross little of a cell there; some of ten sheds would be lit."""
    soil = ground(6, step, bumps, seed=1)
    random = np.random.default_rng(46)
    for _ in range(10):
        low, high = (corner + random.uniform(-0.1, 0.1, 3) * (1, 0, 1) for corner in (LOW, HIGH))
        assert brightest_inside(soil, 0.0, 0.0, 0, low, high) <= 1.0
