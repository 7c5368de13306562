# SPDX-License-Identifier: Apache-2.0
"""What movables cover of a disc: the area of their union, however many bodies it is made of."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import box
from thoroughness import slow

ONE = [(0.05, 0.5)]
SAME = {
    "overlapping": [(0.05, 0.15), (0.1, 0.5)],
    "touching": [(0.05, 0.15), (0.15, 0.5)],
    "nested": [(0.05, 0.5), (0.1, 0.15)],
}


def solid(low: float, high: float):
    return box((high - low, 1.0, 1.6), ((low + high) / 2, 0.45, 0))


def apart(pieces) -> list[dl.Mesh]:
    return [dl.Mesh(f"box{i}", *solid(*ends), "grey", movable=True) for i, ends in enumerate(pieces)]


def joined(pieces) -> list[dl.Mesh]:
    parts = [solid(*ends) for ends in pieces]
    first = np.cumsum([0, *(len(v) for v, _ in parts)])
    triangles = np.concatenate([t + n for (_, t), n in zip(parts, first[:-1], strict=True)])
    return [dl.Mesh("body", np.concatenate([v for v, _ in parts]), triangles, "grey", movable=True)]


def lit(meshes: list[dl.Mesh], direct: str = "paths") -> tuple[float, np.ndarray]:
    scene = dl.Scene(
        [dl.Mesh("walls", *box((4, 2, 3), (0, 1, 0), inward=True), "grey"), *meshes],
        [dl.Material("grey")],
        [dl.PointLight("bulb", (-1.5, 1.8, 0), (1, 1, 1))],
    )
    samples = dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=0.3)
    with dl.Session(scene, samples, paths=20_000, direct=direct) as session:
        session.bake()
        return float(session._core.areas()[0]), session.irradiance[0]


@pytest.mark.parametrize("make", [apart, joined])
@pytest.mark.parametrize("pieces", SAME)
@pytest.mark.parametrize("direct", [slow("paths"), "auto"])
def test_several_bodies_cover_what_one_covers(make, pieces, direct):
    area, irradiance = lit(apart(ONE), direct)
    found, light = lit(make(SAME[pieces]), direct)
    assert found == pytest.approx(area, rel=1e-5)
    np.testing.assert_allclose(light, irradiance, rtol=0.02)  # rounding sends a few paths elsewhere


def test_one_body_covers_its_part():
    """The circle beyond the chord x = 0.05, in closed form; 32 probes see it to 3 %."""
    angle = np.arccos(0.05 / 0.3)
    segment = 0.3**2 * (angle - np.sin(angle) * np.cos(angle))
    area, _ = lit(apart(ONE))
    assert area == pytest.approx(np.pi * 0.3**2 - segment, rel=0.03)
    free, _ = lit([])
    assert free == pytest.approx(np.pi * 0.3**2, rel=1e-5)


def test_a_body_about_the_disc_leaves_it_dark():
    assert lit(apart([(-0.5, 0.5)]))[1].max() == 0
