# SPDX-License-Identifier: Apache-2.0
"""The photon map against a slow reference, its order-freedom, its borders and its units."""

from __future__ import annotations

from copy import copy

import deltalux as dl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contract.disc_worlds import World, few, worlds
from contract.test_disc_methods import examples

KERNELS = ("constant", "cone", "epanechnikov")
CONE = 1.1

every_kernel = pytest.mark.parametrize("kernel", KERNELS)
forms = st.fixed_dictionaries(
    {
        "k": st.sampled_from([2, 3, 8, 1000]),
        "kernel": st.sampled_from(KERNELS),
        "unbiased": st.booleans(),
        "compression": st.sampled_from([1.0, 1.0, 5.0]),
    }
)


def neighbours(segments, sample, normal, k, compression):
    """Squared distances of the k nearest photons and their numbers, nearest first."""
    direction = segments.direction.astype(float)
    n = normal
    facing = n[0] * direction[:, 0] + n[1] * direction[:, 1] + n[2] * direction[:, 2]
    photons = np.flatnonzero(np.isfinite(segments.length) & (facing < 0))
    end = (
        segments.origin[photons].astype(float)
        + segments.length[photons, None].astype(float) * (direction[photons])
    )
    gap = end - sample
    height = gap[:, 0] * n[0] + gap[:, 1] * n[1] + gap[:, 2] * n[2]
    distance2 = gap[:, 0] ** 2 + gap[:, 1] ** 2 + gap[:, 2] ** 2 + (compression**2 - 1) * height**2
    # Of equally far photons the weaker one is nearer; the rest of the order makes it total.
    keys = (
        segments.length[photons],
        *segments.origin[photons].T[::-1],
        *direction[photons].T[::-1],
        *segments.quanta[photons].T[::-1],
    )
    order = np.lexsort((*keys, distance2))[:k]
    return distance2[order], photons[order]


def reference(segments, samples, k=50, kernel="constant", unbiased=True, compression=1.0):
    irradiance = np.zeros((len(samples), 3))
    hits = 0
    for i, (point, normal) in enumerate(zip(samples.points, samples.normals, strict=True)):
        distance2, photon = neighbours(segments, point, normal, k, compression)
        if not len(photon):
            continue
        radius2 = distance2[-1]
        if unbiased:
            distance2, photon = distance2[:-1], photon[:-1]
        hits += len(photon)
        if radius2 == 0:
            continue
        share = distance2 / radius2
        weight, integral = {
            "constant": (np.ones_like(share), 1),
            "cone": (1 - np.sqrt(share) / CONE, 1 - 2 / (3 * CONE)),
            "epanechnikov": (1 - share, 0.5),
        }[kernel]
        power = segments.quanta[photon].astype(float) * segments.quantum
        irradiance[i] = weight @ power / (integral * np.pi * radius2)
    return irradiance, hits


@examples(300)
@given(world=worlds(), form=forms)
def test_equals_the_reference(world: World, form):
    found = dl.estimate.photon_map(world.segments, world.samples, **form)
    expected, hits = reference(world.segments, world.samples, **form)
    np.testing.assert_allclose(found.irradiance, expected, rtol=1e-9)
    assert found.stats["hits"] == hits


@examples(200)
@given(world=few(), form=forms)
def test_equals_the_reference_on_chosen_numbers(world: World, form):
    found = dl.estimate.photon_map(world.segments, world.samples, **form)
    assert np.isfinite(found.irradiance).all() or (world.segments.length < 1e-30).any()
    expected, hits = reference(world.segments, world.samples, **form)
    np.testing.assert_allclose(found.irradiance, expected, rtol=1e-9)
    assert found.stats["hits"] == hits


@examples(60)
@given(world=worlds(), form=forms)
def test_order_does_not_matter(world: World, form):
    rng = np.random.default_rng(len(world.segments))
    expected = dl.estimate.photon_map(world.segments, world.samples, **form).irradiance
    shuffled = world.segments.select(rng.permutation(len(world.segments)))
    order = rng.permutation(len(world.samples))
    samples = copy(world.samples)  # the constructor would scale the normals again
    samples.points, samples.normals = samples.points[order], samples.normals[order]
    np.testing.assert_array_equal(
        dl.estimate.photon_map(shuffled, world.samples, **form).irradiance, expected
    )
    np.testing.assert_array_equal(
        dl.estimate.photon_map(world.segments, samples, **form).irradiance, expected[order]
    )


@every_kernel
def test_threads_do_not_matter(kernel):
    segments = dl.uniform_lines(20_000, seed=3)
    rng = np.random.default_rng(1)
    points = rng.normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    samples = dl.Samples(points, -points)
    one, two, four = (dl.estimate.photon_map(segments, samples, kernel=kernel, threads=n) for n in (1, 2, 4))
    assert (one.irradiance > 0).all()
    for other in (two, four):
        np.testing.assert_array_equal(other.irradiance, one.irradiance)
        assert other.stats == one.stats


# ---- few photons, few samples -------------------------------------------------------------------

FLOOR = dl.Samples([(0, 0, 0)], [(0, 1, 0)])


def rain(at, power=1.0, height=1.0):
    """Vertical flights from `height` to the floor at (x, z)."""
    at = np.atleast_2d(at).astype(float)
    count = len(at)
    origin = np.stack([at[:, 0], np.full(count, height), at[:, 1]], axis=1)
    return dl.Segments(origin, [(0, -1, 0)] * count, np.full(count, height), power)


def test_nothing_gives_nothing():
    nothing = dl.Segments(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    nowhere = dl.Samples(np.zeros((0, 3)), np.zeros((0, 3)))
    for segments, samples in ((nothing, FLOOR), (rain((1, 0)), nowhere), (nothing, nowhere)):
        found = dl.estimate.photon_map(segments, samples)
        assert found.irradiance.shape == (len(samples), 3)
        assert not found.irradiance.any()
        assert found.stats["hits"] == 0


def test_one_photon_defines_a_region_with_nothing_in_it():
    one = rain((0.5, 0), power=3.0)
    assert not dl.estimate.photon_map(one, FLOOR).irradiance.any()
    plain = dl.estimate.photon_map(one, FLOOR, unbiased=False).irradiance
    np.testing.assert_allclose(plain, 3 / (np.pi * 0.25), rtol=1e-6)


def test_fewer_photons_than_k_are_a_smaller_k():
    segments = rain(np.random.default_rng(2).uniform(-1, 1, (7, 2)))
    seven, more = (dl.estimate.photon_map(segments, FLOOR, k=k).irradiance for k in (7, 100))
    assert seven.all()
    np.testing.assert_array_equal(more, seven)


def test_photons_at_the_sample_itself_have_no_area():
    found = dl.estimate.photon_map(rain(np.zeros((5, 2))), FLOOR, unbiased=False, k=3)
    np.testing.assert_array_equal(found.irradiance, 0)


def test_coincident_samples_are_equal():
    segments = rain(np.random.default_rng(2).uniform(-1, 1, (300, 2)))
    twins = dl.Samples([(0.1, 0, 0)] * 4, [(0, 1, 0)] * 4)
    found = dl.estimate.photon_map(segments, twins).irradiance
    np.testing.assert_array_equal(found, found[:1].repeat(4, axis=0))


def test_of_equally_far_photons_the_weaker_is_nearer():
    """Whatever the order of segments: four at 1 m, of which two count beside the one at 0.5 m."""
    at = np.array([(1, 0), (0, 1), (-1, 0), (0, -1), (0.5, 0)], float)
    power = np.array([4.0, 1.0, 8.0, 2.0, 16.0])
    for seed in range(10):
        order = np.random.default_rng(seed).permutation(5)
        found = dl.estimate.photon_map(rain(at[order], power[order]), FLOOR, k=3, unbiased=False)
        np.testing.assert_allclose(found.irradiance, (16 + 1 + 2) / np.pi, rtol=1e-6)


def test_light_from_behind_and_light_that_hits_nothing_do_not_count():
    below = dl.Segments([(0.5, -1, 0)] * 3, [(0, 1, 0)] * 3, [1.0] * 3, 1.0)
    endless = dl.Segments([(0.5, 1, 0)] * 3, [(0, -1, 0)] * 3, [np.inf] * 3, 1.0)
    for segments in (below, endless):
        assert dl.estimate.photon_map(segments, FLOOR).stats["hits"] == 0


def test_light_that_leaves_the_scene_has_no_hit():
    """Segments that were traced into the open end at the scene's border, in free air."""
    floor = dl.Mesh("floor", [(-1, 0, -1), (-1, 0, 1), (1, 0, 1), (1, 0, -1)], [(0, 1, 2), (0, 2, 3)], "g")
    bulb = dl.PointLight("bulb", (0, 1, 0))
    traced = dl.trace(dl.Scene([floor], [dl.Material("g", (0.9, 0.9, 0.9))], [bulb]), paths=2000)
    assert (traced.primitive == 0xFFFFFFFF).sum() > 500
    landed = int(((traced.primitive != 0xFFFFFFFF) & (traced.direction[:, 1] < 0)).sum())
    found = dl.estimate.photon_map(traced, FLOOR, k=10_000)
    assert found.stats["hits"] == landed - 1


def test_first_bounce_leaves_direct_light_out():
    segments = dl.Segments(
        [(x, 1, 0) for x in (1, 1, 1, 2)],
        [(0, -1, 0)] * 4,
        [1.0] * 4,
        [1.0, 2.0, 4.0, 8.0],
        bounce=[0, 1, 2, 2],
    )
    sums = [
        dl.estimate.photon_map(segments, FLOOR, first_bounce=b).irradiance[0, 0] * np.pi * 4 for b in range(3)
    ]
    np.testing.assert_allclose(sums, [7, 6, 4], rtol=1e-6)


def test_compression_keeps_photons_above_the_plane_out():
    """Five on the floor at 1 m, five on a shelf 0.5 m above the sample."""
    above = dl.Segments([(0, 1, 0)] * 5, [(0, -1, 0)] * 5, [0.5] * 5, 100.0)
    both = dl.Segments(
        np.concatenate([rain([(1, 0)] * 5).origin, above.origin]),
        [(0, -1, 0)] * 10,
        [1.0] * 5 + [0.5] * 5,
        [1.0] * 5 + [100.0] * 5,
    )
    sphere, flat = (
        dl.estimate.photon_map(both, FLOOR, k=5, unbiased=False, compression=c).irradiance[0, 0]
        for c in (1, 4)
    )
    np.testing.assert_allclose(sphere, 500 / (np.pi * 0.25), rtol=1e-6)
    np.testing.assert_allclose(flat, 5 / np.pi, rtol=1e-6)


# ---- refusals and stopping ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"k": 1}, "k: found 1, expected an integer number of hits, at least 2"),
        ({"k": 2.5}, "k: found 2.5"),
        ({"kernel": "gauss"}, "kernel: found 'gauss'"),
        ({"area": "hull"}, "area: found 'hull'"),
        ({"area": "surface"}, "scene: found None"),
        ({"area": "surface", "scene": "office"}, "scene: found 'office'"),
        ({"compression": 0.5}, "compression: found 0.5"),
        ({"compression": np.nan}, "compression: found nan"),
        ({"cone": 0.9}, "cone: found 0.9"),
        ({"threads": 0}, "threads"),
    ],
)
def test_wrong_options_are_refused(options, words):
    with pytest.raises(dl.OptionError, match=words):
        dl.estimate.photon_map(rain((1, 0)), FLOOR, **options)


def test_attached_samples_are_refused():
    with pytest.raises(dl.OptionError, match="attached"):
        dl.estimate.photon_map(rain((1, 0)), dl.Samples([(0, 0, 0)], [(0, 1, 0)], attached_to="chair"))


def test_a_callback_stops_it():
    segments = dl.uniform_lines(300_000)
    points = np.random.default_rng(0).normal(size=(100_000, 3))
    with pytest.raises(dl.Cancelled):
        dl.estimate.photon_map(segments, dl.Samples(points, -points), progress=lambda stage, share: False)
