# SPDX-License-Identifier: Apache-2.0
"""The standard error that a session reports, against the spread of sessions over 16 to 32 seeds."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.report import claimed_error
from deltalux.units import photopic
from lit_scenes import pools_and_sconce
from oracles import world
from scenes_for_tests import furnace
from scipy import stats
from statistics_for_tests import MODES, Runs, runs
from thoroughness import examples, slow

SEEDS = range(1, 1 + max(16, examples(32)))


def reported_over_observed(found: Runs) -> float:
    """Ratio of variances, each averaged over the samples."""
    return float((found.standard_error**2).mean() / found.irradiance.var(axis=0, ddof=1).mean())


def _small_furnace() -> tuple[dl.Scene, dl.Samples]:
    scene, walls = furnace()
    return scene, walls.samples(250, seed=1)


def _office() -> tuple[dl.Scene, dl.Samples]:
    """Also its movables' samples, of which the automatic radius and the area follow other rules."""
    scene = dl.scenes.office()
    every = dl.Samples.on_vertices(scene)
    chosen = np.sort(np.random.default_rng(1).choice(len(every), 1000, replace=False))
    return scene, dl.Samples(every.points[chosen], every.normals[chosen], None, every.attached[chosen])


def _furnace() -> tuple[dl.Scene, dl.Samples]:
    scene, walls = furnace()
    return scene, walls.samples(1000, seed=1)


@pytest.mark.parametrize("direct", MODES)
@pytest.mark.parametrize("scene", [_small_furnace, slow(_furnace), slow(_office)])
def test_standard_error_is_honest(scene, direct):
    """Null hypothesis: reported and observed variance agree; the test asks for 25 %, of a gather's error.

    Samples share few paths, so that the observed mean variance of 1,000 is known to some 4 %, and that of
    250 to some 5 %; rate below 1e-6.
    """
    found = runs(*scene(), SEEDS, paths=50_000, direct=direct)
    ratio = reported_over_observed(found)
    assert (np.sqrt(ratio) if direct == "gather" else ratio) == pytest.approx(1, abs=0.25)
    if direct == "gather":
        assert_student(found)
        assert_tail(found)


def assert_tail(found: Runs) -> None:
    """The 90th percentile over the samples, as summaries claim it, against that of the true errors."""
    area = np.ones(found.irradiance.shape[1])
    own = zip(found.irradiance, found.standard_error, strict=True)
    claimed = np.mean([claimed_error(light, error, area).p90 for light, error in own])
    spread = photopic(found.irradiance).std(axis=0, ddof=1)
    true = claimed_error(found.mean, np.repeat(spread[:, None], 3, axis=1), area).p90
    assert claimed == pytest.approx(true, rel=0.25)


def assert_student(found: Runs) -> None:
    """Null hypothesis: deviations by their own errors are Student's t with 7 degrees of freedom.

    Within a quarter at each quantile, of some 10,000 deviations, or 4,000: quantiles are known to 3 or 5 %.
    """
    lit = found.mean > 0.02 * found.mean.mean()
    deviation = np.abs(found.irradiance - found.mean)[:, lit] / found.standard_error[:, lit]
    count = len(found.irradiance)
    quantiles = np.quantile(deviation * np.sqrt(count / (count - 1)), [0.5, 0.9])
    np.testing.assert_allclose(quantiles, stats.t.ppf([0.75, 0.95], 7), rtol=0.25)


@pytest.mark.slow
def test_standard_error_is_honest_where_rays_are_guided():
    """As above, in a room of narrow spots and a strip lamp behind a shade.

    Each sample by its own mean: two behind the shade, a hundred times as bright, would be all that counts.
    """
    scene = pools_and_sconce()
    samples = dl.Samples(*world.area_points(scene, 1000, seed=5))
    found = runs(scene, samples, range(1, 33), paths=50_000, direct="gather")  # 16 know it to 30 %
    bright = found.mean.mean(axis=1)[:, None]
    relative = Runs(found.irradiance / bright, found.standard_error / bright)
    assert np.sqrt(reported_over_observed(relative)) == pytest.approx(1, abs=0.25)
    assert_student(found)
    assert_tail(found)


def test_standard_error_falls_with_the_paths():
    """Four times the paths at a fixed radius: half the error, a little less for low-discrepancy numbers."""
    scene, walls = furnace()
    samples = walls.samples(500, seed=1, radius=0.1)
    few, many = (
        np.sqrt((runs(scene, samples, [1], paths=n, direct="paths").standard_error ** 2).mean())
        for n in (50_000, 200_000)
    )
    assert many / few == pytest.approx(0.5, rel=0.08)
