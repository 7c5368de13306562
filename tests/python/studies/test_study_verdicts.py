# SPDX-License-Identifier: Apache-2.0
"""Verdicts of the count experiments follow their data: made-up counts, in every outcome."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from deltalux import model
from deltalux.studies.experiments import (
    cache_misses,
    cost_scaling,
    curve_orders,
    mean_rays,
    radius_ratio,
)
from deltalux.studies.ripple import halving_period, ripple

SEEDS, NOISE = 5, 1e-3  # noise so small that every difference below is certain


def repeated(mean: Any) -> np.ndarray:
    """(seeds, n) values around a mean."""
    mean = np.asarray(mean, dtype=float)
    return mean * (1 + NOISE * np.random.default_rng(1).normal(size=(SEEDS, mean.size)))


# ---- mean-rays: (seeds, levels) percent errors, or rays from S_0 ---------------------------------


def both(mean: Any) -> mean_rays.Counts:
    return {("atrium", "on surfaces"): repeated(mean), ("expo", "on surfaces"): repeated(mean)}


def test_underestimates() -> None:
    assert mean_rays.underestimates(both([-10, -20])).outcome == "confirmed"
    assert mean_rays.underestimates(both([-10, 20])).outcome == "refuted"
    single = {key: rows[:1] for key, rows in both([-10, -20]).items()}
    assert mean_rays.underestimates(single).outcome == "open"


def test_decreases() -> None:
    assert mean_rays.decreases(both([-30, -20, -10])).outcome == "confirmed"
    mixed = both([-30, -20, -10]) | {("expo", "in the room"): repeated([-10, -20, -30])}
    assert mean_rays.decreases(mixed).outcome == "refuted"


def test_close() -> None:
    assert mean_rays.close(both([-3, 2, -20])).outcome == "confirmed"
    assert mean_rays.close(both([-30, 2, -20])).outcome == "refuted"
    assert mean_rays.close(both([-3, -5, -5, -20])).outcome == "open"
    single = {key: rows[:1] for key, rows in both([-3, 2, -20]).items()}
    assert mean_rays.close(single).outcome == "open"


def test_settles() -> None:
    def rays(steps: list[float]) -> mean_rays.Counts:
        return both(1e6 * np.cumprod([1, *(0.36 * step for step in steps)]))

    assert mean_rays.settles(rays([1.3, 1.1, 1.0]), 0.6).outcome == "confirmed"
    assert mean_rays.settles(rays([1.3, 1.2, 1.1]), 0.6).outcome == "open"
    assert mean_rays.settles(rays([1.0, 1.1, 1.2]), 0.6).outcome == "refuted"


def test_exact() -> None:
    """Null hypothesis of the first: binomial counts; `exact` errs once in a thousand, at this seed not."""
    share = 0.36 ** np.arange(6)
    rays = np.random.default_rng(2).binomial(100_000, share, (SEEDS, 6)).astype(float)
    assert mean_rays.exact(rays, 0.6).outcome == "confirmed"
    rays[3, 2] *= 1.1
    assert mean_rays.exact(rays, 0.6).outcome == "refuted"


def test_percent_error_is_of_what_was_counted() -> None:
    errors = mean_rays.percent_errors(np.array([[1000.0, 500.0, 100.0]]), 0.5)
    np.testing.assert_allclose(errors, [[100 * (250 - 500) / 500, 100 * (62.5 - 100) / 100]])


# ---- cache-misses: `stats` of each seed ----------------------------------------------------------


def runs(mean: Any, hits: float = 1000.0, **more: Any) -> list[dict[str, Any]]:
    rows = repeated([0, *mean])
    return [{"rebuilds": row, "first_misses": row, "hits": hits, **more} for row in rows]


PEAKED, MONOTONE, EARLY = [10, 20, 30, 5], [10, 20, 30, 40], [10, 50, 30, 5]


@pytest.mark.parametrize(
    ("mean", "outcome", "largest"),
    [(PEAKED, "confirmed", 3), (MONOTONE, "refuted", 4), (EARLY, "refuted", 2)],
)
def test_rises_and_falls(mean: list[int], outcome: str, largest: int) -> None:
    assert cache_misses.shape(repeated([0, *mean]), 3) == (outcome, largest)
    verdict = cache_misses.rises_and_falls({1000: runs(PEAKED), 2000: runs(mean)}, "rebuilds", 3)
    assert verdict.outcome == outcome
    assert f"2,000 samples: largest at level {largest} ({outcome})" in verdict.text
    assert cache_misses.every_rule({"all": runs(PEAKED), "literal": runs(mean)}, 3).outcome == outcome


def test_shape_needs_more_than_one_seed() -> None:
    assert cache_misses.shape(repeated([0, *PEAKED])[:1], 3) == ("open", 3)


def test_the_level_of_the_limit() -> None:
    settings = {"lines": 1024**2, "ratio": 0.6, "min_rays": 100}
    assert cache_misses.limit_level(settings) == 9
    assert cache_misses.limit_level(settings | {"min_rays": 1000}) == 7


def test_few_divided() -> None:
    settings = {"lines": 1024**2, "ratio": 0.6, "min_rays": 100}
    rays = np.full(5, 106.0)
    rare = cache_misses.few_divided({1000: runs(PEAKED, mean_rays=rays)}, 3, settings)
    often = cache_misses.few_divided({1000: runs([10, 20, 30, 21], mean_rays=rays)}, 3, settings)
    assert (rare.outcome, often.outcome) == ("confirmed", "refuted")
    assert "0.70" in often.text


def test_monotone() -> None:
    settings = {"lines": 1024**2, "ratio": 0.6}
    assert cache_misses.monotone(runs(MONOTONE), settings).outcome == "confirmed"
    assert cache_misses.monotone(runs(PEAKED), settings).outcome == "refuted"


def test_complete() -> None:
    def rules(literal: list[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
        return {"all": runs(PEAKED), "nested": runs(MONOTONE), "literal": literal}

    assert cache_misses.complete(rules(runs(PEAKED))).outcome == "confirmed"
    lossy = [run | {"hits": 900 + place} for place, run in enumerate(runs(PEAKED))]
    verdict = cache_misses.complete(rules(lossy))
    assert verdict.outcome == "refuted"
    assert "loses 9.8% of 1,000 hits; “nested” finds as many as “all”" in verdict.text
    first, *others = runs(PEAKED)  # one hit, in one run: too few to tell its mean from zero
    assert cache_misses.complete(rules([first | {"hits": 999}, *others])).outcome == "refuted"


# ---- curve-orders ----------------------------------------------------------------------------------

RATIO, LEVELS = 0.9, np.arange(3, 44)
PERIOD = halving_period(RATIO)


def wavy(amplitude: float, shift: float = 0.0) -> np.ndarray:
    """(seeds, levels from S_0) counts that rise with a ripple."""
    level = np.arange(44)
    return repeated(np.exp(0.2 * level + amplitude * np.cos(2 * np.pi * (level - shift) / PERIOD)))


def waves(counts: np.ndarray) -> list[Any]:
    return [ripple(LEVELS, row[LEVELS], PERIOD) for row in counts]


@pytest.mark.parametrize(("shift", "outcome"), [(0.2, "confirmed"), (3.0, "refuted"), (-2.0, "refuted")])
def test_dyadic(shift: float, outcome: str) -> None:
    counts = wavy(0.3, shift)
    verdict = curve_orders.dyadic(waves(counts), counts.mean(axis=0), LEVELS, PERIOD)
    assert verdict.outcome == outcome
    assert curve_orders.dyadic(waves(counts[:1]), counts[0], LEVELS, PERIOD).outcome == "open"


def test_smaller() -> None:
    large, small = waves(wavy(0.3)), waves(wavy(0.1))
    assert curve_orders.smaller({"lebesgue": large, "hilbert": small}).outcome == "confirmed"
    assert curve_orders.smaller({"lebesgue": small, "hilbert": large}).outcome == "refuted"


def test_flat_and_rising() -> None:
    assert curve_orders.flat(wavy(0.05), LEVELS).outcome == "confirmed"
    valleys = curve_orders.flat(wavy(0.6), LEVELS)
    assert valleys.outcome == "refuted"
    smooth, rough = wavy(0.05), wavy(0.6)
    assert curve_orders.only_first({"lebesgue": smooth, "hilbert": smooth}, LEVELS).outcome == "confirmed"
    assert curve_orders.only_first({"lebesgue": rough, "hilbert": smooth}, LEVELS).outcome == "refuted"
    assert curve_orders.rising(smooth[:1], LEVELS)[0] == "open"


def test_gain() -> None:
    settings = {"timed_samples": [10, 100], "timed_lines": 1000}
    noise = 1 + NOISE * np.random.default_rng(3).normal(size=(3, SEEDS))

    def costs(none: float, lebesgue: float, hilbert: float) -> curve_orders.Costs:
        return {
            order: [[(each * factor, 10), (2 * each * factor, 20)] for factor in row]
            for order, each, row in zip(
                ("none", "lebesgue", "hilbert"), (none, lebesgue, hilbert), noise, strict=True
            )
        }

    assert curve_orders.gain(costs(9, 2, 1), settings).outcome == "confirmed"
    assert curve_orders.gain(costs(1, 2, 0.5), settings).outcome == "refuted"


# ---- radius-ratio, cost-scaling --------------------------------------------------------------------

RATIOS = [0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.9]


def valley(least: float, steepness: float = 8.0) -> np.ndarray:
    return repeated(np.exp(steepness * np.square(np.array(RATIOS) - least)))


def test_located() -> None:
    for least, outcome in ((0.667, "confirmed"), (0.55, "refuted")):
        tests = valley(least)
        np.testing.assert_allclose(radius_ratio.optimum(tests, RATIOS), least, atol=0.01)
        assert radius_ratio.located(tests, RATIOS, "volume", "claim").outcome == outcome
    assert radius_ratio.located(valley(0.667)[:1], RATIOS, "volume", "claim").outcome == "open"


def test_good() -> None:
    assert radius_ratio.good(valley(0.6), RATIOS, "volume").outcome == "confirmed"
    assert radius_ratio.good(valley(0.45), RATIOS, "volume").outcome == "refuted"


def test_flat_and_deep() -> None:
    shallow: radius_ratio.Tests = {"volume": valley(0.6), "surface": valley(0.6)}
    steep: radius_ratio.Tests = {"volume": valley(0.6), "surface": valley(0.6, 50.0)}
    late: radius_ratio.Tests = {"volume": valley(0.6), "surface": valley(0.9)}
    assert radius_ratio.flat(shallow, RATIOS).outcome == "confirmed"
    assert radius_ratio.flat(steep, RATIOS).outcome == "refuted"
    assert radius_ratio.deep(shallow, RATIOS).outcome == "confirmed"
    assert radius_ratio.deep(late, RATIOS).outcome == "refuted"


COUNTS = np.array([1e3, 1e4, 1e5, 1e6])


def test_cube_root() -> None:
    for power, outcome in ((0.34, "confirmed"), (0.5, "refuted"), (0.1, "refuted")):
        tests = repeated(COUNTS**power)
        np.testing.assert_allclose(cost_scaling.exponents(tests, COUNTS), power, atol=0.002)
        assert cost_scaling.cube_root("sphere cache", tests, COUNTS).outcome == outcome


def test_constant() -> None:
    theory = model.sphere_cache_cost(COUNTS, 1)
    for factor, outcome in ((1.1, "confirmed"), (3.3, "refuted"), (0.3, "refuted")):
        verdict = cost_scaling.constant("sphere cache", repeated(factor * theory), theory)
        assert verdict.outcome == outcome


def test_logarithmic() -> None:
    assert cost_scaling.logarithmic(repeated(np.log(COUNTS)), COUNTS).outcome == "confirmed"
    assert cost_scaling.logarithmic(repeated(np.cbrt(COUNTS)), COUNTS).outcome == "refuted"
