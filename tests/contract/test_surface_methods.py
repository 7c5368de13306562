# SPDX-License-Identifier: Apache-2.0
"""The contract of methods on surfaces: equal to a slow reference, free of order, threads and company.

Where irradiance comes from exact sums, these add up and can be taken back.
"""

from __future__ import annotations

import dataclasses

import deltalux as dl
import numpy as np
import pytest
from hypothesis import given
from scenes_for_tests import furnace

from contract.disc_worlds import World, examples, nothing, pick
from contract.floor_worlds import FLOOR, floor_scene, floor_worlds
from contract.methods import SURFACE_METHODS, SurfaceMethod

every_method = pytest.mark.parametrize("method", SURFACE_METHODS, ids=lambda m: m.name)
every_accumulator = pytest.mark.parametrize(
    "method", [m for m in SURFACE_METHODS if m.accumulator], ids=lambda m: m.name
)


@dataclasses.dataclass(frozen=True)
class Lit:
    """Traced light in a closed scene, and samples on its walls."""

    scene: dl.Scene
    segments: dl.Segments
    samples: dl.Samples


@pytest.fixture(scope="module")
def lit() -> Lit:
    scene, walls = furnace()
    return Lit(scene, dl.trace(scene, paths=3000, seed=1), walls.samples(300, seed=2, radius=0.1))


def check(method: SurfaceMethod, segments: dl.Segments, samples: dl.Samples) -> dl.Estimate:
    """Compare with the reference on the floor."""
    found = method.estimate(segments, samples, floor_scene())
    assert np.isfinite(found.irradiance).all()
    expected, hits = method.reference(segments, samples, FLOOR, found)
    sure = ~np.isnan(expected)
    most = expected.max(initial=0, where=sure)  # fits cancel: their rounding is that of the largest
    np.testing.assert_allclose(
        found.irradiance[sure], expected[sure], rtol=method.rtol, atol=method.rtol * most
    )
    assert found.stats["hits"] == hits
    return found


@every_method
@examples(40)
@given(world=floor_worlds())
def test_equals_the_reference(method, world: World):
    check(method, world.segments, world.samples)


@every_method
def test_order_does_not_matter(method, lit):
    rng = np.random.default_rng(5)
    expected = method.estimate(lit.segments, lit.samples, lit.scene)
    assert (expected.irradiance > 0).mean() > 0.9
    shuffled = lit.segments.select(rng.permutation(len(lit.segments)))
    found = method.estimate(shuffled, lit.samples, lit.scene)
    np.testing.assert_array_equal(found.irradiance, expected.irradiance)
    assert found.stats["hits"] == expected.stats["hits"]
    if method.at_samples:
        order = rng.permutation(len(lit.samples))
        found = method.estimate(lit.segments, pick(lit.samples, order), lit.scene)
        np.testing.assert_array_equal(found.irradiance, expected.irradiance[order])


@every_method
def test_threads_do_not_matter(method, lit):
    one, two, four = (method.estimate(lit.segments, lit.samples, lit.scene, threads=n) for n in (1, 2, 4))
    for other in (two, four):
        np.testing.assert_array_equal(other.irradiance, one.irradiance)
        assert other.stats == one.stats


@every_method
def test_samples_do_not_influence_each_other(method, lit):
    """And the hits of each add up."""
    few = pick(lit.samples, slice(5))
    together = method.estimate(lit.segments, few, lit.scene)
    alone = [method.estimate(lit.segments, pick(few, [i]), lit.scene) for i in range(5)]
    if method.at_samples:
        np.testing.assert_array_equal(np.concatenate([a.irradiance for a in alone]), together.irradiance)
        for name in ("hits", "disc_tests"):
            assert sum(a.stats[name] for a in alone) == together.stats[name] > 0
        assert together.stats["disc_tests"] >= together.stats["hits"]
    else:
        for other in alone:
            np.testing.assert_array_equal(other.irradiance, together.irradiance)


@every_method
def test_little_or_nothing(method):
    none, nowhere = nothing()
    one = dl.Samples([(-0.5, 0, -0.5)], [(0, 1, 0)], radius=0.1)
    single = dl.Segments([(-0.4, 1, -0.45)], [(0, -1, 0)], [1.0], [2.0])
    for segments, samples in ((none, one), (single, nowhere), (none, nowhere), (single, one)):
        found = check(method, segments, samples)
        if method.at_samples:
            assert found.irradiance.shape == (len(samples), 3)
        if segments is none:
            assert not found.irradiance.any()
            assert found.stats["hits"] == 0


@every_method
def test_coincident_samples_and_segments(method):
    """Two hits near the samples, and many at one place farther off."""
    origin = np.tile([(-0.4, 1.0, -0.45)], (300, 1))
    origin[:2, 0] = -0.45
    power = np.random.default_rng(2).uniform(1, 2, 300)
    segments = dl.Segments(origin, [(0, -1, 0)] * 300, np.ones(300), power)
    samples = dl.Samples(np.tile([(-0.5, 0, -0.45)], (70, 1)), [(0, 1, 0)], radius=0.1)
    found = check(method, segments, samples)
    assert found.irradiance.any()
    if method.at_samples:
        assert (found.irradiance == found.irradiance[0]).all()
        assert found.irradiance.all()


@every_method
def test_first_bounce_leaves_direct_light_out(method, lit):
    later = lit.segments.select(lit.segments.bounce >= 1)
    assert 0 < len(later) < len(lit.segments)
    found = method.estimate(lit.segments, lit.samples, lit.scene, first_bounce=1)
    expected = method.estimate(later, lit.samples, lit.scene)
    np.testing.assert_array_equal(found.irradiance, expected.irradiance)


@every_method
def test_wrong_options_are_refused(method, lit):
    with pytest.raises(dl.OptionError, match="scene: found None"):
        method.estimate(lit.segments, lit.samples, None)
    with pytest.raises(dl.OptionError, match="threads"):
        method.estimate(lit.segments, lit.samples, lit.scene, threads=0)
    if method.at_samples:
        samples = dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=1.0, attached_to="walls")
        with pytest.raises(dl.OptionError, match="attached"):
            method.estimate(lit.segments, samples, lit.scene)


# ---- exact sums ---------------------------------------------------------------------------------


@every_accumulator
@pytest.mark.parametrize("threads", [1, 2, 4])
def test_adding_and_removing_leaves_exactly_nothing(method, lit, threads):
    """In any order and parts; what is left between is what its segments alone give."""
    rng = np.random.default_rng(threads)
    rows = rng.permutation(len(lit.segments))
    gone, kept = rows[: len(rows) // 3], rows[len(rows) // 3 :]
    held = method.accumulator(lit.scene, threads=threads)
    for part in np.array_split(rows, 5):
        held.add(lit.segments.select(part))
    for part in np.array_split(rng.permutation(gone), 3):
        held.remove(lit.segments.select(part))
    alone = method.estimate(lit.segments.select(np.sort(kept)), lit.samples, lit.scene)
    assert alone.sums.any()
    np.testing.assert_array_equal(held.estimate.sums, alone.sums)
    assert held.estimate.stats == alone.stats
    held.remove(lit.segments.select(rng.permutation(kept)))
    assert not held.estimate.sums.any()
    assert not any(held.estimate.stats.values())


@every_accumulator
def test_parts_add_up(method, lit):
    odd = lit.segments.path % 2 == 1
    parts = [method.estimate(lit.segments.select(which), lit.samples, lit.scene) for which in (odd, ~odd)]
    whole = method.estimate(lit.segments, lit.samples, lit.scene)
    np.testing.assert_array_equal(parts[0].sums + parts[1].sums, whole.sums)
    for name, count in whole.stats.items():
        assert parts[0].stats[name] + parts[1].stats[name] == count
