# SPDX-License-Identifier: Apache-2.0
"""The law of the product: update equals recompute, to the bit, over random edit sequences."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from edit_sequences import EDIT, SEQUENCES, apply, equals_recompute
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rooms import room, samples_in, translation, turn
from thoroughness import examples, slow

OPTIONS = [
    {"direct": "paths"},
    {"direct": "sampled"},
    {"direct": "auto", "threads": 2},
    {"direct": "paths", "segment_end": "bounded", "gather": "off"},
    {"direct": "sampled", "segment_end": "second", "disc_area": "whole", "gather": "off"},
    {"direct": "auto", "gather": 16},
    {"direct": "paths", "gather": 8, "threads": 3, "segment_end": "bounded"},
]


@pytest.mark.parametrize("options", OPTIONS, ids=lambda o: "-".join(map(str, o.values())))
@settings(max_examples=examples(45), suppress_health_check=[HealthCheck.too_slow])
@given(sequence=SEQUENCES)
def test_update_equals_recompute(options, sequence):
    """45 sequences for each set of options, a check after every update."""
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=600, **{"threads": 1, "gather": 32} | options) as session:
        session.bake()
        for edits in sequence:
            for edit in edits:
                apply(session, edit)
            session.update()
            equals_recompute(session)


@settings(max_examples=examples(30))
@given(sequence=SEQUENCES, direct=st.sampled_from(["paths", "sampled"]))
def test_what_is_kept_between_readings_is_right(sequence, direct):
    """Readings renew what changed since the last one; only the last one is checked here."""
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=600, threads=2, gather=16, direct=direct) as session:
        session.bake()
        for edits in sequence:
            for edit in edits:
                apply(session, edit)
                if edit[0] != "paint":
                    session.update()
                    assert np.isfinite(session.irradiance).all()
            session.update()
        equals_recompute(session)


@pytest.mark.parametrize("groups", [slow(7), 8, 11])
@settings(max_examples=examples(10))
@given(sequence=SEQUENCES)
def test_more_groups_than_sums(groups, sequence):
    """Groups from the eighth on share sums if there are more; an edit may bring the eighth or the ninth."""
    scene = room(groups=groups)
    with dl.Session(scene, samples_in(scene), paths=600, gather=64, threads=1, direct="paths") as session:
        session.bake()
        session.dim(list(session.dim_factors)[-1], 0.25)
        for edits in sequence:
            for edit in edits:
                apply(session, edit)
            session.update()
            equals_recompute(session)


@settings(max_examples=examples(30))
@given(edit=EDIT, direct=st.sampled_from(["paths", "sampled"]))
def test_edit_and_inverse_restore_every_bit(edit, direct):
    if edit[0] == "insert":
        return  # has no inverse
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=500, gather=64, threads=1, direct=direct) as session:
        session.bake()
        first, home = session.digest(), {name: session.pose(name) for name in scene.movable}
        reflectance = {m.name: m.reflectance for m in scene.materials}
        apply(session, edit)
        session.update()
        for name in scene.movable:
            if session.poses[name] is None:
                session.add(name)
            session.move(name, home[name])
            session.set_reflectance("wall", reflectance["wall"])
            session.set_reflectance("paint", reflectance["paint"])
        for group in session.dim_factors:
            session.dim(group, 1.0)
        session.update()
        assert session.digest() == first


def test_history_does_not_matter():
    """A session baked in a state and one edited to it have one digest; where rays go, the bake fixes."""
    scene = room()
    target = translation(-0.5, 0.5, 0.3) @ turn(0.7)
    moved = dl.Scene(
        [m if m.name != "block" else dl.Mesh(m.name, m.vertices, m.triangles, m.material, m.material_index,
                                             target, True) for m in scene.meshes],
        scene.materials, scene.lights,
    )  # fmt: skip
    for direct in ("paths", "sampled"):
        with (
            dl.Session(scene, samples_in(scene), paths=2000, direct=direct, gather="off") as edited,
            dl.Session(moved, samples_in(moved), paths=2000, direct=direct, gather="off") as baked,
        ):
            edited.bake()
            baked.bake()
            assert edited.digest() != baked.digest()
            edited.move("block", target)
            edited.update()
            assert edited.digest() == baked.digest()


@pytest.mark.parametrize("direct", ["paths", "sampled"])
def test_threads_do_not_matter(direct):
    digests = set()
    for threads in (1, 2, 4):
        scene = room()
        with dl.Session(
            scene, samples_in(scene), paths=20_000, gather=64, threads=threads, direct=direct
        ) as session:
            session.bake()
            session.move("block", translation(-0.4, 0.5, 0.2))
            session.update()
            digests.add(session.digest())
    assert len(digests) == 1


def test_seeds_matter():
    scene = room()
    digests = set()
    for seed in (1, 2):
        with dl.Session(scene, samples_in(scene), paths=500, gather=64, seed=seed) as session:
            session.bake()
            digests.add(session.digest())
    assert len(digests) == 2


def test_adding_a_sample_changes_no_other():
    scene = room()
    few = dl.Samples([(0, 0, 0), (1, 0, 1)], [(0, 1, 0), (0, 1, 0)], radius=0.2)
    more = dl.Samples([(0.5, 0, 0.5), (0, 0, 0), (1, 0, 1)], [(0, 1, 0)] * 3, radius=[0.1, 0.2, 0.2])
    for options in ({"direct": "paths"}, {"direct": "sampled"}, {"gather": 64}):
        results = []
        for samples in (few, more):
            with dl.Session(scene, samples, paths=5000, **{"gather": "off"} | options) as session:
                session.bake()
                results.append(session.irradiance)
        np.testing.assert_array_equal(results[0], results[1][1:])


@pytest.mark.parametrize("direct", ["paths", "sampled"])
def test_budgeted_updates_end_exactly(direct):
    """Slices of any size, with a new edit in between, end in the recompute's bits."""
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=60_000, gather=64, threads=1, direct=direct) as session:
        session.bake()
        session.set_reflectance("wall", (0.5, 0.5, 0.5))
        frame = session.update(budget_ms=0.01)
        assert frame.done < 1
        session.move("lamp", translation(0.9, 1.2, -0.4))
        frame = session.update(budget_ms=0.01)
        calls = 0
        while frame.done < 1:
            frame = session.update(budget_ms=0.01)
            calls += 1
            assert calls < 1000
        equals_recompute(session)


def test_shadow_rays_keep_to_the_budget_and_end_exactly():
    """Lights take turns: while one drags, what they light lags behind; in the end nothing is missing."""
    scene = dl.scenes.office()
    samples = dl.Samples.on_vertices(scene, spacing=1.5, radius=0.2)
    with dl.Session(scene, samples, paths=1000, direct="sampled", gather=8) as session:
        session.bake()
        start = session.pose("chair")
        shares = []
        for step in range(12):
            session.move("chair", start @ translation(0.02 * step, 0, -0.03 * step))
            shares.append(session.update(budget_ms=1e-3).done)
        assert min(shares) < 0.5
        assert session.update().done == 1
        equals_recompute(session)
