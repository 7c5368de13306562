# SPDX-License-Identifier: Apache-2.0
"""Things that move through wide beams of spots: exact updates, of the rays that their shadows reach."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import world
from rooms import box, translation
from thoroughness import examples

PLACES = st.tuples(st.floats(-2.1, 2.1), st.floats(0.26, 2.2), st.floats(-1.7, 1.7))
MOVES = st.tuples(st.sampled_from(["block", "plate"]), PLACES, st.sampled_from([None, None, 0.01]))


def spot(name: str, position, direction, degrees: float) -> dl.SpotLight:
    """A spot of so many degrees from its axis to its edge."""
    return dl.SpotLight(
        name, position, direction, (300,) * 3, outer_angle=np.radians(degrees), inner_angle=0.0
    )


def gallery() -> dl.Scene:
    """Three spots over a plinth, in a room without a ceiling; one shines upwards, half of it past a ledge."""
    vertices, triangles = box((5, 2.8, 4), (0, 1.4, 0), inward=True)
    ceiling = (vertices[triangles][:, :, 1] > 2.79).all(axis=1)
    return dl.Scene(
        [
            dl.Mesh("walls", vertices, triangles[~ceiling], "wall"),
            dl.Mesh("ledge", *box((1.5, 0.05, 1), (-1.6, 2.6, 0)), "wall"),
            dl.Mesh("plinth", *box((0.8, 0.6, 0.6), (0.9, 0.3, 0.3)), "wood"),
            dl.Mesh("block", *box((0.4, 0.5, 0.4)), "wood", pose=translation(-1, 0.26, 0.6), movable=True),
            dl.Mesh("plate", *box((0.7, 0.02, 0.5)), "wood", pose=translation(1, 1.4, -1), movable=True),
        ],
        [dl.Material("wall", (0.7, 0.7, 0.65)), dl.Material("wood", (0.5, 0.35, 0.2))],
        [
            spot("left", (-1.2, 2.7, -0.5), (0.2, -1, 0.1), 40),
            spot("right", (1.4, 2.7, 0.4), (-0.1, -1, -0.2), 30),
            spot("up", (-1, 0.4, -1), (0.1, 1, 0.3), 25),
        ],
    )


@pytest.fixture(scope="module")
def baked():
    scene = gallery()
    with dl.Session(
        scene, dl.Samples(*world.area_points(scene, 300, seed=3)), paths=4000, gather=128
    ) as session:
        session.bake()
        assert session.statistics["gather"]["beams"] == 3
        yield session


@settings(max_examples=examples(40), deadline=None)
@given(moves=st.lists(MOVES, min_size=1, max_size=4))
def test_updates_equal_recomputes(baked, moves):
    for name, place, budget in moves:
        baked.move(name, translation(*place))
        baked.update(budget_ms=budget)
    baked.update()
    digest, light = baked.digest(), baked.irradiance
    baked.recompute()
    assert baked.digest() == digest
    np.testing.assert_array_equal(baked.irradiance, light)


def test_only_rays_that_the_shadow_reaches_are_cast_again(baked):
    """A step of a thing within a beam; with all that depend on beams it was 0.28 of them."""
    rays = baked.statistics["gather"]["rays"]
    for name, place in {"block": (-1.1, 0.3, 0.4), "plate": (1.2, 0.9, -0.9)}.items():
        baked.move(name, translation(*place))
        baked.update()
        baked.move(name, translation(place[0] + 0.05, *place[1:]))
        assert baked.update().gathered_rays < 0.1 * rays
