# SPDX-License-Identifier: Apache-2.0
"""What pictures keep between edits: the light there is that of places that are looked at anew, to the bit."""

from __future__ import annotations

from collections.abc import Callable

import deltalux as dl
import numpy as np
import pytest
from deltalux import _core, memory
from deltalux.rendering import render_session
from hypothesis import given, settings
from hypothesis import strategies as st
from lit_scenes import POOL_EDITS, SUN_EDITS, edit_pools, edit_sun, pools_and_sconce, sunny_room
from oracles import world
from rooms import box, translation
from thoroughness import examples

RAYS = 48


def baked(scene: dl.Scene, **options) -> dl.Session:
    some = dl.Samples(*world.area_points(scene, 40, seed=5))
    session = dl.Session(scene, some, paths=4000, gather=32, threads=2, **options)
    session.bake()
    return session


@pytest.fixture(scope="module")
def sunny():
    with baked(sunny_room()) as session:
        assert session.statistics["gather"]["suns"] == 1
        yield session, world.area_points(session.scene, 300, seed=9)


@pytest.fixture(scope="module")
def spots():
    with baked(pools_and_sconce()) as session:
        assert session.statistics["gather"]["beams"] == 3
        yield session, world.area_points(session.scene, 300, seed=9)


@pytest.fixture
def often_told():
    _core.set_report_seconds(0.001)
    yield
    _core.set_report_seconds(0.02)


def light(session: dl.Session, places: tuple, keep: bool) -> list[np.ndarray]:
    direct = session.at(*places, part="direct", by_need=True, keep=keep)
    return [direct, session.at(*places, rays=RAYS, keep=keep), *session.indirect_at(*places, RAYS, keep)]


def assert_right(session: dl.Session, places: tuple) -> None:
    kept, fresh = light(session, places, keep=True), light(session, places, keep=False)
    for one, two in zip(kept, fresh, strict=True):
        np.testing.assert_array_equal(one, two)


def assert_right_throughout(
    session: dl.Session, places: tuple, edit: Callable, edits: list, every: int
) -> None:
    for number, one in enumerate(edits):
        edit(session, *one)
        if number % every == 0:
            assert_right(session, places)
    assert_right(session, places)


def taken(session: dl.Session) -> int:
    return session.statistics["gather"]["kept_taken"]


@settings(max_examples=examples(40), deadline=None)
@given(edits=st.lists(SUN_EDITS, min_size=1, max_size=5), every=st.integers(1, 3))
def test_light_of_kept_places_is_that_of_others_in_the_sun(sunny, edits, every):
    assert_right_throughout(*sunny, edit_sun, edits, every)


@settings(max_examples=examples(40), deadline=None)
@given(edits=st.lists(POOL_EDITS, min_size=1, max_size=5), every=st.integers(1, 3))
def test_light_of_kept_places_is_that_of_others_in_pools_of_spots(spots, edits, every):
    assert_right_throughout(*spots, edit_pools, edits, every)


def test_most_places_are_kept_while_little_moves():
    with baked(sunny_room()) as session:
        places = world.area_points(session.scene, 300, seed=9)
        light(session, places, keep=True)
        before = taken(session)
        session.move("block", translation(-1, 0.26, 0.61))
        light(session, places, keep=True)
        assert taken(session) - before > 1.8 * 300  # it is asked for twice
        session.recompute()
        assert session.statistics["gather"]["kept_bytes"] == 0


def test_no_more_is_kept_than_may_be(monkeypatch):
    with baked(sunny_room()) as session:
        places = world.area_points(session.scene, 300, seed=9)
        monkeypatch.setattr(memory, "KEPT", (2_000_000, 1.0))
        for first in range(0, 300, 20):
            assert_right(session, tuple(values[first : first + 20] for values in places))
        assert 0 < session.statistics["gather"]["kept_bytes"] <= 2_000_000
    with baked(sunny_room(), memory_limit=2**30) as session:
        light(session, places, keep=True)
        assert session.statistics["gather"]["kept_bytes"] == 0


def test_a_cancelled_call_leaves_nothing_half_followed(often_told):
    with baked(sunny_room()) as session:
        places = world.area_points(session.scene, 2000, seed=9)
        light(session, places, keep=True)
        session.move("block", translation(1, 0.3, 0.2))
        session.update()
        session.progress = lambda *_: False
        with pytest.raises(dl.Cancelled):
            session.indirect_at(*places, 2048, keep=True)
        session.progress = None
        assert_right(session, places)


def test_what_is_added_is_seen_from_kept_places():
    room = sunny_room()
    glow = dl.Material("glow", (0.4,) * 3, emission=(20.0,) * 3, group="bulb")
    with baked(dl.Scene(room.meshes, [*room.materials, glow], room.lights)) as session:
        places = world.area_points(session.scene, 300, seed=9)
        light(session, places, keep=True)
        for name, material, x in (("crate", "wood", -0.6), ("lamp", "glow", 0.5)):
            pose = translation(x, 0.4, -0.8)
            session.add(dl.Mesh(name, *box((0.3, 0.3, 0.3)), material, pose=pose, movable=True))
            assert_right(session, places)
        session.remove("crate")
        assert_right(session, places)


def test_a_picture_of_an_updated_session_is_a_fresh_one():
    scene = dl.scenes.cornell_box()
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=0.1), paths=3000, gather=32) as session:
        session.bake()
        render_session(session, size=(64, 48), rays=16, keep=True)
        for x in (0.05, 0.1):
            name = session.scene.movable[0]
            session.move(name, translation(x, 0, 0) @ session.pose(name))
            before = taken(session)
            kept = render_session(session, size=(64, 48), rays=16, keep=True)
            assert taken(session) > before + 0.5 * kept.gathered
            fresh = render_session(session, size=(64, 48), rays=16, keep=False)
            np.testing.assert_array_equal(kept.radiance, fresh.radiance)
