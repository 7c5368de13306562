# SPDX-License-Identifier: Apache-2.0
"""`ray-map-cost`: the paper's analysis for ray maps in disc mode, its future work (paper 5.1)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from deltalux import model
from deltalux.estimate import RayMap, disc_index, ray_map, sphere_cache
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, uniform_lines
from deltalux.studies.curves import agreement, power_law
from deltalux.studies.experiment import Experiment, Figure, Findings, Outcome, Verdict
from deltalux.studies.measuring import measured
from deltalux.studies.progress_parts import Steps
from deltalux.studies.seeds import Done, by_seed
from deltalux.studies.series import Series, series_table
from deltalux.studies.timing import Timing, interleaved, median, repeated
from deltalux.studies.uniform_samples import UNIT_SPHERE, Spread, in_cube

BOXES = 8  # boxes that a node of the disc index tests at once
SORTED, TESTED = "ray map, sorting segments", "ray map, disc tests"
MAP, CACHE, INDEX = "ray map", "sphere cache", "disc index"
TOLERANCE, CONSTANT_TOLERANCE = 0.05, 0.25  # largest accepted deviation of an exponent, of a constant
SAMPLES, LINES = "samples n_P", "segments n_R"
SAMPLES_LABEL = "samples $n_P$"
UNIT = "n_R n_P^(1/3)"
Counts = dict[str, float]


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Count and time ray map and other methods over the number of samples and of segments."""
    samples, lines = (np.array(settings[name], float) for name in ("samples", "lines"))
    steps = Steps(progress, len(settings["seeds"]) * (2 * len(samples) + len(lines)) + len(samples) + 1)

    def count_over(values: np.ndarray, tests_of: Callable[[int, int], Counts]) -> dict[str, np.ndarray]:
        """(seeds, values) tests of each method."""

        def of_seed(seed: int, done: Done) -> list[Counts]:
            row = []
            for value in values:
                row.append(tests_of(int(value), seed))
                done()
            return row

        rows = by_seed(of_seed, settings["seeds"], steps)
        return {name: np.array([[cell[name] for cell in row] for row in rows]) for name in rows[0][0]}

    most, middle = int(lines[-1]), settings["update_samples"]
    volume = count_over(samples, lambda n, seed: _tests(n, most, "volume", seed, settings))
    surface = count_over(samples, lambda n, seed: _tests(n, most, "surface", seed, settings))
    over_lines = count_over(lines, lambda n, seed: _tests(middle, n, "volume", seed, settings))
    times = []
    for count in samples:
        times.append(_times(int(count), most, settings))
        steps.done()
    update = _update_times(middle, most, settings)
    steps.done()
    by_cube_root = {name: tests / (most * np.cbrt(samples)) for name, tests in volume.items()}
    counted = [Series.of_seeds(name, UNIT, tests) for name, tests in by_cube_root.items()]
    walls = [Series.of_seeds(name, "n_R", tests / most) for name, tests in surface.items()]
    theory = model.ray_map_cost(samples, 1) / np.cbrt(samples)
    counted.append(Series("ray map, theory", UNIT, theory, theory=True))
    over = [
        Series.of_seeds(name, UNIT, tests / (lines * np.cbrt(middle))) for name, tests in over_lines.items()
    ]
    timed = [Series.of_times(name, [row[name] for row in times]) for name in (MAP, CACHE, INDEX)]
    return Findings(
        [
            series_table("ray_map_cost_volume", SAMPLES, samples, counted),
            series_table("ray_map_cost_surface", SAMPLES, samples, walls),
            series_table("ray_map_cost_segments", LINES, lines, over),
            series_table("ray_map_cost_times", SAMPLES, samples, timed),
        ],
        _figures(samples, counted, walls, timed, settings),
        [
            law_verdict("n_P", 1 / 3, samples, volume[MAP]),
            law_verdict("n_R", 1.0, lines, over_lines[MAP]),
            constant_verdict(by_cube_root[MAP].mean(axis=0), theory),
            cheaper_verdict(CACHE, samples, timed[0], timed[1]),
            cheaper_verdict(INDEX, samples, timed[0], timed[2]),
            update_verdict(update),
        ],
        [
            "Analysis: cells of side a in the cube of eq. 4 number a^-3, and n_R a² of the segments meet "
            "each, so that sorting them into cells costs n_R / a. Cells are split lazily until a is of the "
            "size of the discs, d ~ n_P^(-1/3); a disc is then tested against the n_R d² segments of each of "
            "its cells. Both sums are of the order of n_R n_P^(1/3): the law of Theorem 1. On surfaces they "
            "follow ln n_P and 1 instead, as those of the sphere cache do.",
        ],
    )


# ---- measurements -------------------------------------------------------------------------------


def _tests(count: int, lines: int, spread: Spread, seed: int, settings: Mapping[str, Any]) -> Counts:
    """Number of tests of each method on the same input."""
    threads = settings.get("threads")
    segments, samples = uniform_lines(lines, seed), in_cube(count, spread, seed)
    own = ray_map(segments, samples, threads=threads).stats
    cache = _cache(segments, samples, threads)
    index = disc_index(segments, samples, threads=threads).stats
    return {
        SORTED: own["node_tests"],
        TESTED: own["disc_tests"],
        MAP: own["node_tests"] + own["disc_tests"],
        CACHE: cache["sphere_tests"] + cache["disc_tests"],
        INDEX: BOXES * index["node_tests"] + index["disc_tests"],
    }


def _cache(segments: Segments, samples: Samples, threads: int | None) -> Mapping[str, Any]:
    return sphere_cache(segments, samples, min_rays=1, outer_sphere=UNIT_SPHERE, threads=threads).stats


def _times(count: int, lines: int, settings: Mapping[str, Any]) -> dict[str, Timing]:
    seed = settings["seeds"][0]
    segments, samples = uniform_lines(lines, seed), in_cube(count, "volume", seed)
    return interleaved(
        {
            MAP: lambda: ray_map(segments, samples, threads=1),
            CACHE: lambda: _cache(segments, samples, 1),
            INDEX: lambda: disc_index(segments, samples, threads=1),
        },
        settings["repetitions"],
    )


def _update_times(count: int, lines: int, settings: Mapping[str, Any]) -> dict[str, Timing]:
    """Times of one frame of static samples, in which new segments replace a share of the old ones."""
    seed, turns = settings["seeds"][0], settings["repetitions"] + 1  # the first is not counted
    samples, changed = in_cube(count, "volume", seed), round(settings["changed"] * lines)
    pool = uniform_lines(lines + turns * changed, seed)
    live = RayMap(pool.select(slice(0, lines)))
    live.disc(samples, threads=1)
    ids = np.arange(changed)
    in_map, by_index = [], []
    for turn in range(turns):
        begin = lines + turn * changed
        new = pool.select(slice(begin, begin + changed))
        many, copies = repeated(new)  # the index needs the same time for old and for new segments
        taken = measured(partial(_exchange, live, ids, new, samples))
        ids = taken.value
        in_map.append(taken.cpu_seconds)
        build, search = (
            measured(partial(disc_index, part, samples, threads=1)).cpu_seconds
            for part in (new.select(slice(0, 1)), many)
        )
        by_index.append(2 * (search - build) / copies)
    return {MAP: median(in_map[1:]), INDEX: median(by_index[1:])}


def _exchange(live: RayMap, ids: np.ndarray, new: Segments, samples: Samples) -> np.ndarray:
    """Replace segments in the ray map and update the sums; returns the ids of the new ones."""
    live.remove(ids)
    fresh = live.push(new)
    live.disc(samples, threads=1)
    return fresh


# ---- verdicts -----------------------------------------------------------------------------------


def law_verdict(symbol: str, exponent: float, values: np.ndarray, tests: np.ndarray) -> Verdict:
    """Whether the ray map's tests grow by the power that theory predicts, mean over seeds."""
    found, error = power_law(values, tests.mean(axis=0))
    return Verdict(
        f"A ray map obeys the law of Theorem 1: tests grow as {symbol}^{exponent:.2g} (beyond the paper).",
        agreement(found, error, exponent, TOLERANCE),
        f"Exponent {found:.3f} ± {error:.3f} for {symbol} from {values[0]:,.0f} to {values[-1]:,.0f}; "
        f"within {TOLERANCE:g} it agrees.",
    )


def constant_verdict(counted: np.ndarray, theory: np.ndarray) -> Verdict:
    """Whether the constant of that power law also equals the one from integral geometry."""
    ratio = counted / theory
    agrees = bool((np.abs(ratio - 1) <= CONSTANT_TOLERANCE).all())
    return Verdict(
        "The constant follows from integral geometry: cells are split down to the side of a disc "
        "(`model.ray_map_cost`, beyond the paper).",
        "confirmed" if agrees else "refuted",
        f"Counted over predicted tests: {ratio.min():.2f} to {ratio.max():.2f}; within "
        f"{CONSTANT_TOLERANCE:.0%} they agree.",
    )


def cheaper_verdict(other: str, samples: np.ndarray, own: Series, theirs: Series) -> Verdict:
    """Whether the ray map is faster at every number of samples."""
    ratio = own.values / theirs.values
    outcome: Outcome = "confirmed" if (ratio < 1).all() else "refuted" if (ratio > 1).all() else "open"
    return Verdict(
        f"A ray map, built anew, is faster than the {other} on the same segments (beyond the paper).",
        outcome,
        f"Processor time of the ray map over that of the {other}: {ratio[0]:.2f} at {samples[0]:,.0f} "
        f"samples, {ratio[-1]:.2f} at {samples[-1]:,.0f}, {ratio.min():.2f} to {ratio.max():.2f} in all.",
    )


def update_verdict(times: Mapping[str, Timing]) -> Verdict:
    """Whether a kept ray map updates static samples faster than a kept disc index."""
    claim = "A kept ray map updates static samples faster than a kept disc index (beyond the paper)."
    if not times[INDEX].known:
        return Verdict(claim, "open", "The index's time is too short to be told from its spread.")
    ratio, error = times[MAP].over(times[INDEX])
    outcome: Outcome = "open"
    if abs(ratio - 1) > 2 * error:
        outcome = "confirmed" if ratio < 1 else "refuted"
    return Verdict(
        claim,
        outcome,
        f"Old segments out and new ones in: {1e3 * times[MAP].seconds:.1f} ms by the ray map, "
        f"{1e3 * times[INDEX].seconds:.1f} ms by the disc index; ratio {ratio:.2f} ± {error:.2f}.",
    )


# ---- tables and figures -------------------------------------------------------------------------


def _figures(
    samples: np.ndarray,
    counted: Sequence[Series],
    walls: Sequence[Series],
    timed: Sequence[Series],
    settings: Mapping[str, Any],
) -> list[Figure]:
    lines = settings["lines"][-1]
    seeds = f"mean and standard error over seeds {settings['seeds']}"
    return [
        Figure(
            "ray_map_cost_volume",
            f"Tests in units of eq. 10, samples in a volume, {lines:,} uniform lines, disc radius = "
            f"distance; {seeds}.",
            SAMPLES_LABEL,
            "tests / $n_R n_P^{1/3}$",
            [series.curve(samples) for series in counted],
            log_x=True,
        ),
        Figure(
            "ray_map_cost_surface",
            f"Tests per segment, samples on walls, {lines:,} uniform lines, disc radius = distance; {seeds}.",
            SAMPLES_LABEL,
            "tests / $n_R$",
            [series.curve(samples) for series in walls],
            log_x=True,
        ),
        Figure(
            "ray_map_cost_times",
            f"Processor time, one thread, building included, samples in a volume, {lines:,} uniform lines, "
            f"seed {settings['seeds'][0]}; median of {settings['repetitions']} interleaved repetitions and "
            "its standard error.",
            SAMPLES_LABEL,
            "time (ms)",
            [series.curve(samples) for series in timed],
            log_x=True,
            log_y=True,
        ),
    ]


EXPERIMENT = Experiment(
    name="ray-map-cost",
    title="The same analysis for ray maps",
    source="paper 5.1, future work",
    question="How does the cost of a ray map in disc mode grow, and how does it compare with the others?",
    run=run,
    full={
        "seeds": [1, 2, 3],
        "samples": [1000, 3000, 10_000, 30_000, 100_000],
        "lines": [62_500, 125_000, 250_000, 500_000],
        "update_samples": 10_000,
        "changed": 0.01,
        "repetitions": 5,
    },
    quick={
        "seeds": [1, 2],
        "samples": [1000, 2000, 4000, 8000],
        "lines": [10_000, 20_000, 40_000],
        "update_samples": 1000,
        "repetitions": 3,
    },
    timed=True,
)
