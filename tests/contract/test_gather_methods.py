# SPDX-License-Identifier: Apache-2.0
"""The contract of gather methods: equal to a slow reference, free of order, threads and company.

A new method joins by one entry in METHODS: how it is called, and its own reference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import deltalux as dl
import numpy as np
import pytest
from hypothesis import given
from oracles import nearest_segments

from contract.disc_worlds import World, few, worlds
from contract.test_disc_methods import examples


@dataclass(frozen=True)
class Method:
    """`estimate` and `reference` take segments and samples; the reference returns (n, 3)."""

    name: str
    estimate: Callable[..., dl.Estimate]
    reference: Callable[..., np.ndarray]
    rtol: float = 1e-9


def ray_map_method(**options) -> Method:
    name = "ray_map " + " ".join(f"{key}={value}" for key, value in options.items())
    return Method(
        name, partial(dl.estimate.ray_map, **options), partial(nearest_segments.irradiance, **options)
    )


METHODS = [
    ray_map_method(metric="hit", k=5),
    ray_map_method(metric="crossing", k=5),
    ray_map_method(metric="crossing", k=3, unbiased=False, segment_end="second"),
    ray_map_method(metric="line", k=5),
    ray_map_method(metric="line", k=4, unbiased=False, segment_end="first"),
]

every_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)


def shuffled(samples: dl.Samples, order: np.ndarray) -> dl.Samples:
    return dl.Samples(samples.points[order], samples.normals[order], samples.radius[order])


def check(method: Method, segments: dl.Segments, samples: dl.Samples) -> dl.Estimate:
    """Compare with the reference."""
    found = method.estimate(segments, samples)
    assert np.isfinite(found.irradiance).all()
    np.testing.assert_allclose(
        found.irradiance, method.reference(segments, samples), rtol=method.rtol, atol=1e-300
    )
    return found


@every_method
@examples(100)
@given(world=worlds())
def test_equals_the_reference(method, world: World):
    check(method, world.segments, world.samples)


@every_method
@examples(100)
@given(world=few())
def test_equals_the_reference_on_chosen_numbers(method, world: World):
    check(method, world.segments, world.samples)


@every_method
@examples(40)
@given(world=worlds())
def test_order_does_not_matter(method, world: World):
    rng = np.random.default_rng(len(world.segments))
    expected = method.estimate(world.segments, world.samples).irradiance
    other = world.segments.select(rng.permutation(len(world.segments)))
    np.testing.assert_array_equal(method.estimate(other, world.samples).irradiance, expected)
    order = rng.permutation(len(world.samples))
    samples = shuffled(world.samples, order)
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
@examples(40)
@given(world=worlds())
def test_samples_do_not_influence_each_other(method, world: World):
    together = method.estimate(world.segments, world.samples).irradiance
    for i in range(min(3, len(world.samples))):
        alone = shuffled(world.samples, np.array([i]))
        np.testing.assert_array_equal(method.estimate(world.segments, alone).irradiance[0], together[i])


@every_method
def test_coincident_samples_and_segments(method):
    """Many at one place: no leaf can be split between them."""
    rng = np.random.default_rng(2)
    segments = dl.Segments(
        np.tile([(0, 1, 0)], (300, 1)),
        np.tile([(0, -1, 0)], (300, 1)),
        np.full(300, 1.0),
        rng.uniform(1, 2, 300),
    )
    aside = dl.Samples(np.tile([(0.1, 0, 0)], (70, 1)), [(0, 1, 0)], radius=0.1)
    found = check(method, segments, aside)
    assert (found.irradiance == found.irradiance[0]).all()
    assert found.irradiance.all()
    check(method, segments, dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=0.1))


@every_method
def test_little_or_nothing(method):
    nothing = dl.Segments(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    nowhere = dl.Samples(np.zeros((0, 3)), np.zeros((0, 3)), radius=0.1)
    single = dl.Segments([(0.25, 1, 0)], [(0, -1, 0)], [1.0], [2.0])
    one = dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=1.0)
    for segments, samples in ((nothing, one), (single, nowhere), (nothing, nowhere), (single, one)):
        found = check(method, segments, samples)
        assert found.irradiance.shape == (len(samples), 3)
        assert found.stats["hits"] == (1 if len(segments) and len(samples) else 0)


@every_method
def test_statistics_add_up(method):
    """Each of these samples uses as many segments as the method may."""
    segments = dl.uniform_lines(2000, seed=4)
    rng = np.random.default_rng(5)
    samples = dl.Samples(rng.uniform(-0.3, 0.3, (20, 3)), rng.normal(size=(20, 3)), radius=0.1)
    found = method.estimate(segments, samples)
    parts = [method.estimate(segments, shuffled(samples, np.array([i]))) for i in range(20)]
    assert found.stats["hits"] == sum(part.stats["hits"] for part in parts) > 0
    assert found.stats["disc_tests"] >= found.stats["hits"]


@every_method
def test_wrong_samples_and_options_are_refused(method):
    segments = dl.uniform_lines(10)
    with pytest.raises(dl.OptionError, match="attached"):
        method.estimate(segments, dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=1.0, attached_to="chair"))
    with pytest.raises(dl.OptionError, match="farther"):
        method.estimate(segments, dl.Samples([(1e16, 0, 0)], [(0, 1, 0)], radius=1.0))
    with pytest.raises(dl.OptionError, match="threads"):
        method.estimate(segments, dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=1.0), threads=0)
