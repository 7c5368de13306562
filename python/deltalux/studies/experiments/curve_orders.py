# SPDX-License-Identifier: Apache-2.0
"""`curve-orders`: misses of each level in Lebesgue and Hilbert order; what sorting gains (paper 4.2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from deltalux import estimate, model
from deltalux.segments import Progress, Segments, uniform_lines
from deltalux.studies.experiment import Curve, Experiment, Figure, Findings, Mark, Outcome, Table, Verdict
from deltalux.studies.level_counts import DEFINITIONS, LEVEL_COLUMNS, level_curve, level_rows, stacked
from deltalux.studies.measuring import Measured, measured
from deltalux.studies.progress_parts import Steps
from deltalux.studies.repeats import (
    FALSE_ALARMS,
    averaged,
    certain_sign,
    mean_and_error,
    outcome_of,
    together,
)
from deltalux.studies.ripple import Ripple, halving_period, peaks, ripple
from deltalux.studies.seeds import Done, by_seed
from deltalux.studies.uniform_samples import UNIT_SPHERE, in_sphere

ORDERS = ("lebesgue", "hilbert")
NEAR = 1.0  # levels; largest accepted distance of a peak from its predicted place
FIRST = 3  # levels nearer to S_0 have too few misses for a curve
NEARLY_ALL = 0.999

Runs = Mapping[str, list[Mapping[str, Any]]]  # order -> `stats` of each seed
Cost = tuple[float, int]  # CPU seconds, tests
Costs = Mapping[str, list[list[Cost]]]  # order -> per seed and sample count


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Count under both orders with each seed, then time sorted against unsorted samples."""
    steps = Steps(progress, len(settings["seeds"]) * (len(ORDERS) + 1))

    def of_seed(seed: int, done: Done) -> tuple[dict[str, Mapping[str, Any]], dict[str, list[Cost]]]:
        lines = uniform_lines(settings["lines"], seed)
        counts = {}
        for order in ORDERS:
            counts[order] = _count(lines, settings["samples"], order, seed, settings).value
            done()
        few = lines.select(np.arange(min(settings["timed_lines"], len(lines))))
        costs: dict[str, list[Cost]] = {order: [] for order in ("none", *ORDERS)}
        for samples in settings["timed_samples"]:
            for order, own in costs.items():
                ran = _count(few, samples, order, seed, settings)
                own.append((ran.cpu_seconds, ran.value["sphere_tests"] + ran.value["disc_tests"]))
        done()
        return counts, costs

    found = by_seed(of_seed, settings["seeds"], steps)
    runs = {order: [counts[order] for counts, _ in found] for order in ORDERS}
    all_costs = {order: [costs[order] for _, costs in found] for order in ("none", *ORDERS)}
    return conclude(runs, all_costs, settings)


def conclude(runs: Runs, costs: Costs, settings: Mapping[str, Any]) -> Findings:
    """Make tables, figures and verdicts from the counts.

    Parameters
    ----------
    runs : order -> `stats` of each seed
    costs : order, "none" among them -> per seed and sample count, processor seconds and tests
    settings : settings of `run`
    """
    misses = {order: stacked(each, "first_misses") for order, each in runs.items()}
    levels, period = counted_levels(settings), halving_period(settings["ratio"])
    waves = {
        order: [ripple(levels, row[levels], period) for row in counts] for order, counts in misses.items()
    }
    return Findings(
        tables=[
            Table(
                "curve_orders",
                ("order", *LEVEL_COLUMNS),
                [[order, *row] for order, each in runs.items() for row in level_rows(each)],
            ),
            Table(
                "sorting_gain",
                ("order", "seed", "samples", "CPU time [s]", "sphere and disc tests"),
                [
                    [order, seed, samples, *cost]
                    for order, rows in costs.items()
                    for seed, row in zip(settings["seeds"], rows, strict=True)
                    for samples, cost in zip(settings["timed_samples"], row, strict=True)
                ],
            ),
        ],
        figures=[
            *(_level_figure(name, runs, settings) for name in DEFINITIONS),
            _time_figure(costs, settings),
        ],
        verdicts=[
            dyadic(waves["lebesgue"], misses["lebesgue"].mean(axis=0), levels, period),
            smaller(waves),
            flat(misses["hilbert"], levels),
            only_first({order: stacked(each, "rebuilds") for order, each in runs.items()}, levels),
            gain(costs, settings),
        ],
        notes=(
            "The paper states neither the number of samples nor the discs of its Figure 10, nor what it "
            "counts as a miss; both definitions are shown. Discs are so small that only the limit of rays "
            "ends a chain of spheres.",
        ),
    )


def counted_levels(settings: Mapping[str, Any]) -> np.ndarray:
    """Levels from `FIRST` to the last one whose enclosing spheres are nearly all subdivided."""
    levels = np.arange(FIRST, 1000)
    share = model.divided_share(settings["lines"], settings["ratio"], levels - 1, settings["min_rays"])
    return levels[share > NEARLY_ALL]


def dyadic(waves: list[Ripple], mean: np.ndarray, levels: np.ndarray, period: float) -> Verdict:
    """Whether the peaks of the Lebesgue order lie where the radius is r_0 / 2^k."""
    (offset,), error = mean_and_error([[wave.offset] for wave in waves])
    margin = 2 * error[0] if error else np.inf
    near, far = abs(offset) + margin < NEAR, abs(offset) - margin > NEAR
    outcome: Outcome = "confirmed" if near else "refuted" if far else "open"
    wanted = np.arange(1, int(levels[-1] / period) + 1) * period
    return Verdict(
        "Under Lebesgue order the maxima lie at spheres of 2^-k of the scene's size (paper 4.2, Figure 10).",
        outcome,
        f"Counted at the outermost invalid sphere, the ripple of the curve peaks {offset:+.2f} levels from "
        f"the halvings of the radius, which are at levels {', '.join(f'{level:.1f}' for level in wanted)}; "
        f"confirmed within {NEAR:g}, of {period / 2:.1f} that are possible, by two standard errors. "
        f"Maxima as read from the curve: {_listed(peaks(levels, mean[levels]))}.",
    )


def smaller(waves: Mapping[str, list[Ripple]]) -> Verdict:
    """Whether Hilbert's ripple is smaller than Lebesgue's."""
    lebesgue, hilbert = (np.array([wave.amplitude for wave in waves[order]]) for order in ORDERS)
    sign = certain_sign(lebesgue - hilbert)
    return Verdict(
        "Hilbert order has smaller peaks than Lebesgue order (paper 4.2, Figure 10).",
        outcome_of(sign, wanted=1),
        f"Amplitude of the ripple, as a share of the curve: Lebesgue {lebesgue.mean():.0%}, Hilbert "
        f"{hilbert.mean():.0%}, {(hilbert / lebesgue).mean():.2f} times as much (t-test over seeds, "
        f"false-alarm rate {FALSE_ALARMS:g}). The paper calls Hilbert's peaks much smaller.",
    )


def flat(misses: np.ndarray, levels: np.ndarray) -> Verdict:
    """Whether Hilbert's curve rises without a valley."""
    outcome, falls = rising(misses, levels)
    return Verdict(
        "Under Hilbert order the curve has no peaks at all (more than the paper claims).",
        outcome,
        f"Before its largest level the curve certainly falls into levels {_listed(falls)}; maxima as read "
        f"from the curve: {_listed(peaks(levels, misses.mean(axis=0)[levels]))}.",
    )


def only_first(rebuilds: Mapping[str, np.ndarray], levels: np.ndarray) -> Verdict:
    """Whether rebuild counts, the other definition, show no peaks under either order."""
    found = {order: rising(counts, levels) for order, counts in rebuilds.items()}
    return Verdict(
        "The peaks appear only where a miss is counted at the outermost invalid sphere: rebuilds rise from "
        "level to level under both orders.",
        together([outcome for outcome, _ in found.values()]),
        "Levels into which rebuilds certainly fall: "
        + "; ".join(f"{order.capitalize()} {_listed(falls)}" for order, (_, falls) in found.items())
        + f". Levels {levels[0]} to {levels[-1]} are looked at, before the limit of rays sets in.",
    )


def rising(counts: np.ndarray, levels: np.ndarray) -> tuple[Outcome, list[int]]:
    """Whether counts rise up to their largest level, and the levels into which they certainly fall.

    Confirmed: no mean is below that of the level before, and some are certainly above. Refuted: one is
    certainly below (t-tests over seeds).

    Parameters
    ----------
    counts : (seeds, levels from S_0)
    levels : consecutive levels to test
    """
    mean = counts.mean(axis=0)[levels]
    upward = levels[: 1 + int(mean.argmax())]
    steps = np.diff(counts[:, upward], axis=1)
    signs = [certain_sign(step) for step in steps.T]
    falls = [int(level) for level, sign in zip(upward[1:], signs, strict=True) if sign == -1]
    rises = 1 in signs and bool((steps.mean(axis=0) >= 0).all())
    return "refuted" if falls else "confirmed" if rises else "open", falls


def gain(costs: Costs, settings: Mapping[str, Any]) -> Verdict:
    """Whether sorted samples take less time than unsorted ones, at the largest sample count."""
    largest = {order: np.array([row[-1] for row in rows]) for order, rows in costs.items()}
    ratios = {order: largest["none"] / largest[order] for order in ORDERS}
    outcomes = [outcome_of(certain_sign(np.log(ratio[:, 0])), wanted=1) for ratio in ratios.values()]
    return Verdict(
        "Sorting the samples along a space-filling curve reduces the time (paper 2.3).",
        together(outcomes),
        "; ".join(
            f"{order.capitalize()} takes {seconds:.1f} times less CPU time and {tests:.1f} times fewer tests"
            for order, (seconds, tests) in ((order, ratio.mean(axis=0)) for order, ratio in ratios.items())
        )
        + f", than random order; {settings['timed_samples'][-1]:,} samples, "
        f"{settings['timed_lines']:,} lines.",
    )


def _count(
    lines: Segments, samples: int, order: str, seed: int, settings: Mapping[str, Any]
) -> Measured[Mapping[str, Any]]:
    asked = in_sphere(samples, settings["disc_radius"], seed)

    def count() -> Mapping[str, Any]:
        return estimate.sphere_cache(
            lines,
            asked,
            settings["ratio"],
            settings["min_rays"],
            order,
            "all",
            UNIT_SPHERE,
            threads=settings["threads"],
        ).stats

    return measured(count)


def _listed(levels: list[int]) -> str:
    return ", ".join(str(level) for level in levels) or "none"


def _level_figure(name: str, runs: Runs, settings: Mapping[str, Any]) -> Figure:
    levels, period = counted_levels(settings), halving_period(settings["ratio"])
    halvings = range(1, int(levels[-1] / period) + 1)
    return Figure(
        f"curve_orders_{name}",
        f"Cache misses at each level, a miss counted at {DEFINITIONS[name]} (Figure 10). "
        f"{settings['lines']:,} uniform lines, {settings['samples']:,} samples uniform in the unit sphere, "
        f"Q = {settings['ratio']:g}, lists below {settings['min_rays']} rays are not subdivided. "
        f"Dotted: radii 2^-k. {averaged(settings)}",
        "level $i$ of the sphere $S_i$",
        "misses",
        [level_curve(order.capitalize(), stacked(each, name)) for order, each in runs.items()],
        marks=[Mark(k * period, f"$2^{{-{k}}}$") for k in halvings],
        log_y=True,
    )


def _time_figure(costs: Costs, settings: Mapping[str, Any]) -> Figure:
    curves = []
    for order, rows in costs.items():
        label = "random order" if order == "none" else f"{order.capitalize()} order"
        mean, error = mean_and_error(np.array(rows)[:, :, 0])
        curves.append(Curve(label, settings["timed_samples"], mean, error))
    return Figure(
        "sorting_gain",
        f"Processor time of the sphere cache by the order of its samples: {settings['timed_lines']:,} lines, "
        f"Q = {settings['ratio']:g}. {averaged(settings)}",
        "samples",
        "CPU time [s]",
        curves,
        log_x=True,
        log_y=True,
    )


EXPERIMENT = Experiment(
    name="curve-orders",
    title="Space-filling curves and the sphere cache",
    source="paper 4.2, Figure 10; paper 2.3",
    question="Where do misses peak when the samples follow a Lebesgue or a Hilbert curve, what counts as a "
    "miss, and how much time does sorting save?",
    run=run,
    full={
        "seeds": [1, 2, 3, 4, 5],
        "lines": 1024**2,
        "samples": 1_000_000,
        "ratio": 0.9,
        "min_rays": 100,
        "disc_radius": 0.001,
        "timed_samples": [1_000, 3_000, 10_000],
        "timed_lines": 100_000,
    },
    quick={
        "seeds": [1, 2],
        "lines": 60_000,
        "samples": 20_000,
        "timed_samples": [300, 1_000],
        "timed_lines": 10_000,
    },
    timed=True,
)
