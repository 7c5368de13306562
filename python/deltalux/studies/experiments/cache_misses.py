# SPDX-License-Identifier: Apache-2.0
"""`cache-misses`: rebuilds of each level of the sphere cache, uniform lines (paper 4.2, Figure 9)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from deltalux import estimate, model
from deltalux.segments import Progress, Segments, uniform_lines
from deltalux.studies.experiment import Curve, Experiment, Figure, Findings, Mark, Outcome, Table, Verdict
from deltalux.studies.level_counts import DEFINITIONS, LEVEL_COLUMNS, level_curve, level_rows, stacked
from deltalux.studies.progress_parts import Steps
from deltalux.studies.repeats import FALSE_ALARMS, averaged, certain_sign, together
from deltalux.studies.seeds import Done, by_seed
from deltalux.studies.uniform_samples import UNIT_SPHERE, in_sphere

RULES = ("all", "nested", "literal")
UNLIMITED = "all, no limit"
NEARLY_ALL = 0.999

Runs = list[Mapping[str, Any]]  # `stats` of each seed


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Count rebuilds with each seed: the exact rule over sample counts, then each rule at one of them."""
    counts, compared = settings["sample_counts"], settings["compared_count"]
    rules = (UNLIMITED, *RULES[1:])  # in drawing order: curves that coincide with others come first
    steps = Steps(progress, len(settings["seeds"]) * (len(counts) + len(rules)))

    def counted(seed: int, done: Done) -> dict[int | str, Mapping[str, Any]]:
        lines = uniform_lines(settings["lines"], seed)
        found: dict[int | str, Mapping[str, Any]] = {}
        for samples in counts:
            found[samples] = _count(lines, samples, seed, settings)
            done()
        for rule in rules:
            found[rule] = _count(lines, compared, seed, settings, rule)
            done()
        return found

    runs = by_seed(counted, settings["seeds"], steps)
    by_count: dict[int, Runs] = {count: [run[count] for run in runs] for count in counts}
    by_rule: dict[str, Runs] = {rule: [run[rule] for run in runs] for rule in rules}
    by_rule["all"] = by_count[compared]
    return conclude(by_count, by_rule, settings)


def conclude(
    by_count: Mapping[int, Runs], by_rule: Mapping[str, Runs], settings: Mapping[str, Any]
) -> Findings:
    """Make tables, figures and verdicts from the counts.

    Parameters
    ----------
    by_count : sample count -> `stats` of each seed, the exact rule
    by_rule : containment rule, or `UNLIMITED` -> `stats` of each seed, at one sample count
    settings : settings of `run`
    """
    peak = limit_level(settings)
    limited = {rule: runs for rule, runs in by_rule.items() if rule != UNLIMITED}
    return Findings(
        tables=[
            Table(
                "cache_misses_by_samples",
                ("samples", *LEVEL_COLUMNS),
                [[count, *row] for count, runs in by_count.items() for row in level_rows(runs)],
            ),
            Table(
                "cache_misses_by_rule",
                ("containment", "hits", *LEVEL_COLUMNS),
                [
                    [rule, _total(runs, "hits").mean(), *row]
                    for rule, runs in by_rule.items()
                    for row in level_rows(runs)
                ],
            ),
        ],
        figures=[
            *(_count_figure(name, by_count, settings) for name in DEFINITIONS),
            _rule_figure(by_rule, settings),
        ],
        verdicts=[
            *(rises_and_falls(by_count, name, peak) for name in DEFINITIONS),
            every_rule(limited, peak),
            few_divided(by_count, peak, settings),
            monotone(by_rule[UNLIMITED], settings),
            complete(by_rule),
        ],
        notes=(
            "The paper states neither the number of samples nor the discs of its Figure 9; here discs are so "
            "small that only the limit of rays ends a chain of spheres.",
        ),
    )


def limit_level(settings: Mapping[str, Any]) -> int:
    """The last level around which practically all spheres are subdivided; 9 at the paper's settings."""
    levels = np.arange(1, 200)
    share = model.divided_share(settings["lines"], settings["ratio"], levels - 1, settings["min_rays"])
    return int(levels[share > NEARLY_ALL][-1])


def shape(counts: np.ndarray, peak: int) -> tuple[Outcome, int]:
    """Whether counts rise to a level and fall after it, and the level of their largest mean.

    Confirmed: the largest mean is at the peak, and the next level is certainly lower (t-tests of the
    differences over seeds). Refuted: a level certainly exceeds the peak.

    Parameters
    ----------
    counts : (seeds, levels from S_0)
    peak : level
    """
    over = [certain_sign(counts[:, level] - counts[:, peak]) for level in range(1, counts.shape[1])]
    largest = int(1 + counts[:, 1:].mean(axis=0).argmax())
    falls = largest == peak and peak + 1 < counts.shape[1] and over[peak] == -1
    return "refuted" if 1 in over else "confirmed" if falls else "open", largest


def rises_and_falls(by_count: Mapping[int, Runs], name: str, peak: int) -> Verdict:
    """Figure 9's shape, by one definition of a miss, at every sample count."""
    outcomes, parts = [], []
    for count, runs in by_count.items():
        outcome, largest = shape(stacked(runs, name), peak)
        outcomes.append(outcome)
        parts.append(f"{count:,} samples: largest at level {largest} ({outcome})")
    return Verdict(
        f"Cache misses rise to level {peak} and fall after it, a miss counted at {DEFINITIONS[name]} "
        "(paper 4.2, Figure 9).",
        together(outcomes),
        f"{'; '.join(parts)}. T-tests over seeds, false-alarm rate {FALSE_ALARMS:g} each.",
    )


def every_rule(by_rule: Mapping[str, Runs], peak: int) -> Verdict:
    """Figure 9's shape of the rebuilds under each rule of containment."""
    found = {rule: shape(stacked(runs, "rebuilds"), peak) for rule, runs in by_rule.items()}
    return Verdict(
        f"The rise to level {peak} and the fall after it do not depend on the rule of containment.",
        together([outcome for outcome, _ in found.values()]),
        "; ".join(
            f"{rule}: largest at level {largest} ({outcome})" for rule, (outcome, largest) in found.items()
        )
        + ".",
    )


def few_divided(by_count: Mapping[int, Runs], peak: int, settings: Mapping[str, Any]) -> Verdict:
    """The paper's reason for the fall: 94.6 rays at level 9, so that few spheres are subdivided."""
    predicted = float(model.rays_in_sphere(settings["lines"], settings["ratio"], peak))
    share = float(model.divided_share(settings["lines"], settings["ratio"], peak, settings["min_rays"]))
    signs, parts = [], []
    for count, runs in by_count.items():
        rebuilds, rays = stacked(runs, "rebuilds"), stacked(runs, "mean_rays")[:, peak]
        ratio = rebuilds[:, peak + 1] / rebuilds[:, peak]
        signs.append(certain_sign(ratio - 0.5))
        parts.append(f"{count:,} samples: {rays.mean():.1f} rays, {ratio.mean():.2f}")
    outcome: Outcome = "refuted" if 1 in signs else "confirmed" if set(signs) == {-1} else "open"
    return Verdict(
        f"At level {peak} the probability of subdivision is very small, for want of rays (paper 4.2).",
        outcome,
        f"Rays of level {peak}, and rebuilds of level {peak + 1} over those of level {peak}: "
        f"{'; '.join(parts)}. Expected: {predicted:.1f} rays, and {share:.2f} of the spheres with at least "
        f"{settings['min_rays']}; the paper's 94.6 rays for 1024² · 0.6^18 = 106.5 is a slip. Refuted where "
        "more than half are certainly subdivided.",
    )


def monotone(runs: Runs, settings: Mapping[str, Any]) -> Verdict:
    """Whether the limit causes the fall: without it, no level is certainly below the one before."""
    rebuilds = stacked(runs, "rebuilds")
    levels = np.arange(1, rebuilds.shape[1])
    filled = model.divided_share(settings["lines"], settings["ratio"], levels - 1, 1) > NEARLY_ALL
    steps = np.diff(rebuilds[:, levels[filled]], axis=1)
    signs = [certain_sign(step) for step in steps.T]
    return Verdict(
        "Without the limit of rays the rebuilds never fall from one level to the next.",
        "refuted" if -1 in signs else "confirmed" if 1 in signs else "open",
        f"Of {len(signs)} steps inward {signs.count(1)} certainly rise and {signs.count(-1)} certainly fall; "
        "levels deeper than that are left out, as some spheres around them hold no ray at all.",
    )


def complete(by_rule: Mapping[str, Runs]) -> Verdict:
    """Whether the printed rule finds all hits; a single lost hit refutes it."""
    exact, nested, literal = (_total(by_rule[rule], "hits") for rule in RULES)
    lost = 1 - literal / exact
    more = _total(by_rule["nested"], "rebuilds") / _total(by_rule["all"], "rebuilds")
    same = "as many as" if (nested == exact).all() else "other numbers than"
    outcome: Outcome = "refuted" if lost.any() else "confirmed"
    return Verdict(
        "The sphere cache as printed (containment “literal”) finds every hit (paper 2.3).",
        outcome,
        f"It loses {lost.mean():.1%} of {exact.mean():,.0f} hits; “nested” finds {same} “all”, with "
        f"{more.mean():.2f} times the rebuilds.",
    )


def _count(
    lines: Segments, samples: int, seed: int, settings: Mapping[str, Any], rule: str = "all"
) -> Mapping[str, Any]:
    """Statistics of the sphere cache with `samples` samples, under a rule of containment or `UNLIMITED`."""
    counted = estimate.sphere_cache(
        lines,
        in_sphere(samples, settings["disc_radius"], seed),
        settings["ratio"],
        1 if rule == UNLIMITED else settings["min_rays"],
        settings["order"],
        "all" if rule == UNLIMITED else rule,
        UNIT_SPHERE,
        threads=settings["threads"],
    )
    return counted.stats


def _total(runs: Runs, name: str) -> np.ndarray:
    """(seeds,) counts, summed over levels where there are several."""
    return np.array([np.sum(run[name]) for run in runs], dtype=float)


def _caption(settings: Mapping[str, Any]) -> str:
    return (
        f"{settings['lines']:,} uniform lines, samples uniform in the unit sphere, Q = "
        f"{settings['ratio']:g}, {settings['order'].capitalize()} order, lists below "
        f"{settings['min_rays']} rays are not subdivided. {averaged(settings)}"
    )


def _count_figure(name: str, by_count: Mapping[int, Runs], settings: Mapping[str, Any]) -> Figure:
    peak = limit_level(settings)
    curves = [level_curve(f"{count:,} samples", stacked(runs, name)) for count, runs in by_count.items()]
    if name == "rebuilds":
        most = max(by_count)
        levels = np.arange(1, peak + 2)
        theory = model.limited_rebuilds(
            most, settings["lines"], settings["ratio"], levels, settings["min_rays"]
        )
        curves.append(Curve(f"theory, {most:,} samples", levels.tolist(), theory.tolist(), None, "theory"))
    return Figure(
        f"cache_misses_{name}",
        f"Cache misses at each level, a miss counted at {DEFINITIONS[name]} (Figure 9). {_caption(settings)}",
        "level $i$ of the sphere $S_i$",
        "misses",
        curves,
        marks=[Mark(peak, f"level {peak}")],
        log_y=True,
    )


def _rule_figure(by_rule: Mapping[str, Runs], settings: Mapping[str, Any]) -> Figure:
    return Figure(
        "cache_misses_by_rule",
        f"Rebuilds at each level under each rule of containment, {settings['compared_count']:,} samples. "
        f"{_caption(settings)}",
        "level $i$ of the sphere $S_i$",
        "rebuilds",
        [level_curve(rule, stacked(runs, "rebuilds")) for rule, runs in by_rule.items()],
        log_y=True,
    )


EXPERIMENT = Experiment(
    name="cache-misses",
    title="Cache misses at each level",
    source="paper 4.2, Figure 9",
    question="How often is each sphere of the sphere cache rebuilt, and why do misses rise to level 9 and "
    "fall after it?",
    run=run,
    full={
        "seeds": [1, 2, 3, 4, 5],
        "lines": 1024**2,
        "sample_counts": [1_000, 10_000, 100_000, 1_000_000],
        "compared_count": 100_000,  # sample count for comparing the rules of containment
        "ratio": 0.6,
        "min_rays": 100,
        "order": "lebesgue",
        "disc_radius": 0.001,
    },
    quick={"seeds": [1, 2], "lines": 40_000, "sample_counts": [500, 2_000], "compared_count": 2_000},
)
