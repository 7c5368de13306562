# SPDX-License-Identifier: Apache-2.0
"""A session gives the same bits on every disc method, and for samples in any order."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from edit_sequences import SEQUENCES, apply
from hypothesis import given, settings
from rooms import room, samples_in, translation
from thoroughness import examples, slow

PAIRS = [  # static, moving
    ("disc_index", "disc_index"),
    ("disc_index", "sphere_cache"),  # the paper's hybrid
    ("sphere_cache", "sphere_cache"),
    ("ray_map", "ray_map"),
    ("sphere_cache", "ray_map"),
    ("brute_force", "disc_index"),
]


@pytest.mark.parametrize(
    "options", [slow({"direct": "paths"}), {"direct": "sampled", "segment_end": "bounded"}]
)
@settings(max_examples=examples(8))
@given(sequence=SEQUENCES)
def test_all_methods_give_one_digest(options, sequence):
    """After every update, with one thread and with two; the last state equals a recompute too."""
    scene = room()
    samples = samples_in(scene)
    digests = []
    for k, (static, moving) in enumerate(PAIRS):
        methods = {"static_method": static, "moving_method": moving, "threads": 1 + k % 2}
        with dl.Session(scene, samples, paths=400, gather=16, **methods, **options) as session:
            session.bake()
            own = [session.digest()]
            for edits in sequence:
                for edit in edits:
                    apply(session, edit)
                session.update()
                own.append(session.digest())
            session.recompute()
            assert session.digest() == own[-1]
            digests.append(own)
    for other in digests[1:]:
        assert other == digests[0]


@pytest.mark.parametrize("method", ["sphere_cache", slow("ray_map"), slow("brute_force")])
def test_other_readings_do_not_depend_on_the_method(method, tmp_path):
    scene = room()
    samples = samples_in(scene)
    read = []
    for name in ("disc_index", method):
        with dl.Session(
            scene, samples, paths=3000, gather=64, threads=2, static_method=name, moving_method=name
        ) as session:
            session.bake()
            session.move("block", translation(-0.4, 0.5, 0.1))
            while session.update(budget_ms=0.01).done < 1:
                pass
            session.save(tmp_path / "s.dlx")
            with dl.Session.open(tmp_path / "s.dlx") as opened:
                opened.move("block", translation(0.4, 0.6, 0.1))
                opened.update()
                read.append((session.irradiance, session.standard_error, session.gradient, opened.irradiance))
    for first, second in zip(*read, strict=True):
        np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("direct", [slow("paths"), "sampled"])
def test_the_order_of_samples_does_not_matter(direct):
    scene = room()
    samples = samples_in(scene)
    order = np.random.default_rng(3).permutation(len(samples))
    shuffled = dl.Samples(
        samples.points[order], samples.normals[order], samples.radius[order], samples.attached[order]
    )
    read = []
    for given_samples in (samples, shuffled):
        with dl.Session(scene, given_samples, paths=3000, gather=64, threads=1, direct=direct) as session:
            session.bake()
            session.move("block", translation(-0.4, 0.5, 0.1))
            session.update()
            read.append(
                (session.irradiance, session.standard_error, session.sums, session.radius, session.gradient)
            )
    for first, second in zip(*read, strict=True):
        np.testing.assert_array_equal(first[order], second)
