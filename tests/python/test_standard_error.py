# SPDX-License-Identifier: Apache-2.0
"""The standard error that a session reports, against the spread of sessions over 32 seeds."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from scenes_for_tests import furnace
from statistics_for_tests import MODES, Runs, runs

SEEDS = range(1, 33)


def reported_over_observed(found: Runs) -> float:
    """Ratio of variances, each averaged over the samples."""
    return float((found.standard_error**2).mean() / found.irradiance.var(axis=0, ddof=1).mean())


def _office() -> tuple[dl.Scene, dl.Samples]:
    """Also its movables' samples, of which the automatic radius and the area follow other rules."""
    scene = dl.scenes.office()
    every = dl.Samples.on_vertices(scene)
    chosen = np.sort(np.random.default_rng(1).choice(len(every), 2000, replace=False))
    return scene, dl.Samples(every.points[chosen], every.normals[chosen], None, every.attached[chosen])


def _furnace() -> tuple[dl.Scene, dl.Samples]:
    scene, walls = furnace()
    return scene, walls.samples(1000, seed=1)


@pytest.mark.parametrize("direct", MODES)
@pytest.mark.parametrize("scene", [_furnace, _office])
def test_standard_error_is_honest(scene, direct):
    """Null hypothesis: reported and observed variance agree; the test asks for 25 %, of a gather's error.

    Samples share few paths, so that the observed mean variance is known to some 3 %; rate below 1e-6.
    A gather's rays are spread more evenly than eight parts of them can tell.
    """
    found = runs(*scene(), SEEDS, paths=50_000, direct=direct)
    ratio = reported_over_observed(found)
    assert (np.sqrt(ratio) if direct == "gather" else ratio) == pytest.approx(1, abs=0.25)


def test_standard_error_falls_with_the_paths():
    """Four times the paths at a fixed radius: half the error, a little less for low-discrepancy numbers."""
    scene, walls = furnace()
    samples = walls.samples(500, seed=1, radius=0.1)
    few, many = (
        np.sqrt((runs(scene, samples, [1], paths=n, direct="paths").standard_error ** 2).mean())
        for n in (50_000, 200_000)
    )
    assert many / few == pytest.approx(0.5, rel=0.08)
