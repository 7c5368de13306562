# SPDX-License-Identifier: Apache-2.0
"""The sphere cache walks as its slow reference does, and loses hits only where that is announced."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from oracles.sphere_cache_reference import walk
from thoroughness import all_but_slow, slow

ORDERS = ("none", "lebesgue", "hilbert")
CONTAINMENTS = ("all", "nested", "literal")
UNIT_SPHERE = ((0, 0, 0), 1.0)


def samples_in_ball(count, radius, seed=5):
    """Uniform in the unit ball, in no order, with uniform normals."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points *= (rng.uniform(0, 1, count) ** (1 / 3) / np.linalg.norm(points, axis=1))[:, None]
    return dl.Samples(points, rng.normal(size=(count, 3)), radius=radius)


@pytest.fixture(scope="module")
def lines():
    return dl.uniform_lines(4000, seed=2)


def check_against_reference(segments, samples, outer_sphere, segment_end="bounded", **options):
    found = dl.estimate.sphere_cache(
        segments, samples, outer_sphere=outer_sphere, segment_end=segment_end, threads=1, **options
    ).stats
    expected = walk(
        segments,
        samples,
        outer_radius=outer_sphere[1] if outer_sphere else None,
        segment_end=segment_end,
        **options,
    )
    np.testing.assert_allclose(found["radii"], expected.radii, rtol=1e-6)
    assert found["rebuilds"] == expected.rebuilds
    assert found["first_misses"] == expected.first_misses
    means = [np.mean(lengths) if lengths else 0.0 for lengths in expected.lengths]
    np.testing.assert_allclose(found["mean_rays"], means, rtol=1e-4)
    assert found["sphere_tests"] == pytest.approx(expected.sphere_tests, rel=1e-4)
    assert found["disc_tests"] == pytest.approx(expected.disc_tests, rel=1e-4)
    assert found["hits"] == pytest.approx(expected.hits, rel=1e-3)
    return found


@pytest.mark.parametrize("containment", CONTAINMENTS)
@pytest.mark.parametrize("order", all_but_slow(ORDERS, "hilbert"))
@pytest.mark.parametrize("ratio", [0.6, slow(0.9)])
@pytest.mark.parametrize("min_rays", [1, slow(100)])
def test_walks_as_the_reference(lines, containment, order, ratio, min_rays):
    options = {"containment": containment, "order": order, "ratio": ratio, "min_rays": min_rays}
    found = check_against_reference(lines, samples_in_ball(600, 0.06), UNIT_SPHERE, **options)
    assert sum(found["first_misses"]) > 100
    assert found["rebuilds"][0] == found["first_misses"][0] == 0


@pytest.mark.parametrize("containment", CONTAINMENTS)
@pytest.mark.parametrize("ratio", [slow(0.6), 0.9])
def test_walks_as_the_reference_in_the_sphere_around_all(lines, containment, ratio):
    options = {"containment": containment, "order": "hilbert", "ratio": ratio, "min_rays": 10}
    check_against_reference(lines, samples_in_ball(600, 0.06), None, **options)


@pytest.mark.parametrize("containment", CONTAINMENTS)
@pytest.mark.parametrize("end", ["first", "second", "bounded"])
def test_walks_as_the_reference_with_discs_of_many_sizes(containment, end):
    """Segments with a second hit, discs from 0.02 to 0.5, samples outside S_0 among them."""
    rng = np.random.default_rng(3)
    length = rng.exponential(0.5, 3000)
    segments = dl.Segments(
        rng.uniform(-1, 1, (3000, 3)),
        rng.normal(size=(3000, 3)),
        length,
        1.0,
        extended=length + rng.exponential(0.3, 3000),
    )
    samples = dl.Samples(
        rng.uniform(-1.5, 1.5, (400, 3)),
        rng.normal(size=(400, 3)),
        radius=0.02 * 25 ** rng.uniform(0, 1, 400),
    )
    options = {"containment": containment, "order": "lebesgue", "ratio": 2 / 3, "min_rays": 5}
    check_against_reference(segments, samples, ((0, 0, 0), 1.2), segment_end=end, **options)


@pytest.mark.parametrize("containment", CONTAINMENTS)
def test_statistics_do_not_depend_on_threads(lines, containment):
    rng = np.random.default_rng(4)
    samples = samples_in_ball(2000, 0.01 * 8 ** rng.uniform(0, 1, 2000))
    one, three, five = (
        dl.estimate.sphere_cache(lines, samples, min_rays=20, containment=containment, threads=n)
        for n in (1, 3, 5)
    )
    assert max(one.stats["first_misses"]) > 100
    for other in (three, five):
        np.testing.assert_array_equal(other.sums, one.sums)
        assert other.stats == one.stats


def test_only_literal_loses_hits():
    """A few per cent at Q = 0.6, more at 2/3, about half at 0.9; the exact ones equal brute force."""
    segments, samples = dl.uniform_lines(20_000, seed=8), samples_in_ball(4000, 0.03, seed=9)
    exact = dl.estimate.brute_force(segments, samples)
    lost = {}
    for ratio in (0.6, 2 / 3, 0.9):
        for containment in CONTAINMENTS:
            found = dl.estimate.sphere_cache(
                segments, samples, ratio=ratio, containment=containment, outer_sphere=UNIT_SPHERE
            )
            if containment == "literal":
                lost[ratio] = 1 - found.stats["hits"] / exact.stats["hits"]
                assert (found.sums <= exact.sums).all()
            else:
                np.testing.assert_array_equal(found.sums, exact.sums)
                assert found.stats["hits"] == exact.stats["hits"]
    assert 0.02 < lost[0.6] < 0.12
    assert lost[0.6] < lost[2 / 3] < 0.25
    assert 0.35 < lost[0.9] < 0.65


def test_first_sample_misses_nothing(lines):
    found = dl.estimate.sphere_cache(lines, samples_in_ball(1, 0.05), outer_sphere=UNIT_SPHERE)
    assert not any(found.stats["first_misses"])
    assert found.stats["rebuilds"][:3] == [0, 1, 1]
    assert found.stats["mean_rays"][0] == len(lines)


def test_coincident_samples_build_once(lines):
    same = dl.Samples([(0.2, 0.1, 0)] * 50, [(0, 1, 0)] * 50, radius=0.05)
    found = dl.estimate.sphere_cache(lines, same, min_rays=1)
    assert max(found.stats["rebuilds"]) == 1
    assert not any(found.stats["first_misses"])


def test_discs_larger_than_all_spheres(lines):
    """No sphere inside S_0 can hold them: every segment is tested, as by brute force."""
    large = samples_in_ball(20, 5.0)
    found = dl.estimate.sphere_cache(lines, large)
    assert len(found.stats["radii"]) == 1
    assert found.stats["disc_tests"] == 20 * len(lines)
    np.testing.assert_array_equal(found.sums, dl.estimate.brute_force(lines, large).sums)


def test_a_far_segment_changes_nothing_for_the_others(lines):
    """Its coordinates round coarsely, which makes the work longer but no sum wrong."""
    samples = samples_in_ball(200, 0.05)
    far = dl.Segments(
        np.vstack([lines.origin, [(1e8, 0, 0)]]),
        np.vstack([lines.direction, [(-1, 0, 0)]]),
        np.append(lines.length, np.inf),
        1.0,
    )
    expected = dl.estimate.brute_force(far, samples)
    np.testing.assert_array_equal(dl.estimate.sphere_cache(far, samples, min_rays=1).sums, expected.sums)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"ratio": 0.0}, "ratio: found 0"),
        ({"ratio": 1.0}, "ratio: found 1"),
        ({"ratio": np.nan}, "ratio: found nan"),
        ({"ratio": "wide"}, "ratio: found 'wide'"),
        ({"ratio": 1 - 1e-9}, "ratio: found .* over 10000 spheres"),
        ({"min_rays": 0}, "min_rays: found 0"),
        ({"min_rays": 2.5}, "min_rays: found 2.5"),
        ({"order": "peano"}, "order: found 'peano'"),
        ({"containment": "some"}, "containment: found 'some'"),
        ({"outer_sphere": 1.0}, "outer_sphere: found 1.0"),
        ({"outer_sphere": ((0, 0, 0), -1)}, "outer_sphere: found"),
        ({"outer_sphere": ((0, np.nan, 0), 1)}, "outer_sphere: found"),
        ({"outer_sphere": ((0, 0), 1)}, "outer_sphere: found"),
    ],
)
def test_wrong_options_are_refused(lines, options, words):
    with pytest.raises(dl.OptionError, match=words):
        dl.estimate.sphere_cache(lines, samples_in_ball(3, 0.1), **options)


def test_cancels(lines):
    with pytest.raises(dl.Cancelled):
        dl.estimate.sphere_cache(
            dl.uniform_lines(400_000), samples_in_ball(20_000, 0.01), progress=lambda stage, done: False
        )
