# SPDX-License-Identifier: Apache-2.0
"""Update equals recompute where it is easiest to get wrong: odd scenes, pending work, new lights."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from edit_sequences import equals_recompute
from rooms import box, room, samples_in, translation, turn
from thoroughness import slow

FLOOR = [(-1.0, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)]


def finish(session):
    """Update in slices until nothing is pending."""
    for _ in range(5000):
        if session.update(budget_ms=0.01).done == 1:
            return
    raise AssertionError("never done")


def lamp(name, group, pose, side=0.2):
    material = {"desk": "glow", "ceiling": "ceiling glow"}[group]
    return dl.Mesh(name, *box((side, side, side)), material, pose=pose, movable=True)


# ---- scenes -------------------------------------------------------------------------------------


def test_what_hides_the_places_that_rays_reached_since_the_bake():
    """A screen comes close to the samples, so that rays go on from it; then a card does, before it alone."""
    scene = dl.Scene(
        [
            dl.Mesh("walls", *box((4, 2, 3), (0, 1, 0), inward=True), "grey"),
            dl.Mesh("screen", *box((0.02, 0.6, 0.6)), "grey", pose=translation(1.5, 0.301, 0), movable=True),
            dl.Mesh("card", *box((0.001, 0.3, 0.5)), "grey", pose=translation(1.2, 0.5, 1), movable=True),
        ],
        [dl.Material("grey", (0.7, 0.7, 0.7))],
        [dl.PointLight("bulb", (-1.5, 1.2, 0), (1, 1, 1))],
    )
    place = [(0.0, 0.0, 1e-3 * k) for k in range(16)]  # rays of all are judged together
    with dl.Session(scene, dl.Samples(place, (0, 1, 0)), paths=20_000, gather=512) as session:
        session.bake()
        session.move("screen", translation(0.06, 0.301, 0))
        session.update()
        for x in (0.045, 0.03):
            session.move("card", translation(x, 0.2, 0))
            assert session.update().changed_rays > 100
            equals_recompute(session)


def test_what_moves_aside_before_the_sky():
    """A stick moves by many times its width: rays that met nothing meet it, others meet it no more."""
    scene = dl.Scene(
        [
            dl.Mesh("floor", FLOOR, [(0, 2, 1), (0, 3, 2)], "grey"),
            dl.Mesh("stick", *box((0.02, 0.02, 0.9)), "grey", pose=translation(0, 0.3, 0), movable=True),
        ],
        [dl.Material("grey", (0.7, 0.7, 0.7))],
        [dl.PointLight("bulb", (0.2, 0.1, 0), (1, 1, 1))],
    )
    place = [(0.05 * k, 0.0, 0.02 * k) for k in range(-10, 11)]
    with dl.Session(scene, dl.Samples(place, (0, 1, 0)), paths=20_000, gather=1024) as session:
        session.bake()
        for x in (0.1, 0.3, -0.1, 0.15, -0.6):
            session.move("stick", translation(x, 0.3, 0))
            assert session.update().changed_rays > 100
            equals_recompute(session)


@pytest.mark.parametrize("direct", ["paths", "sampled"])
def test_a_lamp_post_whose_bulb_is_outside_the_scenes_box(direct):
    """Outlines of segments that reach beyond the scan's grid must still find what they meet."""
    scene = dl.Scene(
        [
            dl.Mesh("floor", FLOOR, [(0, 2, 1), (0, 3, 2)], "grey"),
            dl.Mesh("post", *box((0.05, 0.5, 0.05)), "grey", pose=translation(0.9, 0.25, 0.9), movable=True),
            dl.Mesh("block", *box((0.3, 0.2, 0.3)), "grey", pose=translation(-0.5, 0.11, 0), movable=True),
        ],
        [dl.Material("grey")],
        [dl.PointLight("bulb", (0, 3.0, 0), (1, 1, 1), attached_to="post")],
    )
    points = np.random.default_rng(1).uniform((-1, 0, -1), (1, 0, 1), (50, 3))
    samples = dl.Samples.concatenate(
        [dl.Samples(points, (0, 1, 0), radius=0.1), dl.Samples((0.2, 0.4, 0.1), (0, 1, 0), radius=0.2)]
    )
    with dl.Session(scene, samples, paths=20_000, gather=64, direct=direct) as session:
        session.bake()
        for x in (-0.4, 0.0, 0.3, 0.7):
            session.move("block", translation(x, 0.11, 0.2 - x))
            assert session.update().affected_paths > 10
            equals_recompute(session)
        session.move("post", translation(-0.9, 0.25, 0.2))
        session.update()
        session.move("block", translation(0.1, 0.11, 0.1))
        session.update()
        equals_recompute(session)


@pytest.mark.parametrize("direct", ["paths", "sampled"])
def test_a_sun_that_turns_with_a_movable(direct):
    """In a long, flat scene a turn changes the sun's power more than a bit of headroom holds."""
    corners = np.array(FLOOR) * (20, 1, 0.5)
    scene = dl.Scene(
        [
            dl.Mesh("floor", corners, [(0, 2, 1), (0, 3, 2)], "grey"),
            dl.Mesh("dial", *box((0.1, 0.1, 0.1)), "grey", pose=translation(0, 0.2, 0), movable=True),
        ],
        [dl.Material("grey")],
        [dl.SunLight("sun", (1, -0.02, 0), (2, 2, 2), attached_to="dial")],
    )
    samples = dl.Samples([(1, 0, 0), (5, 0, 0)], (0, 1, 0), radius=0.45)
    with dl.Session(scene, samples, paths=40_000, gather=64, direct=direct) as session:
        session.bake()
        down = np.eye(4)
        down[:3, :3] = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
        for pose in (turn(1.0), turn(np.pi / 2), down):
            session.move("dial", translation(0, 0.2, 0) @ pose)
            session.update()
            equals_recompute(session)
        noise = 6 * session.standard_error + 0.002
        assert (np.abs(session.irradiance - 2) < noise).all()


def test_a_mesh_added_at_the_border_keeps_the_box_of_the_session(tmp_path):
    """Measured anew with that mesh, the scene's box would be larger, and every border with it."""
    scene = dl.Scene(
        [
            dl.Mesh(
                "floor", [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], [(0, 2, 1), (0, 3, 2)], "grey"
            ),
            dl.Mesh("block", *box((0.3, 0.2, 0.3)), "grey", pose=translation(-0.5, 0.11, 0), movable=True),
        ],
        [dl.Material("grey")],
        [dl.PointLight("bulb", (0, 3, 0), (1, 1, 1))],
    )
    path = tmp_path / "border.dlx"
    with dl.Session(
        scene, dl.Samples((0.2, 0, 0.1), (0, 1, 0), radius=0.1), paths=4000, gather=64
    ) as session:
        session.bake()
        session.add(
            dl.Mesh("sign", *box((0.4, 0.4, 0.4)), "grey", pose=translation(0.3, 2.79, 0.2), movable=True)
        )
        session.save(path)
        with dl.Session.open(path) as opened:
            for each in (session, opened):
                each.move("block", translation(0.5, 0.11, 0.1))
                each.update()
            digest = session.digest()
            assert opened.digest() == digest
            opened.recompute()
            assert opened.digest() == digest


def test_two_objects_swap_places():
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=20_000, gather=64) as session:
        session.bake()
        block, lamp_pose = session.pose("block"), session.pose("lamp")
        session.move("block", lamp_pose)
        session.move("lamp", block)
        session.update()
        equals_recompute(session)


def test_moving_a_removed_object_and_bringing_it_back():
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=20_000, gather=64) as session:
        session.bake()
        first = session.digest()
        home = session.pose("lamp")
        session.remove("lamp")
        session.update()
        dark = session.digest()
        session.move("lamp", translation(0.5, 1.0, 0.5))
        frame = session.update()
        assert frame.retraced_segments == 0
        assert session.digest() != dark  # the pose is part of the state
        equals_recompute(session)
        session.add("lamp")
        session.update()
        equals_recompute(session)
        session.move("lamp", home)
        session.update()
        assert session.digest() == first


def test_signs_of_zeros_in_poses_do_not_matter():
    """-0.0 and 0.0 are one state, so they have one digest."""
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=1000, gather=64) as session:
        session.bake()
        pose = session.pose("block")
        first = session.digest()
        minus = np.where(pose == 0, -0.0, pose)
        minus[3] = pose[3]
        session.move("block", minus)
        session.update()
        assert session.digest() == first
        equals_recompute(session)


@pytest.mark.parametrize("direct", ["paths", "sampled"])
def test_a_new_lamp_that_outshines_all_others(direct):
    scene = room(groups=3)
    bright = dl.Scene(
        scene.meshes,
        [*scene.materials, dl.Material("blinding", emission=(300, 200, 100), group="desk")],
        scene.lights,
    )
    with dl.Session(bright, samples_in(scene), paths=500, gather=64, direct=direct) as session:
        session.bake()
        pose = translation(0.6, 1.2, -0.6)
        session.add(dl.Mesh("new", *box((0.2, 0.2, 0.2)), "blinding", pose=pose, movable=True))
        session.update()
        equals_recompute(session)


# ---- pending work -------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["first", "bounded"])
def test_dimming_beyond_eight_groups_while_paths_are_pending(end):
    scene = room(groups=11)
    options = {"paths": 40_000, "threads": 1, "direct": "paths", "segment_end": end}
    with dl.Session(scene, samples_in(scene), **options) as session:
        session.bake()
        session.set_reflectance("wall", (0.2, 0.5, 0.3))
        assert session.update(budget_ms=0.01).done < 1
        session.dim("bulb8", 0.3)
        session.dim("bulb2", 0.6)
        assert session.update(budget_ms=0.01).done < 1
        session.move("block", translation(-0.3, 0.5, 0.1))
        session.dim("bulb8", 0.0)
        session.dim("bulb7", 1.5)
        session.update(budget_ms=0.01)
        finish(session)
        equals_recompute(session)


@pytest.mark.parametrize("direct", [slow("paths"), slow("sampled"), "auto"])
def test_new_lights_while_paths_are_pending(direct):
    scene = room(groups=3)
    with dl.Session(scene, samples_in(scene), paths=40_000, gather=64, direct=direct) as session:
        session.bake()
        session.set_reflectance("wall", (0.2, 0.5, 0.3))
        assert session.update(budget_ms=0.01).done < 1
        session.add(lamp("new", "desk", translation(0.6, 1.2, -0.6)))
        session.update(budget_ms=0.01)
        session.remove("new")
        session.move("lamp", translation(-0.3, 1.4, 0.3))
        session.update(budget_ms=0.01)
        session.add("new")
        session.add(lamp("newer", "ceiling", translation(-0.6, 1.2, 0.6) @ turn(0.3)))
        session.update(budget_ms=0.01)
        finish(session)
        equals_recompute(session)


def energy_adds_up(session):
    audit = session.energy
    total = np.array(audit["absorbed"]) + np.array(audit["escaped"])
    np.testing.assert_array_equal(total, audit["emitted"])


@pytest.mark.parametrize("budget", [0.001, slow(1.0), slow(30.0), 1e9])
def test_any_budget_ends_in_the_recomputes_bits_and_loses_no_energy(budget):
    """A stale path stays in the sums, whole, until its replacement takes its place."""
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=40_000, gather=64, threads=1, direct="paths") as session:
        session.bake()
        energy_adds_up(session)
        edits = [
            lambda: session.set_reflectance("wall", (0.2, 0.5, 0.3)),
            lambda: session.move("block", translation(-0.3, 0.5, 0.1)),
            lambda: session.move("block", translation(0.3, 0.9, 0.1)),
        ]
        for calls in range(100_000):
            if edits and calls % 3 == 0:
                edits.pop(0)()
            frame = session.update(budget_ms=budget)
            energy_adds_up(session)
            if frame.done == 1 and not edits:
                break
        equals_recompute(session)


def test_a_budget_without_end_takes_large_steps():
    """Path by path, a method with a cost per step would take a hundred times as long."""
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.1)
    milliseconds = []
    with dl.Session(
        scene, samples, paths=8000, gather=64, threads=1, static_method="sphere_cache"
    ) as session:
        session.bake()
        for x, budget in ((0.3, None), (-0.3, float("inf"))):
            session.move("block", translation(x, 0.5, 0.1))
            frame = session.update(budget_ms=budget)
            assert frame.done == 1
            milliseconds.append(frame.milliseconds["total"])
    assert milliseconds[1] < 10 * milliseconds[0] + 200


def test_a_budget_spreads_the_error_over_the_scene():
    """Half the work done is about half the change everywhere, not all of it near one lamp."""
    bulbs = [dl.PointLight(f"bulb{x}", (x, 0.6, 0), (1, 1, 1)) for x in (-3.0, 3.0)]
    walls = dl.Mesh("walls", *box((8, 2, 2), (0, 1, 0), inward=True), "wall")
    block = dl.Mesh("block", *box((0.2, 0.2, 0.2)), "wall", pose=translation(0, 1, 0), movable=True)
    scene = dl.Scene([walls, block], [dl.Material("wall", (0.6, 0.6, 0.6))], bulbs)
    points = [(x, 0, z) for x in (-3.0, 3.0) for z in (-0.5, 0.0, 0.5)]
    samples = dl.Samples(points, (0, 1, 0), radius=0.4)
    with dl.Session(scene, samples, paths=100_000, threads=1, direct="paths", gather="off") as session:
        session.bake()
        old = session.irradiance[:, 0]
        session.set_reflectance("wall", (0.2, 0.2, 0.2))
        waiting = 1.0
        while waiting > 0.5:
            waiting *= 1 - session.update(budget_ms=0.001).done
        half = session.irradiance[:, 0]
        session.update()
        new = session.irradiance[:, 0]
        share = [
            (half[side] - old[side]).mean() / (new[side] - old[side]).mean()
            for side in (slice(3), slice(3, 6))
        ]
        np.testing.assert_allclose(share, 1 - waiting, atol=0.08)
        equals_recompute(session)


def test_a_new_lamp_keeps_to_the_budget():
    """Its paths are pending work like any other, so a budget or a cancel can stop between them."""
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=20_000, gather=64, threads=1) as session:
        session.bake()
        lit = session.statistics["segments"]
        session.add(lamp("sunny", "ceiling", translation(0.6, 1.0, -0.6), side=0.8))
        frame = session.update(budget_ms=0.01)
        assert frame.done < 1
        finish(session)
        assert session.statistics["segments"] > 1.3 * lit
        equals_recompute(session)


@pytest.mark.parametrize(("gather", "edits"), [("off", 600), slow(64, 200)])
def test_memory_does_not_grow_with_the_number_of_edits(gather, edits):
    scene, options = room(), {"threads": 1, "direct": "sampled", "gather": gather}
    with dl.Session(scene, samples_in(scene), paths=4000, **options) as session:
        session.bake()
        rng = np.random.default_rng(2)
        sizes = []
        for step in range(edits):
            session.move("block", translation(*rng.uniform((-1.5, 0.5, -1), (1.5, 1.5, 1))) @ turn(step))
            session.move("lamp", translation(*rng.uniform((-1.5, 0.5, -1), (1.5, 1.5, 1))))
            session.update()
            sizes.append(session.statistics["bytes"])
        # Each update replaces about 1000 segments of 60 bytes; storage comes in pieces of 123 kB. That of
        # chains doubles at a time.
        doubled = 0 if gather == "off" else session.statistics["gather"]["ray_bytes"] / 2
        assert max(sizes[edits // 2 :]) <= max(sizes[: edits // 2]) + 4 * 123_000 + doubled
        equals_recompute(session)


def test_openness_comes_from_the_file(tmp_path):
    """Beside the boxes of the Cornell box it differs from 1; a recompute divides by the areas anew."""
    scene = dl.scenes.cornell_box()
    samples = dl.Samples.on_vertices(scene, spacing=0.5)
    with dl.Session(scene, samples, paths=2000, direct="paths", gather="off") as session:
        session.bake()
        session.save(tmp_path / "box.dlx")
        with dl.Session.open(tmp_path / "box.dlx") as opened:
            opened.recompute()
            np.testing.assert_array_equal(opened.irradiance, session.irradiance)


def test_chains_that_an_edit_brought_are_followed_by_the_next_edit():
    """A box comes beside samples that had nothing near; then another one shades the side that they see."""
    rng = np.random.default_rng(4)
    points = np.column_stack([rng.uniform(-0.1, 0.1, 24), np.zeros(24), rng.uniform(-0.1, 0.1, 24)])
    scene = dl.Scene(
        [
            dl.Mesh("walls", *box((6, 3, 6), (0, 1.5, 0), inward=True), "wall"),
            dl.Mesh("near", *box((0.3, 0.3, 0.3)), "wall", pose=translation(2, 0.151, 2), movable=True),
            dl.Mesh("shade", *box((0.3, 0.05, 0.3)), "wall", pose=translation(-2, 2.5, -2), movable=True),
        ],
        [dl.Material("wall", (0.7, 0.7, 0.7))],
        [dl.PointLight("bulb", (-0.5, 2.8, 0), (5, 5, 5))],
    )
    with dl.Session(scene, dl.Samples(points, (0, 1, 0)), paths=2000, gather=64) as session:
        session.bake()
        for name, at in (("near", (0.28, 0.151, 0)), ("shade", (-0.1, 1.5, 0)), ("shade", (-0.14, 1.6, 0))):
            session.move(name, translation(*at))
            session.update()
        equals_recompute(session)
