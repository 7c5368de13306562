# SPDX-License-Identifier: Apache-2.0
"""`hybrid-estimate`: the sphere cache's cost from its upper levels and few rays (paper 4.1)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

import deltalux.scenes
from deltalux.estimate import sphere_cache
from deltalux.planning import HybridEstimate, hybrid_estimate
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, trace, uniform_lines
from deltalux.studies.experiment import Experiment, Figure, Findings, Outcome, Table, Verdict
from deltalux.studies.progress_parts import Steps
from deltalux.studies.repeats import averaged, certain_sign, together
from deltalux.studies.scene_samples import static_distance, uniform_on_surfaces
from deltalux.studies.seeds import Done, by_seed
from deltalux.studies.series import Series, series_table
from deltalux.studies.uniform_samples import UNIT_SPHERE, in_cube

LINES = "uniform lines"
CLOSE = 5.0  # per cent: "less than 5 % in most of the cases" (paper 5)
LEVELS = "measured upper levels"

Case = tuple[str, Segments, Samples, dict[str, Any]]  # name, …, options that prediction and count share
Errors = dict[str, list[list[float]]]  # case -> (seeds, levels) per cent


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Predict and count tests with each number of measured levels and each share of the rays."""
    levels, divisors = settings["levels"], settings["divisors"]
    steps = Steps(progress, (1 + len(settings["scenes"])) * len(settings["seeds"]))
    rows = by_seed(partial(_of_seed, settings=settings), settings["seeds"], steps)
    depth = {case: found.depth for case, found in rows[-1].items()}
    sphere, disc, cost = (
        {
            divisor: {case: [getattr(row[case], part)[divisor] for row in rows] for case in rows[0]}
            for divisor in divisors
        }
        for part in ("sphere", "disc", "cost")
    )
    x = np.array(levels, float)
    return Findings(
        [
            _table(f"hybrid_estimate_{divisor}", x, sphere[divisor], disc[divisor], cost[divisor])
            for divisor in divisors
        ],
        _figures(x, sphere, disc, settings),
        [
            theory_verdict(levels, depth, sphere[divisors[0]]),
            more_verdict(levels, sphere[divisors[0]]),
            few_verdict(divisors[-1], sphere[divisors[0]], sphere[divisors[-1]]),
            whole_verdict(divisors[-1], sphere[divisors[-1]], disc[divisors[-1]], cost[divisors[-1]]),
        ],
        [
            "Error = 100 (predicted − counted) / counted tests of a run of the exact sphere cache with all "
            "rays. In the scenes samples lie on surfaces, and theory goes on with m_i ~ Q^(-2i). "
            f"{averaged(settings)}",
        ],
    )


@dataclass(frozen=True)
class _Found:
    """Of one case and seed: the depth of the real cache, and by divisor errors in per cent for each level."""

    depth: int
    sphere: dict[int, list[float]] = field(default_factory=dict)
    disc: dict[int, list[float]] = field(default_factory=dict)
    cost: dict[int, list[float]] = field(default_factory=dict)


def _of_seed(seed: int, done: Done, settings: Mapping[str, Any]) -> dict[str, _Found]:
    """What is found in each case."""
    cache: dict[str, Any] = {key: settings.get(key) for key in ("ratio", "min_rays", "threads")}
    cases = {}
    for case, segments, samples, options in _cases(seed, settings):
        outer: dict[str, Any] = {key: value for key, value in options.items() if key == "outer_sphere"}
        real = sphere_cache(segments, samples, **cache, **outer).stats
        found = cases[case] = _Found(int(np.flatnonzero(real["rebuilds"]).max()))
        for divisor in settings["divisors"]:
            estimates = [
                hybrid_estimate(segments, samples, **cache, **options, upper_levels=level, divisor=divisor)
                for level in settings["levels"]
            ]
            found.sphere[divisor] = [_percent(one.sphere_tests, real["sphere_tests"]) for one in estimates]
            found.disc[divisor] = [_percent(one.disc_tests, real["disc_tests"]) for one in estimates]
            found.cost[divisor] = [_cost(one, real) for one in estimates]
        done()
    return cases


def _cases(seed: int, settings: Mapping[str, Any]) -> Iterator[Case]:
    count = settings["samples"]
    lines = uniform_lines(settings["lines"], seed)
    yield LINES, lines, in_cube(count, "volume", seed), {"outer_sphere": UNIT_SPHERE}
    for name in settings["scenes"]:
        scene = getattr(deltalux.scenes, name)()
        radius = static_distance(scene, count)
        segments = trace(scene, settings["paths"], seed, threads=settings.get("threads"))
        samples = uniform_on_surfaces(scene, count, seed, radius, movables=False)
        yield name, segments, samples, {"spread": "surface"}


def _percent(predicted: float, counted: float) -> float:
    return 100 * (predicted / counted - 1)


def _cost(found: HybridEstimate, real: Mapping[str, Any]) -> float:
    """Sphere tests that the estimate takes, in per cent of those that it predicts."""
    return 100 * found.pilot_sphere_tests / real["sphere_tests"]


# ---- verdicts -----------------------------------------------------------------------------------


def theory_verdict(levels: Sequence[int], depth: Mapping[str, int], errors: Errors) -> Verdict:
    """Whether theory predicts the lower half of the levels: error with the upper half measured."""
    parts, worst = [], 0.0
    for name, rows in errors.items():
        half = max((k for k, level in enumerate(levels) if level <= depth[name] / 2), default=0)
        error = float(np.mean([row[half] for row in rows]))
        worst = max(worst, abs(error))
        parts.append(f"{name} {error:+.1f} % with {levels[half]} of {depth[name]} levels")
    return Verdict(
        "From the upper levels, theory predicts the lower ones accurately (paper 4.1).",
        "confirmed" if worst <= CLOSE else "refuted",
        f"Error of the sphere tests with all rays, upper half of the levels measured: {', '.join(parts)}; "
        f"within {CLOSE:g} % it is called accurate.",
    )


def more_verdict(levels: Sequence[int], errors: Errors) -> Verdict:
    """Whether each further measured level improves the prediction.

    Refuted if one step in any case certainly enlarges the error; confirmed if no step enlarges it.
    """
    outcomes: list[Outcome] = []
    parts = []
    for name, rows in errors.items():
        size = np.abs(rows)
        steps = np.diff(size, axis=1)
        if any(certain_sign(step) > 0 for step in steps.T):
            outcomes.append("refuted")
        else:
            outcomes.append("confirmed" if steps.mean(axis=0).max() <= 0 else "open")
        sizes = ", ".join(f"{value:.1f}" for value in size.mean(axis=0))
        parts.append(f"{name} {sizes} %")
    return Verdict(
        "Each further upper level that is measured makes the prediction more accurate (paper 4.1).",
        together(outcomes),
        f"Size of the error of the sphere tests, all rays, {levels[0]} to {levels[-1]} measured levels: "
        f"{'; '.join(parts)}.",
    )


def few_verdict(divisor: int, every: Errors, few: Errors) -> Verdict:
    """Whether few rays predict as well as all rays, at every number of measured levels."""
    apart = {
        name: float(np.abs(np.mean(rows, axis=0) - np.mean(few[name], axis=0)).max())
        for name, rows in every.items()
    }
    parts = ", ".join(f"{name} {points:.1f} points" for name, points in apart.items())
    return Verdict(
        f"With 1/{divisor} of the rays it stays as accurate (paper 4.1, after Revelles et al. 2003).",
        "confirmed" if max(apart.values()) <= CLOSE else "refuted",
        f"Largest change of the predicted sphere tests: {parts}.",
    )


def whole_verdict(divisor: int, sphere: Errors, disc: Errors, cost: Errors) -> Verdict:
    """Whether a pilot through all levels with few rays needs no theory."""
    errors = [np.abs(np.mean(rows, axis=0))[-1] for table in (sphere, disc) for rows in table.values()]
    price = max(float(np.mean(rows, axis=0)[-1]) for rows in cost.values())
    outcome: Outcome = "confirmed" if max(errors) <= 1 else "refuted"
    return Verdict(
        f"All levels measured with 1/{divisor} of the rays predict sphere and disc tests within 1 % "
        "(beyond the paper).",
        outcome,
        f"Largest error {max(errors):.2f} %, for {price:.1f} % of the sphere tests.",
    )


# ---- tables and figures -------------------------------------------------------------------------


def _table(name: str, x: np.ndarray, sphere: Errors, disc: Errors, cost: Errors) -> Table:
    series = []
    for case in sphere:
        series += [
            Series.of_seeds(f"{case}, error of sphere tests", "%", sphere[case]),
            Series.of_seeds(f"{case}, error of disc tests", "%", disc[case]),
            Series.of_seeds(f"{case}, cost of the estimate", "%", cost[case]),
        ]
    return series_table(name, LEVELS, x, series)


def _figures(
    x: np.ndarray, sphere: Mapping[int, Errors], disc: Mapping[int, Errors], settings: Mapping[str, Any]
) -> list[Figure]:
    inputs = (
        f"{settings['samples']:,} samples; {settings['lines']:,} uniform lines, or {settings['paths']:,} "
        f"paths in a scene; Q = {settings['ratio']:.3g}, lists from {settings['min_rays']} rays divided"
    )
    figures = []
    for kind, errors in (("sphere", sphere), ("disc", disc)):
        curves = [
            Series.of_seeds(f"{case}, " + ("all rays" if divisor == 1 else f"1/{divisor}"), "%", rows).curve(
                x
            )
            for divisor, table in errors.items()
            for case, rows in table.items()
        ]
        figures.append(
            Figure(
                f"hybrid_estimate_{kind}_tests",
                f"Error of the predicted {kind} tests; {inputs}. {averaged(settings)}",
                LEVELS,
                f"error of {kind} tests (%)",
                curves,
            )
        )
    return figures


EXPERIMENT = Experiment(
    name="hybrid-estimate",
    title="Predicting the cost from the upper levels",
    source="paper 4.1",
    question="How well do the upper levels of the sphere cache, few rays and theory below predict its cost?",
    run=run,
    full={
        "seeds": [1, 2, 3],
        "lines": 1_000_000,
        "paths": 200_000,
        "samples": 10_000,
        "scenes": ["atrium", "expo"],
        "ratio": 2 / 3,
        "min_rays": 100,
        "levels": [1, 2, 3, 4, 5, 6, 7, 8, 9, 10],
        "divisors": [1, 100],
    },
    quick={
        "seeds": [1, 2],
        "lines": 50_000,
        "paths": 5000,
        "samples": 1000,
        "scenes": ["expo"],
        "levels": [1, 2, 4, 8],
    },
)
