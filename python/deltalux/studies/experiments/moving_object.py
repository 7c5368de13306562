# SPDX-License-Identifier: Apache-2.0
"""Theorem 2: sphere cache against disc indexing for the samples of a moving object, over its size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from deltalux import model
from deltalux.estimate import disc_index, sphere_cache
from deltalux.estimate.inputs import core_segments
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, uniform_lines
from deltalux.studies.curves import crossings
from deltalux.studies.experiment import Experiment, Figure, Findings, Mark, Verdict
from deltalux.studies.progress_parts import Steps
from deltalux.studies.series import Series, series_table
from deltalux.studies.timing import Timing, interleaved
from deltalux.studies.uniform_samples import in_cube

BOXES = 8  # that a node of the disc index tests at once
CACHE = "sphere cache, object's rays"
INDEX, INDEX_REBUILT = "disc index built once, all rays", "disc index built each frame, all rays"
INDEX_OWN, INDEX_OWN_REBUILT = (f"disc index built {when}, object's rays" for when in ("once", "each frame"))
COUNTED = (CACHE, INDEX, INDEX_OWN)
TIMED = (CACHE, INDEX_REBUILT, INDEX, INDEX_OWN_REBUILT, INDEX_OWN)
UNIT = "n_R n_D^(1/3)"
SIZE, SIZE_LABEL = "object's size r_D / r_0", "object's size $r_D / r_0$"
PRINTED = float(model.crossover(form="printed"))


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Count and time both methods for objects of every size in the unit sphere."""
    sizes = np.array(settings["sizes"], float)
    unit = settings["lines"] * np.cbrt(settings["samples"])  # of eq. 10, so that the paper's index costs 1
    counts: list[list[dict[str, float]]] = []
    times: list[dict[str, Timing]] = []
    steps = Steps(progress, len(sizes))
    for size in sizes:
        counts.append([_counts(size, seed, settings) for seed in settings["seeds"]])
        times.append(_times(size, settings))
        steps.done()
    counted = {
        name: Series.of_seeds(name, UNIT, np.array([[one[name] / unit for one in row] for row in counts]).T)
        for name in COUNTED
    }
    timed = {name: Series.of_times(name, [row[name] for row in times]) for name in TIMED}
    theory = [
        Series("sphere cache, paper (eq. 15)", UNIT, model.moving_cost_ratio(sizes, 1.0), theory=True),
        Series("disc index, paper (eq. 10)", UNIT, np.ones_like(sizes), theory=True),
    ]
    count, time = ({name: series.values for name, series in each.items()} for each in (counted, timed))
    return Findings(
        [
            series_table("moving_object_counts", SIZE, sizes, [*theory, *counted.values()]),
            series_table("moving_object_times", SIZE, sizes, list(timed.values())),
        ],
        _figures(sizes, [*theory, *counted.values()], list(timed.values()), settings),
        [
            paper_verdict(crossings(sizes, theory[0].values, theory[1].values)),
            count_verdict(sizes, count[CACHE]),
            real_verdict("tests; disc index, all rays", sizes, count[CACHE], count[INDEX]),
            real_verdict("tests; disc index, object's rays", sizes, count[CACHE], count[INDEX_OWN]),
            *(
                real_verdict(f"time; {name}", sizes, time[CACHE], time[name])
                for name in (INDEX_REBUILT, INDEX, INDEX_OWN_REBUILT, INDEX_OWN)
            ),
        ],
        [
            "The sphere cache gets the object's rays for nothing, as in the paper, where disc indexing pays "
            "for all rays. An update knows these rays, so that either method can have them; a rigid object "
            "keeps its index.",
            "A node of the index counts as 8 tests, one for each box, and a leaf as 8 disc tests.",
        ],
    )


def _object(size: float, seed: int, settings: Mapping[str, Any]) -> tuple[Samples, np.ndarray]:
    """Discs of an object somewhere in the unit sphere, and where its sphere stands."""
    rng = np.random.default_rng([seed, round(1e6 * size)])
    towards = rng.normal(size=3)
    centre = (1 - size) * rng.random() ** (1 / 3) * towards / np.linalg.norm(towards)
    unit = in_cube(settings["samples"], "volume", seed)
    return Samples(centre + size * unit.points, unit.normals, size * unit.radius), centre


def _own_rays(lines: Segments, centre: np.ndarray, radius: float) -> Segments:
    """Those that meet the object's sphere; chords of S_0 never end inside it."""
    away = lines.origin - centre
    along = (away * lines.direction).sum(axis=1, keepdims=True)
    return lines.select(((away - along * lines.direction) ** 2).sum(axis=1) <= radius**2)


def _cache(
    rays: Segments, samples: Samples, size: float, settings: Mapping[str, Any], threads: int | None
) -> Mapping[str, Any]:
    return sphere_cache(
        rays,
        samples,
        ratio=settings["ratio"],
        min_rays=settings["min_rays"],
        outer_sphere=((0, 0, 0), size),
        threads=threads,
    ).stats


def _index(rays: Segments, samples: Samples, threads: int | None) -> Mapping[str, Any]:
    return disc_index(rays, samples, threads=threads).stats


def _counts(size: float, seed: int, settings: Mapping[str, Any]) -> dict[str, float]:
    lines = uniform_lines(settings["lines"], seed)
    samples, centre = _object(size, seed, settings)
    own, threads = _own_rays(lines, centre, size), settings.get("threads")
    cache = _cache(own, samples, size, settings, threads)
    index, index_own = (
        BOXES * found["node_tests"] + found["disc_tests"]
        for found in (_index(lines, samples, threads), _index(own, samples, threads))
    )
    return {CACHE: cache["sphere_tests"] + cache["disc_tests"], INDEX: index, INDEX_OWN: index_own}


def _times(size: float, settings: Mapping[str, Any]) -> dict[str, Timing]:
    """Processor time of one frame by each way, handing the rays over left out."""
    seed = settings["seeds"][0]
    lines = uniform_lines(settings["lines"], seed)
    samples, centre = _object(size, seed, settings)
    own, one = _own_rays(lines, centre, size), lines.select(slice(0, 1))
    taken = interleaved(
        {
            "hand_all": lambda: core_segments(lines),
            "hand_own": lambda: core_segments(own),
            "build": lambda: _index(one, samples, 1),
            "cache": lambda: _cache(own, samples, size, settings, 1),
            "index": lambda: _index(lines, samples, 1),
            "index_own": lambda: _index(own, samples, 1),
        },
        settings["repetitions"],
    )
    rebuilt, own_rebuilt = taken["index"] - taken["hand_all"], taken["index_own"] - taken["hand_own"]
    return {
        CACHE: taken["cache"] - taken["hand_own"],
        INDEX_REBUILT: rebuilt,
        INDEX: rebuilt - taken["build"],
        INDEX_OWN_REBUILT: own_rebuilt,
        INDEX_OWN: own_rebuilt - taken["build"],
    }


# ---- verdicts -----------------------------------------------------------------------------------


def paper_verdict(found: Sequence[float]) -> Verdict:
    """Theorem 2 within the paper's own counts: eq. 16 has one crossover, near 0.35."""
    one = len(found) == 1 and abs(found[0] - PRINTED) < 0.01
    where = ", ".join(f"{x:.3f}" for x in found) or "nowhere"
    return Verdict(
        "By the paper's counts both methods cost the same at r_D / r_0 = 0.35 (Theorem 2, eq. 18).",
        "confirmed" if one else "refuted",
        f"The two sides of eq. 16 cross at {where}; exactly, at (12/97)^½ = {model.crossover():.3f}.",
    )


def count_verdict(sizes: np.ndarray, cache: np.ndarray) -> Verdict:
    """Whether a real sphere cache, against the paper's index at 1, crosses where the paper says."""
    found = crossings(sizes, cache, np.ones_like(cache))
    return Verdict(
        "A sphere cache that runs needs as many tests as eq. 10 gives disc indexing at r_D / r_0 = 0.35.",
        "confirmed" if _as_printed(found, cache) else "refuted",
        f"Tests of the exact sphere cache, in units of eq. 10: {cache[0]:.3f} at r_D / r_0 = {sizes[0]:g} to "
        f"{cache[-1]:.1f} at {sizes[-1]:g}; {_where(found)}.",
    )


def real_verdict(what: str, sizes: np.ndarray, cache: np.ndarray, index: np.ndarray) -> Verdict:
    """Theorem 2 for methods that run: is the sphere cache the cheaper one up to 0.35, and only there?"""
    both = np.isfinite(cache) & np.isfinite(index)
    claim = f"The sphere cache is cheaper for objects below 35 % of the scene, dearer above ({what})."
    if both.sum() < 2:
        return Verdict(claim, "open", "The times are too short to be told from their spread.")
    at, ratio = sizes[both], cache[both] / index[both]
    found = crossings(at, cache[both], index[both])
    return Verdict(
        claim,
        "confirmed" if _as_printed(found, ratio) else "refuted",
        f"Sphere cache over disc index: {ratio[0]:.2f} at r_D / r_0 = {at[0]:g}, {ratio[-1]:.2f} at "
        f"{at[-1]:g}, {ratio.min():.2f} to {ratio.max():.2f} in all; {_where(found)}.",
    )


def _as_printed(found: Sequence[float], ratio: np.ndarray) -> bool:
    """Whether the only crossover lies within a tenth of 0.35, the sphere cache being cheaper below it."""
    return len(found) == 1 and abs(found[0] / PRINTED - 1) < 0.1 and ratio[0] < 1


def _where(found: Sequence[float]) -> str:
    if not found:
        return "there is no crossover"
    return "they cross at r_D / r_0 = " + ", ".join(f"{x:.2f}" for x in found)


def _figures(
    sizes: np.ndarray, counted: Sequence[Series], timed: Sequence[Series], settings: Mapping[str, Any]
) -> list[Figure]:
    marks = [Mark(PRINTED, "eq. 18")]
    return [
        Figure(
            "moving_object_counts",
            f"Tests for {settings['samples']:,} samples of a moving object; {settings['lines']:,} uniform "
            f"lines; mean and standard error over seeds {settings['seeds']}.",
            SIZE_LABEL,
            "tests per ray and $n_D^{1/3}$",
            [series.curve(sizes) for series in counted],
            marks,
            log_x=True,
            log_y=True,
        ),
        Figure(
            "moving_object_times",
            f"Processor time of one frame, one thread, same inputs, seed {settings['seeds'][0]}; median and "
            f"its standard error over {settings['repetitions']} interleaved repetitions. Points that "
            "do not stand out of their spread are left out.",
            SIZE_LABEL,
            "time per frame (ms)",
            [series.curve(sizes) for series in timed],
            marks,
            log_x=True,
            log_y=True,
        ),
    ]


EXPERIMENT = Experiment(
    name="moving-object",
    title="A moving object: sphere cache or disc index",
    source="paper 3.2, Theorem 2, equations 15 to 18",
    question="Up to which size of a moving object is the sphere cache faster than disc indexing?",
    run=run,
    full={
        "seeds": [1, 2, 3, 4],
        "lines": 1_000_000,
        "samples": 10_000,
        "sizes": [0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0],
        "ratio": 2 / 3,
        "min_rays": 1,
        "repetitions": 5,
    },
    quick={
        "seeds": [1, 2],
        "lines": 100_000,
        "samples": 1000,
        "sizes": [0.05, 0.1, 0.2, 0.4, 0.7, 1.0],
        "repetitions": 3,
    },
    timed=True,
)
