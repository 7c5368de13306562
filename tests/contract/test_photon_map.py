# SPDX-License-Identifier: Apache-2.0
"""The photon map beyond what every gather method promises: which photons count, ties, refusals."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest

# ---- few photons, few samples -------------------------------------------------------------------

FLOOR = dl.Samples([(0, 0, 0)], [(0, 1, 0)])


def rain(at, power=1.0, height=1.0):
    """Vertical flights from `height` to the floor at (x, z)."""
    at = np.atleast_2d(at).astype(float)
    count = len(at)
    origin = np.stack([at[:, 0], np.full(count, height), at[:, 1]], axis=1)
    return dl.Segments(origin, [(0, -1, 0)] * count, np.full(count, height), power)


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


def test_a_callback_stops_it():
    segments = dl.uniform_lines(300_000)
    points = np.random.default_rng(0).normal(size=(100_000, 3))
    with pytest.raises(dl.Cancelled):
        dl.estimate.photon_map(segments, dl.Samples(points, -points), progress=lambda stage, share: False)
