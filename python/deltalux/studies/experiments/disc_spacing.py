# SPDX-License-Identifier: Apache-2.0
"""`disc-spacing`: disc index against sphere cache over disc radius / sample distance (paper 2.4)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

import deltalux.scenes
from deltalux.estimate import disc_index, sphere_cache
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, trace, uniform_lines
from deltalux.studies.curves import crossings
from deltalux.studies.experiment import Experiment, Figure, Findings, Outcome, Verdict
from deltalux.studies.progress_parts import Steps
from deltalux.studies.scene_samples import static_distance, uniform_on_surfaces
from deltalux.studies.seeds import Done, by_seed
from deltalux.studies.series import Series, series_table
from deltalux.studies.timing import Timing, interleaved
from deltalux.studies.uniform_samples import UNIT_SPHERE, Spread, in_cube

LINES: dict[str, Spread] = {"lines, samples in a cube": "volume", "lines, samples on its walls": "surface"}
BOXES = 8  # boxes that a node of the disc index tests at once
SPACING = "disc radius / distance of samples"
NEAR = (0.5, 2.0)  # "in the order of magnitude of the mean distance"

Case = tuple[Segments, Samples, float, Mapping[str, Any]]  # …, sample distance, options for the cache's S_0


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Count and time both methods on the same segments and samples, at each disc radius."""
    widths = np.array(settings["widths"], float)
    steps = Steps(progress, (2 + len(settings["scenes"])) * (len(settings["seeds"]) + 1))
    counts: dict[str, list[list[float]]] = {}  # case -> (seeds, widths)
    times: dict[str, list[dict[str, Timing]]] = {}  # case -> widths
    for name, case in _cases(settings).items():
        counts[name] = by_seed(
            partial(_counts, case=case, widths=widths, settings=settings), settings["seeds"], steps
        )
        inputs = case(settings["seeds"][0])
        times[name] = [_times(inputs, w, settings) for w in widths]
        steps.done()
    counted = [Series.of_seeds(name, "1", rows) for name, rows in counts.items()]
    timed = [_ratio_series(name, rows) for name, rows in times.items()]
    absolute = [
        Series.of_times(f"{method}, {name}", [row[method] for row in times[name]])
        for name in times
        for method in ("sphere cache", "disc index")
    ]
    return Findings(
        [
            series_table("disc_spacing_tests", SPACING, widths, counted),
            series_table("disc_spacing_times", SPACING, widths, [*timed, *absolute]),
        ],
        [
            _figure("tests", "tests", "mean and standard error over seeds", widths, counted, settings),
            _figure(
                "times",
                "processor time",
                f"one thread, the index's build included; median of {settings['repetitions']} interleaved "
                "repetitions and its standard error; seed",
                widths,
                timed,
                settings,
            ),
        ],
        [near_verdict(widths, timed), far_verdict(widths, timed)],
        [
            "A node of the index counts as 8 tests, one for each box, and a leaf as 8 disc tests.",
            "The sphere cache ends at spheres of the disc's size, so that large discs leave it few spheres.",
        ],
    )


# ---- inputs -------------------------------------------------------------------------------------


def _cases(settings: Mapping[str, Any]) -> dict[str, Callable[[int], Case]]:
    """For each case, a function that makes its inputs from a seed."""

    def uniform(spread: Spread) -> Callable[[int], Case]:
        def case(seed: int) -> Case:
            samples = in_cube(settings["samples"], spread, seed)
            options = {"outer_sphere": UNIT_SPHERE}
            return uniform_lines(settings["lines"], seed), samples, float(samples.radius[0]), options

        return case

    def lit(name: str) -> Callable[[int], Case]:
        scene = getattr(deltalux.scenes, name)()
        distance = static_distance(scene, settings["samples"])

        def case(seed: int) -> Case:
            segments = trace(scene, settings["paths"], seed, threads=settings.get("threads"))
            samples = uniform_on_surfaces(scene, settings["samples"], seed, distance, movables=False)
            return segments, samples, distance, {}

        return case

    return {
        **{label: uniform(spread) for label, spread in LINES.items()},
        **{name: lit(name) for name in settings["scenes"]},
    }


def _widened(samples: Samples, radius: float) -> Samples:
    return Samples(samples.points, samples.normals, radius)


# ---- measurements -------------------------------------------------------------------------------


def _counts(
    seed: int, done: Done, case: Callable[[int], Case], widths: np.ndarray, settings: Mapping[str, Any]
) -> list[float]:
    """`_count_ratio` at each width."""
    inputs = case(seed)
    ratios = [_count_ratio(inputs, width, settings) for width in widths]
    done()
    return ratios


def _count_ratio(inputs: Case, width: float, settings: Mapping[str, Any]) -> float:
    """Tests of the sphere cache over those of the disc index."""
    segments, samples, distance, options = inputs
    discs, threads = _widened(samples, width * distance), settings.get("threads")
    cache = sphere_cache(segments, discs, threads=threads, **options).stats
    index = disc_index(segments, discs, threads=threads).stats
    tests = BOXES * index["node_tests"] + index["disc_tests"]
    return (cache["sphere_tests"] + cache["disc_tests"]) / tests


def _times(inputs: Case, width: float, settings: Mapping[str, Any]) -> dict[str, Timing]:
    segments, samples, distance, options = inputs
    discs = _widened(samples, width * distance)
    return interleaved(
        {
            "sphere cache": lambda: sphere_cache(segments, discs, threads=1, **options),
            "disc index": lambda: disc_index(segments, discs, threads=1),
        },
        settings["repetitions"],
    )


def _ratio_series(name: str, times: Sequence[Mapping[str, Timing]]) -> Series:
    pairs = np.array([row["sphere cache"].over(row["disc index"]) for row in times])
    return Series(name, "1", pairs[:, 0], pairs[:, 1])


# ---- verdicts -----------------------------------------------------------------------------------


def near_verdict(widths: np.ndarray, timed: Sequence[Series]) -> Verdict:
    """Whether the index is faster wherever radius and distance have the same order of magnitude."""
    near = (widths >= NEAR[0]) & (widths <= NEAR[1])
    low, high = _bounds(timed)
    outcome: Outcome = "open"
    if (low[:, near] > 1).all():
        outcome = "confirmed"
    elif (high[:, near] < 1).any():
        outcome = "refuted"
    return Verdict(
        "Disc indexing is faster where the radius is of the order of the samples' distance (paper 2.4).",
        outcome,
        f"Time of the sphere cache over that of the disc index for radii of {NEAR[0]:g} to {NEAR[1]:g} "
        f"distances: {_ranges(timed, near)}.",
    )


def far_verdict(widths: np.ndarray, timed: Sequence[Series]) -> Verdict:
    """Whether the sphere cache is faster for all smaller and larger discs."""
    smaller, larger = widths < NEAR[0], widths > NEAR[1]
    low, high = _bounds(timed)
    outcome: Outcome = "open"
    if (high[:, smaller | larger] < 1).all():
        outcome = "confirmed"
    elif (low[:, smaller | larger] > 1).any():
        outcome = "refuted"
    return Verdict(
        "For other radii the sphere cache is faster (paper 2.4).",
        outcome,
        f"Time of the sphere cache over that of the disc index for smaller discs: {_ranges(timed, smaller)}; "
        f"for larger ones: {_ranges(timed, larger)}. Both cost the same at {_where(widths, timed)}.",
    )


def _bounds(timed: Sequence[Series]) -> tuple[np.ndarray, np.ndarray]:
    """Two standard errors below and above each ratio: (cases, widths)."""
    values = np.array([series.values for series in timed])
    error = np.array(
        [np.zeros(len(series.values)) if series.error is None else series.error for series in timed]
    )
    return values - 2 * error, values + 2 * error


def _ranges(timed: Sequence[Series], which: np.ndarray) -> str:
    return ", ".join(f"{s.label} {s.values[which].min():.2f} to {s.values[which].max():.2f}" for s in timed)


def _where(widths: np.ndarray, timed: Sequence[Series]) -> str:
    found = [
        f"{x:.1f} distances ({series.label})"
        for series in timed
        for x in crossings(widths, series.values, np.ones_like(widths))
    ]
    return ", ".join(found) or "no width that was measured"


def _figure(
    name: str, what: str, how: str, widths: np.ndarray, series: Sequence[Series], settings: Mapping[str, Any]
) -> Figure:
    seeds = settings["seeds"] if name == "tests" else settings["seeds"][:1]
    return Figure(
        f"disc_spacing_{name}",
        f"Sphere cache over disc index, {what}, {settings['samples']:,} samples and {settings['lines']:,} "
        f"uniform lines; {settings['paths']:,} paths in the scenes; "
        f"{how} {seeds}.",
        SPACING,
        f"{what}, sphere cache / disc index",
        [
            *(each.curve(widths) for each in series),
            Series("equal", "1", np.ones_like(widths), theory=True).curve(widths),
        ],
        log_x=True,
    )


EXPERIMENT = Experiment(
    name="disc-spacing",
    title="Disc radius and the distance of samples",
    source="paper 2.4",
    question="For which disc radii, in distances of the samples, is disc indexing the faster method?",
    run=run,
    full={
        "seeds": [1, 2, 3],
        "lines": 200_000,
        "samples": 10_000,
        "paths": 50_000,
        "scenes": ["atrium", "expo"],
        "widths": [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0],
        "repetitions": 5,
    },
    quick={
        "seeds": [1, 2],
        "lines": 20_000,
        "samples": 1000,
        "paths": 2000,
        "scenes": ["expo"],
        "widths": [0.125, 1.0, 4.0],
        "repetitions": 3,
    },
    timed=True,
)
