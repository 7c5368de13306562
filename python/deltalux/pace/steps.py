# SPDX-License-Identifier: Apache-2.0
"""Forecasts of the steps of each job from counts, in seconds of one processor of one machine.

The weights were measured with `benchmarks/eta.py --fit` on the bundled scenes. Other machines are faster
or slower as a whole, and other scenes in some steps: `Overall` corrects for that while the job runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from .overall import PARALLEL, Step

MORE_RAYS = 1.2  # mean rays of a sample over those requested: samples in noisy light cast more
PILOT_RAYS = 0.25  # share of a sample's rays that estimates its noise
THREADS = 0.8  # exponent: n threads are n to this power times as fast as one
SIMPLE = 5.75  # depth of the simplest scene that was measured
EDGES = 0.018  # share of pixels at edges in the simplest scene
POINT = 0.1  # a lamp without extent counts as this share of a luminous surface
MOST_PATHS = 1 << 20  # of those by which guides are chosen
PILOTS = frozenset({"ray map", "estimate"})  # stages that pilots of methods report


@dataclass(frozen=True)
class Counts:
    """Size of a job.

    Parameters
    ----------
    triangles, samples, paths : numbers of these in the scene and its session
    rays : gather rays per sample; 0 = no gather
    lights : number of luminous surfaces; a lamp without extent, which takes one shadow ray, counts 0.1
    suns : number of suns
    pixels : pixels of a picture; 0 = pictures show samples
    edges : share of the pixels that lie at edges of surfaces; None = not known yet
    threads : number of threads
    workers : number of processes that share the paths; 0: this one has them
    """

    triangles: int
    samples: int = 60_000
    paths: int = 300_000
    rays: int = 256
    lights: float = 4
    suns: int = 0
    pixels: int = 960 * 600
    edges: float | None = None
    threads: int = 1
    workers: int = 0

    @property
    def depth(self) -> float:
        """Levels of a tree over the triangles, which determine the cost of a ray."""
        return math.log2(max(2, self.triangles))

    @property
    def all_rays(self) -> float:
        """Expected gather rays of all samples."""
        return MORE_RAYS * self.samples * self.rays

    @property
    def stored(self) -> float:
        """Approximate size of the session file, bytes."""
        return 200.0 * self.paths + 45.0 * self.all_rays + 400.0 * self.samples + 100.0 * self.triangles


@dataclass(frozen=True)
class Stored:
    """A session file.

    Parameters
    ----------
    counts : counts of its session
    size, ray_bytes : bytes of the file, and of the rays in it
    """

    counts: Counts
    size: float
    ray_bytes: float


def _timed(steps: Iterable[Step], counts: Counts) -> list[Step]:
    """The steps, with the times of parallel ones divided by the speed-up of `counts.threads`."""
    faster = max(1, counts.threads) ** THREADS
    return [replace(s, seconds=s.seconds / faster) if s.kind in PARALLEL else s for s in steps]


def bundled(name: str) -> Counts:
    """Approximate counts of a bundled scene, before it is built."""
    return Counts({"atrium": 233_000, "expo": 30_000, "office": 15_000}.get(name, 1000))


def loading(counts: Counts) -> list[Step]:
    """Steps that read a scene and place samples on it."""
    dense = 2.0 * (1 - math.exp(-counts.triangles / 1e4))  # search for surfaces that touch
    return [
        Step("load scene", 0.02 + 3e-6 * counts.triangles),
        Step("place samples", 0.1 + dense + 1.5e-5 * counts.triangles + 1e-5 * counts.samples),
    ]


def _discs(c: Counts, radius: float) -> list[Step]:
    """Steps that make discs, which few sessions that gather need; `radius`: seconds to choose that of one."""
    needed = 0.0 if c.rays else 1.0
    return [
        Step("disc radii", needed * radius * c.samples, "rays"),
        Step("discs", needed * (0.02 + 6e-7 * c.depth * c.samples), "once"),
    ]


def opening(stored: Stored, calibrated: bool = True) -> list[Step]:
    """Steps that open a session file; `calibrated`: whether the machine's constants are known."""
    c = stored.counts
    return [
        Step("open session", 0.05 + 0.1e-9 * stored.size + 1e-6 * c.triangles, "disk"),
        _calibrating(calibrated or bool(c.rays)),
        Step("index triangles", 0.01 + 8e-7 * c.triangles),
        *_discs(c, 1e-7),
        Step("pilot", 0.0 if c.rays else 0.05, "once"),
        _planning(),
        _dividing(c),
        Step("restore segments", 5e-9 * (stored.size - stored.ray_bytes), "disk"),
        Step("cover cells", 0.05 + 2e-6 * c.triangles),
        Step("restore rays", 2.5e-9 * stored.ray_bytes, "disk"),
        *_shared(c),
    ]


def baking(counts: Counts, calibrated: bool = True) -> list[Step]:
    """Steps that make and bake a session; `calibrated`: whether the machine's constants are known."""
    c = counts
    steps = [
        Step("make session", 0.01 + 6e-7 * (c.triangles + c.samples)),
        _calibrating(calibrated or bool(c.rays)),
        Step("index triangles", 0.01 + 8e-7 * c.triangles),
        _dividing(c),
        Step("pilot", 0.05, "once"),
        Step("find windows", 0.4 * c.suns, "once"),
        Step("find what large lights light", 0.0, "once"),  # of skies: some tenths of a second
        *_discs(c, 9 * _ray(c)),
    ]
    if not c.rays and not c.workers:
        steps.append(Step("openness", _openness(c), "rays"))
    steps.append(_planning())
    noisy = Step("find noisy places", 1.2 * PILOT_RAYS * _ray(c) * c.samples * c.rays, "rays")
    if c.rays:
        pilots = _path(c) * min(c.paths, MOST_PATHS)
        steps += [
            Step("find what lamps light", 0.1 + 3e-5 * c.triangles + pilots, "paths"),
            Step("find bright places", 0.025 * c.depth, "rays"),
            Step("find openings", 8e4 * _ray(c), "rays"),
            *([] if c.workers else [noisy]),
        ]
    steps += [
        Step("trace paths", 0.0 if c.workers else _path(c) * c.paths, "paths"),
    ]
    shared = [Step("direct light", _shadow(c) * c.samples, "shadows")]  # by workers, if there are any
    if c.rays:
        shared += [
            *([noisy] if c.workers else []),
            Step("share rays", 0.0 if c.workers else 1e-5 * c.samples, "once"),  # workers share as they find
            Step("cover cells", 0.05 + 2e-6 * c.triangles, "rays"),
            Step("cast gather rays", _ray(c) * c.all_rays, "rays"),
        ]
    everyone = replace(c, threads=max(c.threads, c.workers))
    return [*_starting(c), *_timed(steps, c), *_shared(c), *_timed(shared, everyone)]


def _starting(c: Counts) -> list[Step]:
    """Step that starts worker processes, or finds those of a cluster."""
    return [Step("start workers", 2.0 + 0.5 * c.workers, "once")] if c.workers else []


def _shared(c: Counts) -> list[Step]:
    """Step in which all workers trace their paths, after they prepared as a bake does."""
    if not c.workers:
        return []
    own = 1.0 + 2e-6 * c.triangles + 6e-7 * c.depth * c.samples
    shared = _path(c) * c.paths + (0.0 if c.rays else _openness(c))
    faster = max(1, c.workers, c.threads) ** THREADS
    return [Step("trace shards", own + shared / faster, "paths")]


def _openness(c: Counts) -> float:
    return 2e-6 * c.depth * c.samples


def _calibrating(calibrated: bool) -> Step:
    """Step in which the first session of a build on a machine measures the cost of tests there."""
    return Step("calibrate", 0.0 if calibrated else 0.9, "once", PILOTS)


def _dividing(c: Counts) -> Step:
    """Step that divides surfaces into the cells that gather rays read."""
    return Step("divide surfaces", 0.05 + 2e-5 * c.triangles if c.rays else 0.0)


def _planning() -> Step:
    return Step("plan", 0.05, "once", PILOTS)


def updating(counts: Counts) -> list[Step]:
    """Steps that apply edits of small objects to an open session."""
    c = counts
    steps = [
        Step("find affected paths", 1e-8 * c.paths, "edit"),
        Step("replace paths", 0.03 * _path(c) * c.paths, "edit"),
        Step("direct light", 0.3 * _shadow(c) * c.samples, "edit"),
        Step("cast gather rays", 0.08 * _ray(c) * c.all_rays, "edit"),
    ]
    return _timed(steps, c)


def recomputing(counts: Counts) -> list[Step]:
    """Steps that recompute an open session."""
    prepared = ("index triangles", "divide surfaces", "trace paths", "direct light")
    again = (*prepared, "share rays", "cover cells", "cast gather rays")
    return [step for step in baking(counts) if step.name in again]


def drawing(counts: Counts, rays: int = 0) -> list[Step]:
    """Steps that draw a picture with light per pixel, of `rays` gather rays each (0 = as the session has)."""
    c, rays = counts, rays or min(counts.rays or 192, 192)
    # If the share of edges is unknown: more triangles have more edges.
    edges = EDGES * (c.depth / SIMPLE) ** 1.9 if c.edges is None else c.edges
    dear = c.pixels * rays / 192 * _ray(c)
    steps = [
        Step("view", 0.3 + 7e-7 * c.pixels + 1e-6 * c.triangles),
        Step("direct light", (1.4e-6 + 0.35 * _shadow(c)) * c.pixels, "shadows"),
        Step("indirect light", 1.6e-6 * c.pixels + (4 + 50 * edges + 400 * edges**2) * dear, "rays"),
        Step("edges", 6e-7 * c.pixels + (8 * edges + 600 * edges**2) * dear, "rays"),
        Step("finish picture", 6e-7 * c.pixels),
    ]
    return _timed(steps, c)


def writing(counts: Counts, suffixes: Sequence[str]) -> list[Step]:
    """Steps that write result files with these suffixes, in order."""
    steps: list[Step] = []
    if counts.pixels and counts.rays and {".dlx", ".glb"} & set(suffixes):
        steps.append(_refining(counts))
    for suffix in suffixes:
        if suffix == ".dlx":
            steps.append(Step("save session", 2.5e-9 * counts.stored, "disk"))
            continue
        if suffix == ".png" and counts.pixels and counts.rays:
            steps += drawing(counts)
        one = {".png": 1.0, ".glb": 6e-6 * (counts.samples + counts.triangles)}.get(
            suffix, 3e-6 * counts.samples
        )
        steps.append(Step(f"write {suffix}", 0.05 + one))
    return steps


def _refining(c: Counts) -> Step:
    """Step that refines the display mesh at edges of shadows: it tests six or seven places per sample."""
    return _timed([Step("refine shadows", 0.05 + (6.5 * _shadow(c) + 8e-5) * c.samples, "shadows")], c)[0]


def summing_up(counts: Counts) -> list[Step]:
    """Step that reads the light and errors of all samples and summarises them."""
    return [Step("sum up", 0.05 + 4e-8 * counts.all_rays + 3e-6 * counts.samples)]


def _ray(c: Counts) -> float:
    """Seconds per gather ray, chains included."""
    return 3.8e-7 * (c.depth / SIMPLE) ** 1.45


def _path(c: Counts) -> float:
    """Seconds per path, deposits included: into cells, or into discs, of which more overlap more."""
    return 1e-6 * (0.7 + 0.15 * c.depth) * (1 if c.rays else 1 + 3e-5 * c.samples)


def _shadow(c: Counts) -> float:
    """Seconds for the direct light of all lamps at one place; lamps of one kind share work."""
    return 2.1e-7 * (2 + 2 * c.depth) * math.sqrt(max(POINT, c.lights))
