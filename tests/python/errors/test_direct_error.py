# SPDX-License-Identifier: Apache-2.0
"""Direct light of partly hidden area lights against brute force: its mean, and what error it claims."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from oracles.closed_forms import polygon_factor
from scenes_for_tests import box, joined, quad, sphere
from thoroughness import all_but_slow, slow

UP = np.array((0.0, 1.0, 0.0))
# Slits in the plane x = 1, (low, high) corners in y and z; the panel lies in x = 0, y 0.5 to 2.5, z -1 to 1.
OPENINGS = {
    "window": [((0.8, -0.3), (1.5, 0.4))],
    "door ajar": [((-1.0, 0.1), (2.2, 0.13))],
    "crack": [((-1.0, -0.004), (2.2, 0.004))],
    "blinds": [((y, -2.5), (y + 0.012, 2.5)) for y in np.arange(0.4, 2.4, 0.07)],
}


def wall(openings) -> list[np.ndarray]:
    """Rectangles of the plane x = 1 around openings that lie above or beside each other."""
    low, high = -4.0, 6.0
    pieces, y = [], low
    for (y0, z0), (y1, z1) in openings:
        pieces += [((y, low), (y0, high)), ((y0, low), (y1, z0)), ((y0, z1), (y1, high))]
        y = y1
    return [*pieces, ((y, low), (high, high))]


def brute_force(points, openings) -> np.ndarray:
    """By the parts of a grid on the panel, fine across openings, that a point sees through these."""
    high, wide = np.ptp(openings[0], axis=0)
    steps = (1500, 1500) if min(high, wide) > 0.1 else (6000, 60) if high < wide else (60, 6000)
    y = 0.5 + 2 * (np.arange(steps[0]) + 0.5) / steps[0]
    z = -1 + 2 * (np.arange(steps[1]) + 0.5) / steps[1]
    light = []
    for px, py, pz in points:
        t = (px - 1) / px  # from the point to the plane of the wall, of the way to the panel
        dy, dz = y[:, None] - py, z[None, :] - pz
        factor = np.maximum(dy, 0) * px / (px * px + dy * dy + dz * dz) ** 2
        qy, qz = py + t * dy[:, 0], pz + t * dz[0]
        seen = sum(np.outer((qy > y0) & (qy < y1), (qz > z0) & (qz < z1)) for (y0, z0), (y1, z1) in openings)
        light.append((factor * seen).mean() * 4)
    return np.array(light)


@pytest.mark.parametrize("name", all_but_slow(OPENINGS, "window"))
def test_light_through_openings(name):
    """Mean within 5 %; no error of 0 where light is wrong; 90 % of errors within 1.25 normal quantiles.

    With 120 points, more than a tenth of them beyond 2.06 claimed errors, where 4 % are expected, has a
    chance below 0.3 % for one opening; seeds are fixed.
    """
    openings = OPENINGS[name]
    rng = np.random.default_rng(7)
    points = np.stack([rng.uniform(1.6, 4, 120), np.full(120, 0.3), rng.uniform(-1, 1, 120)], axis=1)
    right = brute_force(points, openings)
    hull = joined(
        *(quad((1, y0, z0), (0, y1 - y0, 0), (0, 0, z1 - z0)) for (y0, z0), (y1, z1) in wall(openings))
    )
    panel = quad((0, 0.5, -1), (0, 2, 0), (0, 0, 2))
    scene = dl.Scene(
        [hull.mesh("wall", "black"), panel.mesh("panel", "lamp")],
        [dl.Material("black", (0, 0, 0)), dl.Material("lamp", (0, 0, 0), (1, 1, 1))],
    )
    with dl.Session(scene, dl.Samples(points, UP), paths=1000, gather=8, seed=1) as session:
        session.bake()
        light, claimed = session.irradiance[:, 1], session.standard_error[:, 1]
    assert light.mean() == pytest.approx(right.mean(), rel=0.05)
    off = np.abs(light - right)
    wrong = off > 0.02 * right.max()
    assert (claimed[wrong] > 0).all()
    known = claimed > 0
    assert np.quantile(off[known] / claimed[known], 0.9) < 1.25 * 1.645


SKIES = {
    "cube": box((-60, -60, -60), (60, 60, 60)),
    "octahedron": sphere(1, 60),
    "coarse": sphere(4, 45),
    "fine": sphere(20, 80),
}


def sky_through(kind, size, places):
    """Light of a sky of one mesh that fills a black room's window: as found, claimed error, Lambert's."""
    width, height = size
    y0, z0 = 1.2, -0.2
    rng = np.random.default_rng(11)
    points = np.stack(
        [rng.uniform(-3, 0.6, places), np.full(places, 0.6), rng.uniform(-1.8, 1.8, places)], axis=1
    )
    window = [(1, y0, z0), (1, y0, z0 + width), (1, y0 + height, z0 + width), (1, y0 + height, z0)]
    right = np.pi * polygon_factor(points, np.tile(UP, (places, 1)), window)
    assert (right > 0).all()
    y1, z1 = y0 + height, z0 + width
    pieces = [((0, -2), (y0, 2)), ((y1, -2), (3, 2)), ((y0, -2), (y1, z0)), ((y0, z1), (y1, 2))]
    room = joined(
        box((-3.2, 0, -2), (1, 3, 2), ("left", "floor", "ceiling", "back", "front")),
        *(quad((1, a, c), (0, 0, d - c), (0, b - a, 0)) for (a, c), (b, d) in pieces),
    )
    scene = dl.Scene(
        [room.mesh("room", "black"), SKIES[kind].mesh("sky", "sky")],
        [dl.Material("black", (0, 0, 0)), dl.Material("sky", (0, 0, 0), (1, 1, 1))],
    )
    with dl.Session(
        scene, dl.Samples(points, UP), paths=1000, gather="off", direct="sampled", seed=3
    ) as session:
        session.bake()
        light, claimed = session.irradiance[:, 1], session.standard_error[:, 1]
    return light, claimed, right


@pytest.mark.parametrize("size", [slow((1.9, 1.4)), (1.1, 0.7), slow((0.55, 0.5))])
@pytest.mark.parametrize("kind", SKIES)
def test_sky_through_a_window(kind, size):
    """Means within 2 %, errors as claimed.

    With 160 points, more than a tenth beyond 2.06 claimed errors, where 4 % are expected, has a chance below
    0.1 %; seeds are fixed. Hardly any is claimed to have none.
    """
    light, claimed, right = sky_through(kind, size, 160)
    off = np.abs(light - right)
    assert light.mean() == pytest.approx(right.mean(), rel=0.02)
    assert np.sqrt(np.mean(off**2)) < 0.05 * right.mean()
    assert np.mean(claimed < 0.002 * right) < 0.02
    assert np.quantile(off / np.maximum(claimed, 1e-9), 0.9) < 1.25 * 1.645


@pytest.mark.parametrize("places", [400, slow(800)])
def test_windows_that_rays_may_miss_bring_all_of_their_light(places):
    """Of 0.05 square metres, which many of the 4,096 parts of a sky's strata miss.

    Null hypothesis: unbiased; the mean of 4,800 places has an error of 0.5 %, of half as many
    one of 0.7 %: three of them are allowed. Found: -0.1 %; if no place is asked again where none of its
    rays passed, -3.6 %.
    """
    found = [
        sky_through(kind, size, places)
        for kind in ("octahedron", "coarse", "fine")
        for size in ((0.22, 0.22), (0.3, 0.15))
    ]
    assert np.mean([light.mean() / right.mean() - 1 for light, _, right in found]) == pytest.approx(
        0, abs=3 * 0.005 * np.sqrt(800 / places)
    )
