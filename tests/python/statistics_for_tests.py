# SPDX-License-Identifier: Apache-2.0
"""Hypothesis tests of estimates: sessions of several seeds against an exact irradiance.

The false-alarm rate of a test is the probability that it fails although the null hypothesis holds. Seeds are
fixed, so a test that passes always passes; the rate says what a failure after a change of the random numbers
means.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import deltalux as dl
import numpy as np
import pytest
from scipy import stats
from thoroughness import slow

# Of paths and samples: with fewer the standard errors are larger, the false-alarm rates are the same.
BY_SIZE = pytest.mark.parametrize("size", [0.2, slow(1.0)], ids=["small", "whole"])

BATCHES_FREEDOM = 7  # a standard error from 8 batches of paths
FALSE_ALARM = 1e-3


@dataclass(frozen=True)
class Runs:
    """Results of sessions that differ in their seed, each (runs, samples, 3)."""

    irradiance: np.ndarray
    standard_error: np.ndarray

    def at(self, which: np.ndarray) -> Runs:
        """Some of the samples."""
        return Runs(self.irradiance[:, which], self.standard_error[:, which])

    @property
    def mean(self) -> np.ndarray:
        return self.irradiance.mean(axis=0)


# Of light: all of it by discs; direct light by shadow rays; what is reflected by a final gather, too.
MODES = ("paths", "sampled", "gather")


def bake(scene: dl.Scene, samples: dl.Samples, **options) -> dl.Session:
    """A baked session; `direct` may be any of MODES."""
    gather: str | int = "off"
    if options.get("direct") == "gather":
        options, gather = {**options, "direct": "sampled"}, 128
    session = dl.Session(scene, samples, threads=1, gather=gather, **options)
    session.bake()
    return session


def runs(
    scene: dl.Scene, samples: dl.Samples | Callable[[int], dl.Samples], seeds: Sequence[int], **options
) -> Runs:
    """Bakes with each of `seeds`; `samples` may be a function of the seed."""
    found = []
    for seed in seeds:
        own = samples(seed) if callable(samples) else samples
        session = bake(scene, own, seed=seed, **options)
        found.append((session.irradiance, session.standard_error))
    return Runs(*(np.stack(x) for x in zip(*found, strict=True)))


def assert_each_sample(found: Runs, expected: np.ndarray, false_alarm: float = FALSE_ALARM) -> None:
    """Null hypothesis: every sample's expectation is `expected` (n,), for the first channel.

    The statistic is the mean over the runs against the sessions' own standard errors: Student's t with
    7 degrees of freedom a run. Šidák's correction keeps the rate for all samples together.
    """
    count, samples, _ = found.irradiance.shape
    error = np.sqrt((found.standard_error[..., 0] ** 2).mean(axis=0) / count)
    deviation = np.abs(found.mean[:, 0] - expected)
    certain = error == 0
    assert (deviation[certain] <= 1e-6 * np.abs(expected[certain])).all()
    t = deviation[~certain] / error[~certain]
    allowed = stats.t.isf((1 - (1 - false_alarm) ** (1 / samples)) / 2, BATCHES_FREEDOM * count)
    worst = np.argmax(t)
    assert t[worst] < allowed, (
        f"sample {np.flatnonzero(~certain)[worst]}: {t[worst]:.2f} standard errors off, allowed {allowed:.2f}"
    )


def assert_mean(found: Runs, expected: float | np.ndarray) -> None:
    """Null hypothesis: the mean over the samples has the expectation mean(expected).

    The runs' means are independent (the samples of a run are not: they share its paths), so their own
    spread tells the standard error. Four of those are allowed: with 16 runs, Student's t with 15 degrees
    of freedom, a false-alarm rate of 1.2e-3.
    """
    means = found.irradiance[..., 0].mean(axis=1) - np.mean(expected)
    error = means.std(ddof=1) / np.sqrt(len(means))
    assert len(means) >= 16
    assert abs(means.mean()) < 4 * error, (
        f"mean {means.mean():+.3e} off {np.mean(expected):.4f}, {means.mean() / error:+.2f} standard errors"
    )
