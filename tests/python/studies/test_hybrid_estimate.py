# SPDX-License-Identifier: Apache-2.0
"""The hybrid estimate of section 4.1: exact where it measures, near the counts where theory goes on."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.planning import hybrid_estimate

SIDE = 2 / np.sqrt(3)  # of the cube in the unit sphere
UNIT_SPHERE = ((0, 0, 0), 1.0)
ALL_LEVELS = 100


def samples_in_cube(count, seed=3):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-SIDE / 2, SIDE / 2, (count, 3))
    return dl.Samples(points, rng.normal(size=(count, 3)), radius=SIDE / count ** (1 / 3))


@pytest.fixture(scope="module")
def lines():
    return dl.uniform_lines(200_000, seed=4)


@pytest.mark.parametrize("outer_sphere", [None, UNIT_SPHERE])
@pytest.mark.parametrize("min_rays", [1, 100])
def test_measuring_everything_counts_what_the_cache_counts(lines, outer_sphere, min_rays):
    samples = samples_in_cube(500)
    found = hybrid_estimate(lines, samples, 0.6, min_rays, ALL_LEVELS, divisor=1, outer_sphere=outer_sphere)
    full = dl.estimate.sphere_cache(lines, samples, 0.6, min_rays, outer_sphere=outer_sphere).stats
    assert found.measured.all()
    np.testing.assert_allclose(found.radii, full["radii"], rtol=1e-12)
    assert found.rebuilds.tolist() == full["rebuilds"]
    assert found.level_tests.tolist() == full["level_tests"]
    np.testing.assert_allclose(found.rays, full["mean_rays"])
    assert found.sphere_tests == full["sphere_tests"] == found.pilot_sphere_tests


@pytest.mark.parametrize("min_rays", [1, 100, 1000])
def test_upper_levels_and_a_hundredth_of_the_lines_predict_the_counts(lines, min_rays):
    """Sphere and disc tests within 20 %: the bound is that of theory below the fourth level."""
    samples = samples_in_cube(10_000)
    full = dl.estimate.sphere_cache(lines, samples, 2 / 3, min_rays, outer_sphere=UNIT_SPHERE).stats
    found = hybrid_estimate(lines, samples, 2 / 3, min_rays, 4, outer_sphere=UNIT_SPHERE)
    assert found.measured.tolist() == [True] * 5 + [False] * (len(found.radii) - 5)
    # Where spheres stand follows from the samples alone: the upper rebuilds are no estimates.
    assert found.rebuilds[:5].tolist() == full["rebuilds"][:5]
    assert found.sphere_tests == pytest.approx(full["sphere_tests"], rel=0.2)
    assert found.disc_tests == pytest.approx(full["disc_tests"], rel=0.2)
    assert found.pilot_sphere_tests < 0.01 * full["sphere_tests"]


def test_surfaces_have_fewer_rebuilds_than_volumes(lines):
    samples = samples_in_cube(2000)
    volume, surface = (
        hybrid_estimate(lines, samples, upper_levels=3, outer_sphere=UNIT_SPHERE, spread=spread)
        for spread in ("volume", "surface")
    )
    assert surface.rebuilds[3] == volume.rebuilds[3]
    assert surface.rebuilds[4] == pytest.approx(volume.rebuilds[4] * 2 / 3, rel=1e-9)


def test_discs_of_many_sizes_reach_different_depths(lines):
    rng = np.random.default_rng(6)
    samples = samples_in_cube(2000)
    mixed = dl.Samples(samples.points, samples.normals, 0.05 * 40 ** rng.uniform(0, 1, 2000))
    assert mixed.radius.max() > 1  # some are larger than S_0
    full = dl.estimate.sphere_cache(lines, mixed, min_rays=1, outer_sphere=UNIT_SPHERE).stats
    found = hybrid_estimate(lines, mixed, min_rays=1, upper_levels=4, outer_sphere=UNIT_SPHERE)
    assert found.disc_tests == pytest.approx(full["disc_tests"], rel=0.05)


def test_does_not_depend_on_threads(lines):
    one, two = (hybrid_estimate(lines, samples_in_cube(3000), threads=n) for n in (1, 2))
    assert one.level_tests.tolist() == two.level_tests.tolist()
    assert one.disc_tests == two.disc_tests


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"divisor": 0}, "divisor: found 0"),
        ({"divisor": 200_001}, "divisor: found 200001, expected at most the 200000 segments"),
        ({"upper_levels": 0}, "upper_levels: found 0"),
        ({"spread": "line"}, "spread: found 'line'"),
        ({"ratio": 1.0}, "ratio: found 1"),
        ({"min_rays": 0}, "min_rays: found 0"),
    ],
)
def test_wrong_options_are_refused(lines, options, words):
    with pytest.raises(dl.OptionError, match=words):
        hybrid_estimate(lines, samples_in_cube(3), **options)
