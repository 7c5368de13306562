# SPDX-License-Identifier: Apache-2.0
"""Objects may be put anywhere, out of the box that the session was made for, too: updates stay exact."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rooms import box, room, samples_in, translation, turn
from test_values_after_edits import values_of
from thoroughness import examples

FAR = st.floats(-12, 12)
FAR_PLACES = st.builds(
    lambda x, y, z, angle: translation(x, y, z) @ turn(angle), FAR, FAR, FAR, st.floats(-3, 3)
)
NEAR_PLACES = st.builds(
    lambda x, z, angle: translation(x, 0.6, z) @ turn(angle),
    st.floats(-1, 1),
    st.floats(-0.8, 0.8),
    st.floats(-3, 3),
)
NAMES = st.sampled_from(["block", "lamp", "added"])
EDIT = st.one_of(
    st.tuples(NAMES, st.one_of(FAR_PLACES, NEAR_PLACES)),
    st.tuples(NAMES, st.just("toggle")),
)
SEQUENCES = st.lists(st.lists(EDIT, min_size=1, max_size=2), min_size=1, max_size=4)
OPTIONS = [{"gather": "off"}, {"gather": "off", "direct": "paths", "segment_end": "second"}, {"gather": 16}]


def open_room() -> dl.Scene:
    """A room without its ceiling and a wall, so that objects outside get and give light."""
    scene = room()
    walls = scene.meshes[0]
    kept = [t for t in walls.triangles if not (walls.vertices[t][:, 1] == 2).all()]
    kept = [t for t in kept if not (walls.vertices[t][:, 0] == 2).all()]
    meshes = [dl.Mesh("walls", walls.vertices, kept, "wall"), *scene.meshes[1:]]
    return dl.Scene(meshes, scene.materials, scene.lights)


def apply(session: dl.Session, name: str, what) -> None:
    if name == "added" and name not in session.poses:
        pose = translation(0, 9, 0) if isinstance(what, str) else what
        session.add(dl.Mesh(name, *box((0.5, 0.1, 0.7)), "own glow", pose=pose, movable=True))
    elif isinstance(what, str):
        (session.add if session.poses[name] is None else session.remove)(name)
    else:
        session.move(name, what)


def digest_of(session: dl.Session) -> str:
    session.update()
    return session.digest()


@pytest.mark.parametrize("options", OPTIONS, ids=lambda o: "-".join(map(str, o.values())))
@settings(max_examples=examples(25), suppress_health_check=[HealthCheck.too_slow])
@given(sequence=SEQUENCES)
def test_updates_equal_recomputes_and_ways_back_restore(options, sequence):
    scene, gathers = open_room(), options["gather"] != "off"
    with dl.Session(scene, samples_in(scene), paths=600, threads=1, **options) as session:
        session.bake()
        first, home = session.digest(), {name: session.pose(name) for name in scene.movable}
        for edits in sequence:
            for name, what in edits:
                apply(session, name, what)
            session.update()
            found, digest = values_of(session, gathers), session.digest()
            session.recompute()
            for name, expected in values_of(session, gathers).items():
                np.testing.assert_array_equal(found[name], expected, err_msg=name)
            assert session.digest() == digest
        if "added" in session.poses:
            return
        for name, pose in home.items():
            session.move(name, pose)
            if session.poses[name] is None:
                session.add(name)
        assert digest_of(session) == first


@pytest.mark.parametrize("gather", ["off", 16])
def test_files_keep_objects_outside(tmp_path, gather):
    scene = open_room()
    with dl.Session(scene, samples_in(scene), paths=600, gather=gather) as session:
        session.bake()
        session.move("lamp", translation(1, 7, 0))
        session.add(dl.Mesh("added", *box((0.5, 0.1, 0.7)), "paint", pose=translation(9, 1, 0), movable=True))
        session.update()
        session.save(tmp_path / "far.dlx")
        with dl.Session.open(tmp_path / "far.dlx") as other:
            assert other.digest() == session.digest()
            for own in (session, other):
                own.move("added", translation(-30, 1, 0))
            assert digest_of(other) == digest_of(session)


def test_a_cancelled_way_out_changes_nothing(reports_at_once):
    scene = open_room()
    with dl.Session(scene, samples_in(scene), paths=20_000, gather=16) as session:
        session.bake()
        first, home = session.digest(), session.pose("lamp")
        stages: list[str] = []
        session.progress = lambda stage, _: stages.append(stage) or "trace paths" not in stages
        session.move("lamp", translation(0, 30, 0))
        session.add(dl.Mesh("added", *box((0.3,) * 3), "own glow", pose=translation(0, 20, 0), movable=True))
        with pytest.raises(dl.Cancelled):
            session.update()
        assert "trace paths" in stages
        session.progress = None
        there = digest_of(session)
        session.recompute()
        assert session.digest() == there
        session.move("lamp", home)
        session.remove("added")
        session.update()
        assert session.digest() != first  # it knows the added lamp
        assert len(session.irradiance) and np.isfinite(session.irradiance).all()


def test_a_lamp_above_the_roof_lights_what_it_should():
    """A bulb 8 m above an open floor, 6 m beyond the session's box: Lambert's law."""
    floor = dl.Mesh("floor", *box((4, 0.1, 4), (0, -0.05, 0)), "grey")
    bulb = dl.Mesh("carrier", *box((0.02,) * 3, (0, 0.3, 0)), "grey", pose=translation(0, 1, 0), movable=True)
    light = dl.PointLight("bulb", (0, 0, 0), (100, 100, 100), attached_to="carrier")
    scene = dl.Scene([floor, bulb], [dl.Material("grey", (0.5, 0.5, 0.5))], [light])
    points = dl.Samples([(0.3, 0, 0.2), (1, 0, -1)], (0, 1, 0), radius=0.2)
    for options in ({"gather": 64}, {"gather": "off", "direct": "paths"}):
        with dl.Session(scene, points, paths=200_000, **options) as session:
            session.bake()
            session.move("carrier", translation(0, 8, 0))
            session.update()
            squared = np.square([0.3, 1]) + 64 + np.square([0.2, 1])
            expected = 100 * 8 / squared**1.5
            allowed = np.maximum(5 * session.standard_error[:, 0], 1e-3 * expected)
            assert (np.abs(session.irradiance[:, 0] - expected) <= allowed).all()


def sunny(attached: str | None = None) -> dl.Scene:
    floor = dl.Mesh("floor", *box((4, 0.1, 4), (0, -0.05, 0)), "grey")
    block = dl.Mesh("block", *box((0.4,) * 3), "grey", pose=translation(0, 0.3, 0), movable=True)
    sun = dl.SunLight("sun", (0, -1, 0), (5, 5, 5), attached_to=attached)
    return dl.Scene([floor, block], [dl.Material("grey", (0.5, 0.5, 0.5))], [sun])


def test_things_may_rise_above_the_box_in_the_sun_but_not_leave_its_paths():
    scene = sunny()
    with dl.Session(scene, samples_in(scene), paths=2000, gather="off", direct="paths") as session:
        session.bake()
        first = session.digest()
        session.move("block", translation(0.2, 20, 0.1))
        there = digest_of(session)
        light = session.irradiance
        session.recompute()
        assert session.digest() == there
        np.testing.assert_array_equal(session.irradiance, light)
        with pytest.raises(dl.OptionError, match=r"would leave the box .* where paths of the sun begin"):
            session.move("block", translation(9, 1, 0))
        session.move("block", scene.mesh("block").pose)
        assert digest_of(session) == first


def test_shadows_of_things_far_above():
    """Paths of the sun begin above everything, wherever that is."""
    scene = sunny()
    under = dl.Samples([(0, 0, 0), (1.2, 0, 1.2)], (0, 1, 0), radius=0.1)
    with dl.Session(scene, under, paths=50_000, gather="off", direct="paths", max_bounces=1) as session:
        session.bake()
        session.move("block", translation(0, 50, 0))
        session.update()
        assert session.irradiance[0, 0] == 0
        assert session.irradiance[1, 0] == pytest.approx(5, rel=0.15)


def test_an_object_that_carries_a_sun_stays_inside():
    scene = sunny(attached="block")
    with dl.Session(scene, samples_in(scene), paths=500, gather="off") as session:
        session.bake()
        with pytest.raises(dl.OptionError, match="where paths of suns begin that objects carry"):
            session.move("block", translation(0, 30, 0))


def test_places_that_single_precision_cannot_hold():
    scene = open_room()
    with dl.Session(scene, samples_in(scene), paths=500, gather="off") as session:
        session.bake()
        with pytest.raises(dl.OptionError, match="beyond 1e15 m"):
            session.move("block", translation(2e15, 0, 0))
        with pytest.raises(dl.OptionError, match='move "block": single precision holds places there'):
            session.move("block", translation(1e9, 0, 0))
        far = dl.Mesh("added", *box((0.3,) * 3), "paint", pose=translation(1e9, 0, 0), movable=True)
        with pytest.raises(dl.OptionError, match='add "added": single precision holds places there'):
            session.add(far)


def test_a_part_of_the_paths_stays_in_the_box():
    scene = open_room()
    with dl.Session(scene, samples_in(scene), paths=800, gather=64, path_range=(0, 400)) as session:
        session.bake()
        with pytest.raises(dl.OptionError, match="other sessions hold some of its paths"):
            session.move("block", translation(0, 30, 0))


@pytest.mark.parametrize("angle", [0.2, 0.7, 1.3])
def test_a_turned_thing_with_samples_stands_close_to_a_wall(angle):
    """A round table whose rim almost touches the wall: the corners of its samples' bounds lie far outside."""
    turns = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    rim = np.stack([0.4 * np.cos(turns), np.zeros(48), 0.4 * np.sin(turns)], axis=1)
    vertices = np.concatenate([[(0, 0, 0)], rim])
    triangles = [(0, 1 + (k + 1) % 48, 1 + k) for k in range(48)]
    table = dl.Mesh("table", vertices, triangles, "wall", pose=translation(0, 0.7, 0), movable=True)
    base = sunny()
    walls = dl.Mesh("walls", *box((4, 2, 3), (0, 1, 0), inward=True), "wall")
    scene = dl.Scene([walls, table], [dl.Material("wall", (0.5,) * 3)], base.lights)
    samples = dl.Samples.on_vertices(scene, spacing=0.2)
    with dl.Session(scene, samples, paths=500, gather="off") as session:
        session.bake()
        session.move("table", translation(1.595, 0.7, 0) @ turn(angle))
        session.update()
        assert np.isfinite(session.irradiance).all()
