# SPDX-License-Identifier: Apache-2.0
"""Verdicts of the experiments on frames, errors and predictions: made-up data, in every outcome."""

from __future__ import annotations

import numpy as np
import pytest
from deltalux.studies.experiments import amortisation, hybrid_estimate, incremental, variance
from deltalux.studies.repeated_bakes import RepeatedBakes, enough_seeds
from deltalux.studies.series import Series
from deltalux.studies.timing import Timing


def test_index_pays_after_its_build_over_what_it_saves():
    frames, error = amortisation.index_frames({"build": Timing(2.0, 0.2), "saved": Timing(0.1, 0.01)})
    assert frames == pytest.approx(20)
    assert error == pytest.approx(20 * np.hypot(0.1, 0.1))
    assert amortisation.index_frames({"build": Timing(2.0), "saved": Timing(0.01, 0.01)})[0] == np.inf
    assert amortisation.index_frames({"build": Timing(2.0), "saved": Timing(-0.1)})[0] == np.inf


def test_stored_paths_pay():
    times = {"full frame": Timing(3.0), "trace": Timing(1.0), "update": Timing(0.1)}
    assert amortisation.stored_frames(times) == 1 + np.ceil(2 / 0.9)
    assert amortisation.stored_frames(times | {"update": Timing(1.1)}) == np.inf


@pytest.mark.parametrize(("frames", "outcome"), [(150, "confirmed"), (1.2, "refuted"), (np.inf, "refuted")])
def test_amortisation_small(frames, outcome):
    assert amortisation.small_verdict((frames, 1.0)).outcome == outcome


@pytest.mark.parametrize(("large", "outcome"), [(7000, "confirmed"), (np.inf, "confirmed"), (500, "refuted")])
def test_amortisation_growth(large, outcome):
    frames = np.array([[180.0, 300.0], [400.0, large]])
    assert amortisation.growth_verdict(frames).outcome == outcome


def test_amortisation_stored():
    assert amortisation.stored_verdict([10, 100], np.array([3.0, 2.0])).outcome == "confirmed"
    assert amortisation.stored_verdict([10, 100], np.array([3.0, np.inf])).outcome == "open"


SIZES = np.array([0.01, 0.03, 0.1])


def test_incremental_verdicts():
    assert incremental.exact_verdict([True, True]).outcome == "confirmed"
    assert incremental.exact_verdict([True, False]).outcome == "refuted"
    assert incremental.law_verdict(SIZES, list(1.5 * SIZES**2)).outcome == "confirmed"
    assert incremental.law_verdict(SIZES, list(SIZES)).outcome == "refuted"
    fast, slow = Timing(1.0, 0.1), Timing(5.0, 0.1)
    assert incremental.faster_verdict([fast, fast], [slow, slow]).outcome == "confirmed"
    assert incremental.faster_verdict([fast, slow], [slow, fast]).outcome == "refuted"
    assert incremental.faster_verdict([fast], [Timing(1.1, 0.2)]).outcome == "open"
    alone = np.array([[0.01, 0.012], [0.02, 0.022]])
    assert incremental.sum_verdict(np.array([1.0, 2.0]), alone, alone).outcome == "confirmed"
    assert incremental.sum_verdict(np.array([1.0, 2.0]), 0.8 * alone, alone).outcome == "refuted"


PATHS = np.array([1e3, 1e4, 1e5])


def test_slope():
    assert variance.slope_verdict("paths", -0.5, PATHS, list(PATHS**-0.48)).outcome == "confirmed"
    assert variance.slope_verdict("paths", -0.5, PATHS, list(PATHS**-0.3)).outcome == "refuted"


def test_prediction():
    assert variance.prediction_verdict("It", [(1.05, 0.02), (0.95, 0.02)]).outcome == "confirmed"
    assert variance.prediction_verdict("It", [(1.05, 0.02), (1.5, 0.02)]).outcome == "refuted"
    assert variance.prediction_verdict("It", [(1.05, 0.02), (1.2, 0.1)]).outcome == "open"


RADII = np.array([0.1, 0.2, 0.35, 0.8])


def test_bias():
    exact = variance.disc_bias(RADII)
    error = np.full(len(RADII), 1e-4)
    for shift, outcome in ((1e-4, "confirmed"), (1e-3, "refuted")):
        assert variance.bias_verdict(RADII, Series("", "1", exact + shift, error), exact).outcome == outcome
    assert variance.bias_verdict(RADII, Series("", "1", exact), exact).outcome == "open"
    assert variance.quadratic_verdict(RADII, Series("", "1", exact, error)).outcome == "confirmed"
    assert variance.quadratic_verdict(RADII, Series("", "1", 1.5 * exact, error)).outcome == "refuted"
    assert variance.quadratic_verdict(RADII, Series("", "1", exact, error + 1)).outcome == "open"


def test_bias_under_a_bulb_is_the_mean_over_the_disc():
    """The closed form against a sum over rings of equal area."""
    for radius in RADII:
        rings = radius * np.sqrt((np.arange(20_000) + 0.5) / 20_000)
        mean = (1 + rings**2) ** -1.5
        assert variance.disc_bias(np.array(radius)) == pytest.approx(mean.mean() - 1, rel=1e-6)


def test_repeated_bakes_know_their_spread():
    """Null hypothesis: normal values of spread 0.2 about 1; errors are those of a sample variance."""
    rng = np.random.default_rng(1)
    count, samples = 40, 200
    values = 1 + 0.2 * rng.normal(size=(count, samples))
    right = np.full(values.shape, 0.2)
    bakes = RepeatedBakes(values, right, 1.5 * right, Timing(1.0))
    assert bakes.error() == pytest.approx(0.2, rel=0.02)  # 4 standard errors of 0.8 % would be 3 %
    ratio, error = bakes.ratio("reported")
    expected = np.sqrt(2 / (count - 1) / samples)
    assert error == pytest.approx(expected, rel=0.5)
    assert abs(ratio - 1) < 4.5 * expected
    assert bakes.ratio("poisson")[0] == pytest.approx(2.25 * ratio)
    assert bakes.error_of_error() == pytest.approx(0.2 * expected / 2, rel=0.5)


def test_a_spread_needs_three_seeds():
    assert enough_seeds([4]) == [4, 5, 6]
    assert enough_seeds([9, 2]) == [9, 2, 10]
    assert enough_seeds([1, 2, 3, 4]) == [1, 2, 3, 4]


def rows(*values: float) -> list[list[float]]:
    return [[*values], [*values]]


def test_hybrid_theory():
    levels, depth = [1, 2, 4, 8], {"x": 8}
    good = {"x": rows(30.0, 10.0, 3.0, 0.0)}
    assert hybrid_estimate.theory_verdict(levels, depth, good).outcome == "confirmed"
    assert hybrid_estimate.theory_verdict(levels, {"x": 6}, good).outcome == "refuted"
    assert hybrid_estimate.more_verdict(levels, good).outcome == "confirmed"
    bump = {"x": rows(30.0, 1.0, 12.0, 0.0)}
    assert hybrid_estimate.more_verdict(levels, good | {"y": bump["x"]}).outcome == "refuted"
    unsure = {"x": [[3.0, 1.0, 0.5], [3.0, 1.0, 1.9], [3.0, 1.0, 0.9]]}
    assert hybrid_estimate.more_verdict(levels[:3], unsure).outcome == "open"


def test_hybrid_few_rays():
    every, near, far = ({"x": rows(*values)} for values in ((30.0, 0.1), (28.0, 0.2), (12.0, 3.0)))
    assert hybrid_estimate.few_verdict(100, every, near).outcome == "confirmed"
    assert hybrid_estimate.few_verdict(100, every, far).outcome == "refuted"
    assert hybrid_estimate.whole_verdict(100, near, near, near).outcome == "confirmed"
    assert hybrid_estimate.whole_verdict(100, near, far, near).outcome == "refuted"
