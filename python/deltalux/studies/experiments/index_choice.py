# SPDX-License-Identifier: Apache-2.0
"""`index-choice`: which index over the discs costs least, and whether a few rays can find it (paper 2.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import deltalux.scenes
from deltalux.estimate import disc_index
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, trace, uniform_lines
from deltalux.studies.experiment import Cell, Curve, Experiment, Figure, Findings, Outcome, Table, Verdict
from deltalux.studies.indices import DiscGrid, RayCosts, kd_tree, octree
from deltalux.studies.progress_parts import Steps
from deltalux.studies.repeats import mean_and_error
from deltalux.studies.scene_samples import static_distance, uniform_on_surfaces
from deltalux.studies.seeds import Done, by_seed
from deltalux.studies.uniform_samples import in_cube

BVH = "BVH"
INDICES: dict[str, Callable[[Samples], Any]] = {"grid": DiscGrid, "octree": octree, "kd-tree": kd_tree}
NAMES = (BVH, *INDICES)
BOXES = 8  # boxes that a node of the disc index tests at once
CLOSE = 0.05  # largest extra cost of a good choice
SURE = 0.95  # share of simulations that must choose well


def _clustered(count: int, seed: int) -> Samples:
    """Half of the samples in a cube 1/20 as wide as that of the others, like a detailed object in a hall."""
    samples = in_cube(count, "volume", seed)
    shrink = np.where(np.arange(count) % 2, 0.05, 1.0)
    return Samples(samples.points * shrink[:, None], samples.normals, samples.radius * shrink)


LINES: dict[str, Callable[[int, int], Samples]] = {
    "cube": lambda count, seed: in_cube(count, "volume", seed),
    "walls": lambda count, seed: in_cube(count, "surface", seed),
    "cluster": _clustered,
}

Costs = dict[str, list[float]]  # index -> mean cost per ray, for each seed


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Count the work of every index on all rays, and on many small shares of them."""
    steps = Steps(progress, (len(LINES) + len(settings["scenes"])) * len(settings["seeds"]))
    rows = by_seed(partial(_of_seed, settings=settings), settings["seeds"], steps)
    costs: dict[str, Costs] = {
        case: {name: [row[case].costs[name] for row in rows] for name in NAMES} for case in rows[0]
    }
    # case -> `extra_cost` of each simulation
    extra = {case: [cost for row in rows for cost in row[case].extra] for case in rows[0]}
    same = all(found.same for row in rows for found in row.values())
    return Findings(
        [_cost_table(costs), _choice_table(extra)],
        [_figure(costs, settings)],
        [same_verdict(same), choice_verdict(extra, settings["reduction"]), best_verdict(costs)],
        [
            "Cost = box tests (octree, kd-tree, BVH) or cells (grid) + disc tests per ray, one as dear as "
            "the other, until the first hit. A disc that lies in several cells is tested in each of them. A "
            "node of the BVH counts as 8 tests, a leaf as 8 disc tests, which the processor does at once: by "
            "time it stands better than shown.",
        ],
    )


@dataclass(frozen=True)
class _Found:
    """Of a case and seed: mean cost by index, `extra_cost` of each simulation, whether all sums are equal."""

    costs: dict[str, float]
    extra: list[float]
    same: bool


def _of_seed(seed: int, done: Done, settings: Mapping[str, Any]) -> dict[str, _Found]:
    """What is found in each case."""
    cases = {}
    for case, segments, samples in _inputs(seed, settings):
        exact = disc_index(segments, samples, segment_end="first").sums
        assert exact is not None  # of a disc method
        found = {name: build(samples).cast(segments, samples) for name, build in INDICES.items()}
        same = all(bool((one.sums == exact).all()) for one in found.values())
        everything = _mean_costs(found, segments, samples, np.arange(len(segments)))
        rng = np.random.default_rng(seed)
        few = max(1, round(len(segments) / settings["reduction"]))
        extra = []
        for _ in range(settings["simulations"]):
            rays = rng.choice(len(segments), few, replace=False)
            guess = _mean_costs(found, segments, samples, rays)
            extra.append(extra_cost(guess, everything))
        cases[case] = _Found(dict(everything), extra, same)
        done()
    return cases


def _inputs(seed: int, settings: Mapping[str, Any]) -> Iterator[tuple[str, Segments, Samples]]:
    """Case, segments and samples in turn."""
    count = settings["samples"]
    for name, samples_of in LINES.items():
        yield name, uniform_lines(settings["rays"], seed), samples_of(count, seed)
    for name in settings["scenes"]:
        scene = getattr(deltalux.scenes, name)()
        radius = static_distance(scene, count)
        segments = trace(scene, settings["rays"], seed, threads=settings.get("threads"))
        some = np.random.default_rng(seed).choice(len(segments), settings["rays"], replace=False)
        samples = uniform_on_surfaces(scene, count, seed, radius, movables=False)
        yield name, segments.select(np.sort(some)), samples


def _mean_costs(
    found: Mapping[str, RayCosts], segments: Segments, samples: Samples, rays: np.ndarray
) -> dict[str, float]:
    """Mean cost of some of the rays in each index."""
    stats = disc_index(segments.select(rays), samples, segment_end="first").stats
    bvh = (BOXES * stats["node_tests"] + stats["disc_tests"]) / len(rays)
    own = {name: float((one.steps[rays] + one.tests[rays]).mean()) for name, one in found.items()}
    return {BVH: bvh, **own}


def extra_cost(guess: Mapping[str, float], truth: Mapping[str, float]) -> float:
    """Relative extra cost of the index that a simulation finds cheapest over the truly cheapest one."""
    chosen = min(guess, key=lambda name: guess[name])
    return truth[chosen] / min(truth.values()) - 1


def well_chosen(extra: Sequence[float]) -> float:
    """Share of the simulations whose choice costs at most `CLOSE` more than the best."""
    return float((np.array(extra) <= CLOSE).mean())


# ---- verdicts -----------------------------------------------------------------------------------


def same_verdict(same: bool) -> Verdict:
    """Whether all indices find the same crossings."""
    return Verdict(
        "Grid, octree, kd-tree and BVH find the same crossings.",
        "confirmed" if same else "refuted",
        f"The integer sums of all discs are {'equal' if same else 'not equal'} in all cases, with all seeds.",
    )


def choice_verdict(extra: Mapping[str, Sequence[float]], reduction: float) -> Verdict:
    """Whether a simulation with few rays makes a good choice (`well_chosen`)."""
    shares = {case: well_chosen(values) for case, values in extra.items()}
    worst = max(max(values) for values in extra.values())
    parts = ", ".join(f"{case} {share:.0%}" for case, share in shares.items())
    return Verdict(
        "A simulation with few rays is enough to choose the index (paper 2.4, after Revelles et al. 2003).",
        "confirmed" if min(shares.values()) >= SURE else "refuted",
        f"With 1/{reduction:g} of the rays the index chosen costs at most {CLOSE:.0%} more than the best in "
        f"{parts} of the simulations; at worst {worst:.1%} more.",
    )


def best_verdict(costs: Mapping[str, Costs]) -> Verdict:
    """Whether one index is cheapest everywhere, so that no choice is needed."""
    parts, winners = [], set()
    clear = all(len(values) > 1 for own in costs.values() for values in own.values())  # else no error
    for case, own in costs.items():
        found = {name: _mean_error(values) for name, values in own.items()}
        first, second = sorted(found, key=lambda name: found[name][0])[:2]
        (least, error), (next_least, next_error) = found[first], found[second]
        clear = clear and next_least - least > 2 * float(np.hypot(error, next_error))
        winners.add(first)
        parts.append(f"{case}: {first} ({', '.join(f'{name} {found[name][0]:.0f}' for name in found)})")
    outcome: Outcome = "open"
    if clear:
        outcome = "confirmed" if len(winners) > 1 else "refuted"
    return Verdict(
        "Which index is best depends on the scene (paper 2.4, after Havran & Purgathofer 2003).",
        outcome,
        f"Cheapest index and tests per ray: {'; '.join(parts)}.",
    )


# ---- tables and figures -------------------------------------------------------------------------


def _cost_table(costs: Mapping[str, Costs]) -> Table:
    rows: list[list[Cell]] = [
        [case, name, *_mean_error(values)] for case, own in costs.items() for name, values in own.items()
    ]
    return Table("index_choice_costs", ["case", "index", "tests per ray", "standard error"], rows)


def _choice_table(extra: Mapping[str, Sequence[float]]) -> Table:
    rows: list[list[Cell]] = [
        [
            case,
            len(values),
            well_chosen(values),
            float(np.mean(values)),
            float(max(values)),
        ]
        for case, values in extra.items()
    ]
    columns = ["case", "simulations", f"share within {CLOSE:.0%} of the best", "mean extra cost", "worst"]
    return Table("index_choice_simulations", columns, rows)


def _figure(costs: Mapping[str, Costs], settings: Mapping[str, Any]) -> Figure:
    places = [float(k) for k in range(1, len(costs) + 1)]
    curves = []
    for name in NAMES:
        means, errors = zip(*(_mean_error(own[name]) for own in costs.values()), strict=True)
        curves.append(Curve(name, places, list(means), list(errors), "bars"))
    cases = " · ".join(f"{k} {case}" for k, case in enumerate(costs, 1))
    return Figure(
        "index_choice",
        f"Tests per ray in four indices over {settings['samples']:,} discs; {settings['rays']:,} rays, "
        f"uniform lines but for the scenes; mean and standard error over seeds {settings['seeds']}.",
        cases,
        "box and disc tests per ray",
        curves,
    )


def _mean_error(values: Sequence[float]) -> tuple[float, float]:
    mean, error = mean_and_error(np.array(values)[:, None])
    return mean[0], 0.0 if error is None else error[0]


EXPERIMENT = Experiment(
    name="index-choice",
    title="Choosing the index by a simulation",
    source="paper 2.4",
    question="Which spatial index over the discs costs least, and does a simulation with few rays find it?",
    run=run,
    full={
        "seeds": [1, 2, 3],
        "rays": 50_000,
        "samples": 10_000,
        "scenes": ["atrium", "expo"],
        "reduction": 100,
        "simulations": 30,
    },
    quick={
        "seeds": [1, 2],
        "rays": 3000,
        "samples": 600,
        "scenes": ["expo"],
        "simulations": 5,
        "reduction": 30,
    },
)
