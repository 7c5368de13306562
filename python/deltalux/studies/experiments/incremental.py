# SPDX-License-Identifier: Apache-2.0
"""`incremental`: cost of an update and what it changes, over size and number of objects (paper 3.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import deltalux.scenes
from deltalux.model import affected_rays
from deltalux.scene import Scene
from deltalux.scenes import shapes
from deltalux.segments import Progress
from deltalux.session import Session
from deltalux.studies.curves import agreement, power_law
from deltalux.studies.experiment import Experiment, Figure, Findings, Outcome, Verdict
from deltalux.studies.measuring import measured
from deltalux.studies.moved_scene import shifted
from deltalux.studies.progress_parts import Steps
from deltalux.studies.scene_samples import uniform_on_surfaces
from deltalux.studies.seeds import Done, by_seed
from deltalux.studies.series import Series, series_table
from deltalux.studies.timing import Timing, median

SIZE, SIZE_LABEL, OBJECTS = "object's size r_D / r_0", "object's size $r_D / r_0$", "moving objects"
TROLLEY, STEP = "trolley", (0.1, 0.0, 0.0)  # metres per frame
BALL_RADIUS, BALL_HEIGHT, BALL_ROW = 0.25, 3.2, (-8.0, 8.0)  # metres; in the free air of the hall
SLOPE, ADDS_UP = 0.2, 0.1  # largest accepted deviation of an exponent, of a sum


@dataclass(frozen=True)
class Frames:
    """Updates of one scene with each seed.

    Attributes
    ----------
    paths, segments : (seeds,) shares affected or removed, mean over the frames
    update, full : processor time of an update and of a full frame
    exact : whether every digest after an update equalled that of a full computation
    """

    paths: list[float]
    segments: list[float]
    update: Timing
    full: Timing
    exact: bool


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Move the atrium's trolley in several sizes, the expo's exhibit, and a row of balls in its hall."""
    sizes, objects = (np.array(settings[name], float) for name in ("sizes", "objects"))
    steps = Steps(progress, len(settings["seeds"]) * (len(sizes) + 2))
    trolley = []
    for size in settings["sizes"]:
        scene = deltalux.scenes.atrium(settings["detail"], trolley_size=size)
        trolley += _frames(scene, [[TROLLEY]], settings, steps)
    scene, names = _hall(max(settings["objects"]))
    groups = [names[:count] for count in settings["objects"]]
    found = _frames(scene, [*groups, *([name] for name in names)], settings, steps)
    balls, alone = found[: len(groups)], np.array([one.paths for one in found[len(groups) :]])
    exhibit = _frames(deltalux.scenes.expo(), [["exhibit"]], settings, steps)
    sums = np.array([alone[:count].sum(axis=0) for count in settings["objects"]])
    summed = Series.of_seeds("affected paths, each object alone, summed", "1", sums.T)
    every = [*trolley, *found, *exhibit]
    share = Series("r_D² / r_0² (eq. 11)", "1", affected_rays(1, sizes, 1.0), theory=True)
    return Findings(
        [
            series_table("incremental_size", SIZE, sizes, [share, *_series(trolley)]),
            series_table(
                "incremental_objects",
                OBJECTS,
                objects,
                [*_series(balls), summed],
            ),
            series_table("incremental_exhibit", OBJECTS, np.ones(1), _series(exhibit)),
        ],
        _figures((sizes, trolley, share), (objects, balls, summed), settings),
        [
            exact_verdict([frames.exact for frames in every]),
            law_verdict(sizes, [float(np.mean(frames.segments)) for frames in trolley]),
            faster_verdict([frames.update for frames in every], [frames.full for frames in every]),
            sum_verdict(objects, np.array([frames.paths for frames in balls]), sums),
        ],
        [
            "Removed segments are those that ended on the object, or that its new place cuts, and everything "
            "that came after them on their paths.",
            "A full frame computes everything again in the present state; preparations that a session makes "
            "once are in neither time.",
        ],
    )


# ---- scenes -------------------------------------------------------------------------------------


def _hall(count: int) -> tuple[Scene, list[str]]:
    """The expo's hall with a row of `count` movable balls, and their names."""
    scene = deltalux.scenes.expo()
    names = [f"ball_{k + 1}" for k in range(count)]
    for name, x in zip(names, np.linspace(*BALL_ROW, count + 2)[1:-1], strict=True):
        ball = shapes.sphere(BALL_RADIUS, 24, "lacquer")
        scene = scene.with_mesh(ball.mesh(name, at=(float(x), BALL_HEIGHT, 1.0), movable=True))
    return scene, names


def _frames(
    scene: Scene, groups: Sequence[Sequence[str]], settings: Mapping[str, Any], steps: Steps
) -> list[Frames]:
    """Frames of each group of objects in turn; objects move away in half of them, then back."""
    samples = uniform_on_surfaces(scene, settings["samples"], 1, None)

    def animated(seed: int, done: Done) -> list[_Run]:
        options: dict[str, Any] = {"paths": settings["paths"], "seed": seed, "direct": "paths", "threads": 1}
        with Session(scene, samples, **options, gather="off") as session:
            session.bake()
            runs = [_animate(session, group, settings["frames"]) for group in groups]
        done()
        return runs

    runs = zip(*by_seed(animated, settings["seeds"], steps), strict=True)
    return [
        Frames(
            [one.paths / settings["paths"] for one in own],
            [one.segments for one in own],
            median([seconds for one in own for seconds in one.updates]),
            median([one.full for one in own]),
            all(one.exact for one in own),
        )
        for own in runs
    ]


@dataclass(frozen=True)
class _Run:
    """Frames of one group in one session: means, and times in seconds."""

    paths: float
    segments: float
    updates: list[float]
    full: float
    exact: bool


def _animate(session: Session, names: Sequence[str], frames: int) -> _Run:
    paths, segments, updates = [], [], []
    for number in range(frames):
        before = session.statistics["segments"]
        offset = STEP if number < frames / 2 else [-x for x in STEP]
        for name in names:
            session.move(name, shifted(session.pose(name), offset))
        taken = measured(session.update)
        updates.append(taken.cpu_seconds)
        paths.append(taken.value.affected_paths)
        segments.append(taken.value.removed_segments / before)
    digest = session.digest()
    full = measured(session.recompute).cpu_seconds
    exact = session.digest() == digest
    return _Run(float(np.mean(paths)), float(np.mean(segments)), updates, full, exact)


# ---- verdicts -----------------------------------------------------------------------------------


def exact_verdict(exact: Sequence[bool]) -> Verdict:
    """Whether updates give the same bits as a full computation."""
    return Verdict(
        "After the last update the digest equals that of a full computation.",
        "confirmed" if all(exact) else "refuted",
        f"Equal in {sum(exact)} of {len(exact)} animations, each with all seeds.",
    )


def law_verdict(sizes: np.ndarray, removed: Sequence[float]) -> Verdict:
    """Whether the share of segments that a move removes grows with the square of the size (eq. 11)."""
    found, error = power_law(sizes, removed)
    ratio = np.array(removed) / affected_rays(1, sizes, 1.0)
    return Verdict(
        "The number of affected segments grows as r_D² / r_0² (paper, eq. 11).",
        agreement(found, error, 2, SLOPE),
        f"Exponent {found:.2f} ± {error:.2f}, within {SLOPE:g} it agrees; the share itself is "
        f"{ratio.min():.2f} to {ratio.max():.2f} times that of eq. 11, which supposes uniform lines.",
    )


def faster_verdict(update: Sequence[Timing], full: Sequence[Timing]) -> Verdict:
    """Whether an update is faster than a full frame everywhere."""
    ratios = np.array([b.over(a) for a, b in zip(update, full, strict=True)])
    low = ratios[:, 0] - 2 * ratios[:, 1]
    outcome: Outcome = "open"
    if (low > 1).all():
        outcome = "confirmed"
    elif (ratios[:, 0] < 1).any():
        outcome = "refuted"
    return Verdict(
        "An update is faster than a full frame (paper 3).",
        outcome,
        f"Full frame over update, processor time: {ratios[:, 0].min():.1f} to {ratios[:, 0].max():.0f}.",
    )


def sum_verdict(objects: np.ndarray, together: np.ndarray, alone: np.ndarray) -> Verdict:
    """Whether objects affect as much together as one by one; shares (objects, seeds)."""
    ratio = together.mean(axis=1) / alone.mean(axis=1)
    return Verdict(
        "Several moving objects affect as many paths as they do one by one.",
        "confirmed" if (np.abs(ratio - 1) <= ADDS_UP).all() else "refuted",
        f"Affected paths together over the sum of each alone: {ratio.min():.2f} to {ratio.max():.2f}; within "
        f"{ADDS_UP:.0%} they add up. All {objects[-1]:.0f} affect {together[-1].mean():.1%} of all paths.",
    )


# ---- tables and figures -------------------------------------------------------------------------


def _series(frames: Sequence[Frames]) -> list[Series]:
    return [
        Series.of_seeds("affected paths", "1", np.array([one.paths for one in frames]).T),
        Series.of_seeds("removed segments", "1", np.array([one.segments for one in frames]).T),
        Series.of_times("update", [one.update for one in frames]),
        Series.of_times("full frame", [one.full for one in frames]),
    ]


def _figures(
    size: tuple[np.ndarray, Sequence[Frames], Series],
    objects: tuple[np.ndarray, Sequence[Frames], Series],
    settings: Mapping[str, Any],
) -> list[Figure]:
    how = (
        f"{settings['paths']:,} paths, {settings['samples']:,} samples, {settings['frames']} frames, seeds "
        f"{settings['seeds']}"
    )
    figures = []
    for name, what, column, (x, frames, expected) in (
        ("size", "The atrium's trolley in several sizes", SIZE_LABEL, size),
        ("objects", f"Balls of {2 * BALL_RADIUS:g} m in the expo's hall", OBJECTS, objects),
    ):
        paths, segments, update, full = _series(frames)
        for kind, label, shown, errors in (
            ("share", "share of all", [paths, segments, expected], "mean and standard error over seeds"),
            ("time", "time (ms)", [update, full], "processor time, one thread; median, its standard error"),
        ):
            figures.append(
                Figure(
                    f"incremental_{name}_{kind}",
                    f"{what}, {STEP[0]:g} m a frame: {how}; {errors}.",
                    column,
                    label,
                    [series.curve(x) for series in shown],
                    log_x=True,
                    log_y=True,
                )
            )
    return figures


EXPERIMENT = Experiment(
    name="incremental",
    title="Updates against full frames",
    source="paper 1.1, 3 and 3.2, equation 11",
    question="How do the cost of an update and what it changes follow size and number of moving objects?",
    run=run,
    full={
        "seeds": [1, 2, 3],
        "paths": 100_000,
        "samples": 50_000,
        "detail": 1.0,
        "sizes": [0.01, 0.02, 0.03, 0.05, 0.08, 0.12],
        "objects": [1, 2, 4, 8],
        "frames": 8,
    },
    quick={
        "seeds": [1, 2],
        "paths": 5000,
        "samples": 500,
        "detail": 0.5,
        "sizes": [0.03, 0.06, 0.12],
        "objects": [1, 2],
        "frames": 2,
    },
    timed=True,
)
