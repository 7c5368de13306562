# SPDX-License-Identifier: Apache-2.0
"""The contract of gather methods: equal to a slow reference, free of order, threads and company."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from hypothesis import given

from contract.disc_worlds import World, examples, few, nothing, pick, worlds
from contract.methods import GATHER_METHODS, Method

every_method = pytest.mark.parametrize("method", GATHER_METHODS, ids=lambda m: m.name)


def check(method: Method, segments: dl.Segments, samples: dl.Samples) -> dl.Estimate:
    """Compare with the reference."""
    found = method.estimate(segments, samples)
    assert np.isfinite(found.irradiance).all()
    expected, hits = method.reference(segments, samples)
    np.testing.assert_allclose(found.irradiance, expected, rtol=method.rtol, atol=1e-300)
    assert found.stats["hits"] == hits
    return found


@every_method
@examples(60)
@given(world=worlds())
def test_equals_the_reference(method, world: World):
    check(method, world.segments, world.samples)


@every_method
@examples(60)
@given(world=few())
def test_equals_the_reference_on_chosen_numbers(method, world: World):
    check(method, world.segments, world.samples)


@every_method
@examples(25)
@given(world=worlds())
def test_order_does_not_matter(method, world: World):
    rng = np.random.default_rng(len(world.segments))
    expected = method.estimate(world.segments, world.samples).irradiance
    other = world.segments.select(rng.permutation(len(world.segments)))
    np.testing.assert_array_equal(method.estimate(other, world.samples).irradiance, expected)
    order = rng.permutation(len(world.samples))
    samples = pick(world.samples, order)
    np.testing.assert_array_equal(method.estimate(world.segments, samples).irradiance, expected[order])


@every_method
def test_threads_do_not_matter(method):
    segments = dl.uniform_lines(20_000, seed=3)
    rng = np.random.default_rng(1)
    samples = dl.Samples(rng.uniform(-0.5, 0.5, (300, 3)), rng.normal(size=(300, 3)), radius=0.1)
    one, two, four = (method.estimate(segments, samples, threads=n) for n in (1, 2, 4))
    assert one.irradiance.all()
    for other in (two, four):
        np.testing.assert_array_equal(other.irradiance, one.irradiance)
        assert other.stats == one.stats


@every_method
@examples(25)
@given(world=worlds())
def test_samples_do_not_influence_each_other(method, world: World):
    together = method.estimate(world.segments, world.samples).irradiance
    for i in range(min(3, len(world.samples))):
        alone = pick(world.samples, [i])
        np.testing.assert_array_equal(method.estimate(world.segments, alone).irradiance[0], together[i])


@every_method
def test_coincident_samples_and_segments(method):
    """Many at one place: no leaf can be split between them."""
    power = np.random.default_rng(2).uniform(1, 2, 300)
    origin = np.tile([(0.0, 1, 0)], (300, 1))
    origin[:2, 0] = 0.05  # nearer, so that something lies inside the farthest one's distance
    segments = dl.Segments(origin, [(0, -1, 0)] * 300, np.full(300, 1.0), power)
    aside = dl.Samples(np.tile([(0.1, 0, 0)], (70, 1)), [(0, 1, 0)], radius=0.1)
    found = check(method, segments, aside)
    assert (found.irradiance == found.irradiance[0]).all()
    assert found.irradiance.all()
    check(method, segments, dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=0.1))


@every_method
def test_little_or_nothing(method):
    none, nowhere = nothing()
    single = dl.Segments([(0.25, 1, 0)], [(0, -1, 0)], [1.0], [2.0])
    one = dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=1.0)
    for segments, samples in ((none, one), (single, nowhere), (none, nowhere), (single, one)):
        found = check(method, segments, samples)
        assert found.irradiance.shape == (len(samples), 3)
        if not (len(segments) and len(samples)):
            assert not found.irradiance.any()
            assert found.stats["hits"] == 0


@every_method
def test_statistics_add_up(method):
    """Each of these samples uses as many segments as the method may."""
    segments = dl.uniform_lines(2000, seed=4)
    rng = np.random.default_rng(5)
    samples = dl.Samples(rng.uniform(-0.3, 0.3, (20, 3)), rng.normal(size=(20, 3)), radius=0.1)
    found = method.estimate(segments, samples)
    parts = [method.estimate(segments, pick(samples, [i])) for i in range(20)]
    assert found.stats["hits"] == sum(part.stats["hits"] for part in parts) > 0
    assert found.stats["disc_tests"] >= found.stats["hits"]


@every_method
def test_wrong_samples_and_options_are_refused(method):
    segments = dl.uniform_lines(10)
    with pytest.raises(dl.OptionError, match="attached"):
        method.estimate(segments, dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=1.0, attached_to="chair"))
    with pytest.raises(dl.OptionError, match="at most 1e"):
        method.estimate(segments, dl.Samples([(1e16, 0, 0)], [(0, 1, 0)], radius=1.0))
    with pytest.raises(dl.OptionError, match="threads"):
        method.estimate(segments, dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=1.0), threads=0)
