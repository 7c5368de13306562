# SPDX-License-Identifier: Apache-2.0
"""The short form of benchmarks/truth_fuzz.py: a random scene of each kind against the path tracer."""

from __future__ import annotations

import numpy as np
import pytest
from builders.truth_kinds import KINDS, kind_of, truth_scene
from oracles.truth_verdict import judge, trace_and_judge
from thoroughness import all_but_slow, slow

SEED, POINTS, SECONDS = 1, 32, 1.0
FAST = {"paths": 100_000, "gather": 256}  # claims must be true with few rays, too
# Scenes that bake and trace fast, by kind: numbers of `truth_scene`.
SCENES = {
    "site_lamp": 12,  # 10 km of land
    "site_sun": 1,  # 600 m of land, a window of half a metre
    "ratio": 14,  # a sky of 1 km, 2e9 times as powerful
    "opening": 27,  # a gap of 60 cm from a lit room
    "joined": 16,  # 20 panels
    "doubled": 5,  # walls
    "terrain": 18,  # a lamp in a shed
    "white": 19,  # reflectance 0.9
    "dome": 20,  # 60 m, a window of 1.1 m
    "furnished": 21,
    "hall": 22,  # 15 panels
    "bulb": 11,  # 8 mm, at the origin
}


@pytest.mark.parametrize("kind", all_but_slow(SCENES, "site_sun", "opening", "white", "bulb"))
def test_light_is_true_or_said_to_be_noisy(kind):
    """Null hypothesis and false-alarm rate: see oracles/truth_verdict.py; 12 scenes of two readings: 0.04."""
    truth = truth_scene(SEED, SCENES[kind], POINTS)
    assert truth.kind == kind
    check(truth)


@pytest.mark.parametrize(
    ("seed", "number", "width", "shape"),
    [(2, 39, 0.1, "square"), slow(52, 99, 0.02, "slit")],
)
def test_rays_go_through_an_opening_to_a_lit_room(seed, number, width, shape):
    """Spread of four seeds at 48 places that see it: 0.11 and 0.20; of the slit without such rays, 0.55.

    False alarms: were errors independent and normal, 192 of them would never spread by 0.3.
    """
    truth = truth_scene(seed, number, 48)
    assert truth.about == {"width": width, "shape": shape, "behind": "room"}
    options = {"paths": 400_000, "gather": 256}
    light = np.array([truth.measured(**options, seed=k).light for k in range(4)])
    spread = light.std(axis=0, ddof=1) / light.mean(axis=0)
    assert np.sqrt((spread**2).mean()) < 0.3


@pytest.mark.slow
def test_a_strip_of_sun_gets_rays():
    """Through a slit of 2 cm. The guide around the strip was painted between its texels' middles."""
    truth = truth_scene(52, 27, 48)
    assert truth.about == {"width": 0.02, "shape": "slit", "behind": "sun"}
    check(truth, {})


def test_the_beam_of_a_sun_through_a_hole_of_5_mm_is_found():
    """Half of the places claimed a hundredth of their light."""
    truth = truth_scene(62, 51, 48)
    assert truth.about == {"width": 0.005, "shape": "square", "behind": "sun"}
    check(truth, {})


@pytest.mark.slow
def test_light_seen_through_a_hole_does_not_vouch_for_the_room():
    """A fifth of the places saw a hole of 5 mm, and claimed 4 %: what the room reflects was missing."""
    truth = truth_scene(52, 51, 48)
    assert truth.about == {"width": 0.005, "shape": "square", "behind": "room"}
    check(truth, {})


def check(truth, options=FAST):
    """Samples and places asked for, against the path tracer."""
    found = truth.measured(**options)
    places = (truth.points, truth.normals)
    verdict, traced = trace_and_judge(
        truth.world, places, found.light, found.error, seed=2, seconds=SECONDS, dark=truth.dark
    )
    asked = judge(found.asked, found.error, traced, truth.dark)
    for reading, of in ((verdict, "samples"), (asked, "Session.at")):
        assert not reading.wrong, (
            f"{truth.kind} {truth.about}, {of}: bias {reading.bias:+.1%}, allowed {reading.allowed:.1%}; "
            f"{reading.outside:.0%} of the points outside; claimed {reading.claimed:.2%}"
        )


def test_every_kind_has_a_scene():
    assert list(SCENES) == list(KINDS)
    assert all(kind_of(number) == kind for kind, number in SCENES.items())


@pytest.mark.parametrize("number", range(len(KINDS)))
def test_scenes_are_functions_of_seed_and_number(number):
    """Also: the scene has the area of what the path tracer has."""
    one, same = truth_scene(3, number, 8), truth_scene(3, number, 8)
    other = truth_scene(4, number, 8)
    np.testing.assert_array_equal(one.points, same.points)
    np.testing.assert_array_equal(one.world.surfaces.corner, same.world.surfaces.corner)
    assert not np.array_equal(one.points, other.points)
    area = sum(mesh.triangle_areas().sum() for mesh in one.scene.meshes)
    assert area == pytest.approx(one.world.surfaces.areas.sum(), rel=1e-9)
