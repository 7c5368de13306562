# SPDX-License-Identifier: Apache-2.0
"""`radius-ratio`: tests of the sphere cache over Q, samples in a volume and on surfaces (Proposition 1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from deltalux import estimate, model
from deltalux.segments import Progress, uniform_lines
from deltalux.studies.experiment import (
    Cell,
    Curve,
    Experiment,
    Figure,
    Findings,
    Mark,
    Table,
    Verdict,
)
from deltalux.studies.progress_parts import Steps
from deltalux.studies.repeats import (
    FALSE_ALARMS,
    averaged,
    certain_sign,
    mean_and_error,
    outcome_of,
    together,
)
from deltalux.studies.uniform_samples import SPREADS, UNIT_SPHERE, WHERE, Spread, in_cube

BEST = {"volume": float(model.best_ratio()), "surface": float(model.best_ratio("surface"))}
FORMULAS = {"volume": "Proposition 1: 2/3", "surface": "surfaces: $e^{-1/2}$"}
NEAR = 0.03  # largest accepted deviation of Q
ALIKE = 0.05  # costs that exceed the least by a smaller share are called as good
FLAT, PLATEAU = 0.15, (0.5, 0.7)
FITTED = (0.45, 0.8)  # range of Q in which a parabola fits the logarithm of the costs
DEEP, MANY = 0.9, 1_000_000

Tests = Mapping[Spread, np.ndarray]  # spread -> (seeds, ratios) sphere and disc tests per line


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Count tests at each Q with each seed, and average them over a few numbers of samples."""
    ratios, seeds, sizes = settings["ratios"], settings["seeds"], settings["sample_counts"]
    steps = Steps(progress, len(seeds) * len(SPREADS) * len(sizes) * len(ratios))
    tests = {spread: np.zeros((len(seeds), len(ratios))) for spread in SPREADS}
    for row, seed in enumerate(seeds):
        lines = uniform_lines(settings["lines"], seed)
        for spread, size in product(SPREADS, sizes):
            samples = in_cube(size, spread, seed)
            for column, ratio in enumerate(ratios):
                stats = estimate.sphere_cache(
                    lines,
                    samples,
                    ratio,
                    settings["min_rays"],
                    outer_sphere=UNIT_SPHERE,
                    threads=settings["threads"],
                ).stats
                counted = stats["sphere_tests"] + stats["disc_tests"]
                tests[spread][row, column] += counted / (len(lines) * len(sizes))
                steps.done()
    return conclude(tests, settings)


def conclude(tests: Tests, settings: Mapping[str, Any]) -> Findings:
    """Make table, figures and verdicts from the counts.

    Parameters
    ----------
    tests : "volume" and "surface" -> (seeds, ratios) sphere and disc tests per line
    settings : settings of `run`
    """
    ratios = settings["ratios"]
    return Findings(
        tables=[_table(tests, settings)],
        figures=[_figure(spread, tests[spread], settings) for spread in SPREADS],
        verdicts=[
            located(tests["volume"], ratios, "volume", "The optimal Q is 2/3 (paper, Proposition 1)."),
            located(
                tests["surface"],
                ratios,
                "surface",
                "For samples on surfaces the optimal Q is e^(-1/2) = 0.607 (cost model, beyond the paper).",
            ),
            *(good(tests[spread], ratios, spread) for spread in SPREADS),
            flat(tests, ratios),
            deep(tests, ratios),
        ],
        notes=(
            "Counts jump where one more sphere fits above the disc; the mean over a few numbers of samples, "
            "which reach from one such jump to the next, smooths them.",
            "Counted by the exact sphere cache in Hilbert order; sphere and disc tests count alike, t = u. "
            "Samples lie in or on the cube of eq. 4, whose corners touch the unit sphere of the lines; discs "
            "are as large as the samples' distance.",
        ),
    )


def optimum(tests: np.ndarray, ratios: Sequence[float]) -> np.ndarray:
    """(seeds,) Q at the minimum of a parabola fitted to the logarithm of the tests.

    The least count itself would depend on the jumps that the notes of `conclude` describe.
    """
    low, high = FITTED
    ratio = np.array(ratios)
    near = (ratio >= low) & (ratio <= high)
    square, slope, _ = np.polyfit(ratio[near], np.log(tests[:, near]).T, 2)
    return -slope / (2 * square)


def located(tests: np.ndarray, ratios: Sequence[float], spread: Spread, claim: str) -> Verdict:
    """Whether the counted optimum lies within `NEAR` of a formula's."""
    places = optimum(tests, ratios)
    (place,), error = mean_and_error(places[:, None])
    distance = np.abs(places - BEST[spread]) - NEAR
    sign = certain_sign(distance)
    within = f"± {error[0]:.3f} (standard error)" if error else "(one seed)"
    return Verdict(
        claim,
        outcome_of(sign, wanted=-1),
        f"A parabola through the logarithms of the counts at Q from {FITTED[0]:g} to {FITTED[1]:g} is least "
        f"at {place:.3f} {within}; confirmed within {NEAR:g} of {BEST[spread]:.3f}.",
    )


def good(tests: np.ndarray, ratios: Sequence[float], spread: Spread) -> Verdict:
    """Whether the predicted Q costs about as little as the best."""
    over = _at(tests, ratios, BEST[spread]) / tests.min(axis=1)
    sign = certain_sign(over - 1 - ALIKE)
    least = ratios[int(tests.mean(axis=0).argmin())]
    return Verdict(
        f"The predicted Q = {BEST[spread]:.3f} costs at most {ALIKE:.0%} more than the best one, samples "
        f"{WHERE[spread]}.",
        outcome_of(sign, wanted=-1),
        f"{over.mean():.3f} times the fewest tests, which are counted at Q = {least:g} (t-test over seeds, "
        f"false-alarm rate {FALSE_ALARMS:g}).",
    )


def flat(tests: Tests, ratios: Sequence[float]) -> Verdict:
    """Whether costs between 0.5 and 0.7 are alike."""
    low, high = PLATEAU
    inside = [i for i, ratio in enumerate(ratios) if low <= ratio <= high]
    spans = {
        spread: each[:, inside].max(axis=1) / each[:, inside].min(axis=1) for spread, each in tests.items()
    }
    outcomes = [outcome_of(certain_sign(span - 1 - FLAT), wanted=-1) for span in spans.values()]
    return Verdict(
        f"The optimum is flat: Q from {low:g} to {high:g} costs the same within {FLAT:.0%} (beyond "
        "the paper).",
        together(outcomes),
        "Dearest over cheapest in that range: "
        + ", ".join(f"{spread} {span.mean():.3f}" for spread, span in spans.items())
        + ".",
    )


def deep(tests: Tests, ratios: Sequence[float]) -> Verdict:
    """Whether Q = 0.9, of the paper's Figure 10, is expensive."""
    extra = {spread: _at(each, ratios, DEEP) / each.min(axis=1) for spread, each in tests.items()}
    predicted = {
        spread: float(_predicted(spread, DEEP, (MANY,)) / _predicted(spread, BEST[spread], (MANY,)))
        for spread in tests
    }
    outcomes = [outcome_of(certain_sign(each - 1 - FLAT), wanted=1) for each in extra.values()]
    return Verdict(
        f"Q = {DEEP:g}, as in Figure 10, costs more than the optimum (paper, Proposition 1).",
        together(outcomes),
        "Tests at 0.9 over the fewest: "
        + ", ".join(
            f"{spread} {each.mean():.2f} (theory, many samples: {predicted[spread]:.2f})"
            for spread, each in extra.items()
        )
        + ".",
    )


def _predicted(spread: Spread, ratio: ArrayLike, sizes: Sequence[int]) -> np.ndarray:
    """Tests per line of eq. 1, corrected, or of its counterpart on surfaces; mean over sample counts."""
    cost = model.sphere_cache_cost if spread == "volume" else model.surface_cache_cost
    return np.mean([cost(size, 1, ratio) for size in sizes], axis=0)


def _at(tests: np.ndarray, ratios: Sequence[float], ratio: float) -> np.ndarray:
    """(seeds,) tests at the Q nearest to `ratio`."""
    return tests[:, int(np.abs(np.array(ratios) - ratio).argmin())]


def _table(tests: Tests, settings: Mapping[str, Any]) -> Table:
    rows: list[list[Cell]] = []
    for spread, each in tests.items():
        mean, error = mean_and_error(each)
        predicted = _predicted(spread, settings["ratios"], settings["sample_counts"])
        for column, ratio in enumerate(settings["ratios"]):
            spread_error = None if error is None else error[column]
            rows.append([spread, ratio, mean[column], spread_error, float(predicted[column])])
    columns = ("samples", "Q", "tests per line", "s.e. of tests per line", "theory")
    return Table("radius_ratio", columns, rows)


def _figure(spread: Spread, tests: np.ndarray, settings: Mapping[str, Any]) -> Figure:
    ratios = settings["ratios"]
    mean, error = mean_and_error(tests)
    fine = np.linspace(ratios[0], ratios[-1], 100)
    theory = _predicted(spread, fine, settings["sample_counts"])
    scaled = theory * min(mean) / theory.min()
    sizes = " and ".join(f"{size:,}" for size in settings["sample_counts"])
    return Figure(
        f"radius_ratio_{spread}",
        f"Sphere and disc tests per line over the ratio Q of the radii; mean over {sizes} samples "
        f"{WHERE[spread]}, {settings['lines']:,} uniform lines, "
        f"lists below {settings['min_rays']} rays are not subdivided. {averaged(settings)}",
        "ratio $Q$ of the radii of consecutive spheres",
        "tests per line",
        [
            Curve("counted", ratios, mean, error),
            Curve("theory", fine.tolist(), theory.tolist(), None, "theory"),
            Curve("theory, scaled to the counted minimum", fine.tolist(), scaled.tolist(), None, "theory"),
        ],
        marks=[Mark(BEST[spread], FORMULAS[spread])],
        log_y=True,
    )


EXPERIMENT = Experiment(
    name="radius-ratio",
    title="The ratio of the radii of the spheres",
    source="paper 3.1, Proposition 1",
    question="Which ratio Q of consecutive spheres makes the sphere cache cheapest, and how much does "
    "another one cost?",
    run=run,
    full={
        "seeds": [1, 2, 3, 4, 5, 6],
        "lines": 512**2,
        "sample_counts": [5_000, 7_000, 10_000, 14_000],
        "ratios": [0.4, 0.45, 0.5, 0.55, 0.607, 0.667, 0.7, 0.75, 0.8, 0.85, 0.9],
        "min_rays": 1,  # full depth, as the formulas assume
    },
    quick={
        "seeds": [1, 2],
        "lines": 3_000,
        "sample_counts": [2_000],
        "ratios": [0.4, 0.5, 0.6, 0.667, 0.7, 0.8, 0.9],
    },
)
