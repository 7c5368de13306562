# SPDX-License-Identifier: Apache-2.0
"""The state depends on what was added, and in which order, but not on how edits are grouped in updates."""

from __future__ import annotations

import itertools

import deltalux as dl
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from rooms import box, room, samples_in, translation
from test_values_after_edits import POINTS, SEQUENCES, UP, apply, values_of
from thoroughness import all_but_slow, examples, slow


def lamp(number: int, material: str, size: float = 0.1) -> dl.Mesh:
    pose = translation(-1 + 0.5 * number, 1, 0.5)
    return dl.Mesh(f"lamp {number}", *box((size,) * 3), material, pose=pose, movable=True)


def dark_room() -> dl.Scene:
    """Without light until a lamp is added."""
    return dl.Scene(
        [
            dl.Mesh("walls", *box((4, 2, 3), (0, 1, 0), inward=True), "wall"),
            dl.Mesh("stool", *box((0.3,) * 3), "wall", pose=translation(1.5, 0.5, 1), movable=True),
        ],
        [
            dl.Material("wall", (0.5, 0.5, 0.5)),
            dl.Material("glow", (0, 0, 0), (0.05, 0.05, 0.05)),
            dl.Material("bright", (0, 0, 0), (50, 40, 30)),
            dl.Material("shared", (0, 0, 0), (2, 2, 2), group="shared"),
        ],
    )


SCENES = {"lit": room, "of nine groups": lambda: room(groups=9), "dark": dark_room}
OPTIONS = [{"gather": "off"}, slow({"gather": "off", "direct": "sampled"}), {"gather": 16}]


@pytest.mark.parametrize("options", OPTIONS, ids=lambda o: "-".join(map(str, o.values())))
@pytest.mark.parametrize("name", all_but_slow(SCENES, "lit"))
def test_lamps_added_together_or_one_by_one(name, options):
    """Of groups of their own, of a group of the scene, faint and bright: all ways to group three lamps."""
    make = SCENES[name]
    glows = ["glow", "shared", "bright"] if make is dark_room else ["own glow", "glow", "own glow"]
    points = dl.Samples(POINTS, UP, radius=0.2)
    for materials in itertools.permutations(glows) if make is dark_room else [glows]:
        found = set()
        for together in itertools.product((False, True), repeat=2):
            with dl.Session(make(), points, paths=100, threads=1, **options) as session:
                session.bake()
                for number, material in enumerate(materials):
                    session.add(lamp(number, material))
                    if number < 2 and not together[number]:
                        session.update()
                session.update()
                light = session.irradiance.tobytes(), session.standard_error.tobytes()
                paths = tuple(own["paths"] for own in session.statistics["lights"])
                found.add((session.digest(), paths, light))
        assert len(found) == 1


@pytest.mark.parametrize("options", [{"gather": "off"}, {"gather": 16}], ids=["discs", "gather"])
@settings(max_examples=examples(30), suppress_health_check=[HealthCheck.too_slow])
@given(sequence=SEQUENCES)
def test_edits_in_any_number_of_updates(options, sequence):
    scene, found = room(), []
    samples = samples_in(scene)
    for together in (False, True):
        with dl.Session(scene, samples, paths=600, threads=1, **options) as session:
            session.bake()
            for edit in itertools.chain.from_iterable(sequence):
                apply(session, edit)
                if not together:
                    session.update()
            session.update()
            found.append((session.digest(), values_of(session, options["gather"] != "off")))
    (one, values), (other, others) = found
    for name, expected in values.items():
        np.testing.assert_array_equal(others[name], expected, err_msg=name)
    assert one == other


def test_a_lamp_that_comes_back_has_its_paths_again():
    """Whatever was added in between: an absent object is part of the state."""
    points, digests = dl.Samples(POINTS, UP, radius=0.2), set()
    for absent in (False, True):
        with dl.Session(room(), points, paths=800, gather=64, threads=1) as session:
            session.bake()
            session.add(lamp(0, "own glow"))
            if absent:
                session.update()
                session.remove("lamp 0")
                session.update()
            session.add(lamp(1, "glow"))
            session.update()
            if absent:
                session.add("lamp 0")
            session.update()
            digests.add(session.digest())
    assert len(digests) == 1
