# SPDX-License-Identifier: Apache-2.0
"""`amortisation`: number of frames after which a kept index and stored paths pay off (paper 3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

import deltalux.scenes
from deltalux.estimate import disc_index, sphere_cache
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, trace
from deltalux.session import Session
from deltalux.studies.experiment import Cell, Experiment, Figure, Findings, Table, Verdict
from deltalux.studies.measuring import measured
from deltalux.studies.moved_scene import changed_segments, joined, shifted, with_moved
from deltalux.studies.progress_parts import Steps
from deltalux.studies.scene_samples import static_distance, uniform_on_surfaces
from deltalux.studies.series import Series
from deltalux.studies.timing import Timing, interleaved, median, repeated

SMALL_FRAMES, LARGE_FRAMES = 180, 7000  # frames in the paper's earlier work
MOVABLE, STEP = "trolley", (0.1, 0.0, 0.0)  # metres per frame
PATHS = "light paths"
SESSION_TIMES = {
    "first frame": "first frame, with preparations",
    "full frame": "full frame",
    "trace": "tracing within it",
    "update": "update",
}


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Time one frame of the atrium's moving trolley by each method, at each radius and number of paths."""
    paths = list(settings["paths"])
    steps = Steps(progress, 2 * len(paths))
    scene = deltalux.scenes.atrium(settings["detail"])
    index: list[list[dict[str, Timing]]] = []  # (paths, widths)
    stored: list[dict[str, Timing]] = []
    changed = []
    for count in paths:
        segments = _changed(scene, count, settings)
        changed.append(len(segments))
        index.append([_index_times(scene, segments, width, settings) for width in settings["widths"]])
        steps.done()
        stored.append(_session_times(scene, count, settings))
        steps.done()
    frames = np.array([[index_frames(cell) for cell in row] for row in index])  # (paths, widths, 2)
    payback = np.array([stored_frames(row) for row in stored])
    return Findings(
        [_index_table(settings, changed, index, frames), _stored_table(paths, stored, payback)],
        [_index_figure(paths, frames, settings), _stored_figure(paths, stored, settings)],
        [
            small_verdict(frames[0, 0]),
            growth_verdict(frames[..., 0]),
            stored_verdict(paths, payback),
        ],
        [
            "The paper's 180 and 7,000 frames come from earlier work on other scenes, machines and programs; "
            "what can agree is their order of magnitude and their trend.",
            "An index pays after (time to build it) / (frame by the sphere cache − frame by the index) "
            "frames. Both search the same old and new segments of one move; neither keeps anything else.",
            "A frame without stored paths is given the tracing of its paths only, as if finding what they "
            "cross cost nothing; the frames of the last verdict are therefore an upper bound. What both need "
            "once (the scene's index, the discs' areas) is left out.",
        ],
    )


# ---- measurements -------------------------------------------------------------------------------


def _changed(scene: Any, paths: int, settings: Mapping[str, Any]) -> Segments:
    """Old and new segments of one move."""
    seed, threads = settings["seeds"][0], settings.get("threads")
    before = trace(scene, paths, seed, threads=threads)
    after = trace(with_moved(scene, MOVABLE, STEP), paths, seed, threads=threads)
    return joined(*changed_segments(before, after))


def _index_times(
    scene: Any, segments: Segments, width: float, settings: Mapping[str, Any]
) -> dict[str, Timing]:
    count = settings["samples"]
    radius = width * static_distance(scene, count)
    samples = uniform_on_surfaces(scene, count, settings["seeds"][0], radius, movables=False)
    one = segments.select(slice(0, 1))
    many, copies = repeated(segments)
    taken = interleaved(
        {
            "build": lambda: disc_index(one, samples, threads=1),
            "whole": lambda: disc_index(many, samples, threads=1),
            "sphere cache": lambda: sphere_cache(segments, samples, threads=1),
        },
        settings["repetitions"],
    )
    search = (taken["whole"] - taken["build"]) / copies
    return {
        "build": taken["build"],
        "disc index": search,
        "sphere cache": taken["sphere cache"],
        "saved": taken["sphere cache"] - search,
    }


def _session_times(scene: Any, paths: int, settings: Mapping[str, Any]) -> dict[str, Timing]:
    """First frame, update and full frame of a session; `trace` is the share of tracing in the full frame."""
    samples: Samples = uniform_on_surfaces(scene, settings["samples"], settings["seeds"][0], None)
    first, updates, full, tracing = [], [], [], []
    for _ in range(settings["sessions"]):
        with Session(
            scene, samples, paths=paths, seed=settings["seeds"][0], threads=1, direct="paths", gather="off"
        ) as session:
            first.append(measured(session.bake).cpu_seconds)
            for _ in range(settings["repetitions"]):
                session.move(MOVABLE, shifted(session.pose(MOVABLE), STEP))
                updates.append(measured(session.update).cpu_seconds)
                again = measured(session.recompute)
                full.append(again.cpu_seconds)
                stages = again.value.milliseconds  # wall-clock, used for ratios only
                tracing.append(again.cpu_seconds * stages["trace"] / sum(stages.values()))
    taken = {"first frame": first, "update": updates, "full frame": full, "trace": tracing}
    return {name: median(values) for name, values in taken.items()}


def index_frames(times: Mapping[str, Timing]) -> tuple[float, float]:
    """Frames after which an index has paid for its build, and their standard error; inf = never."""
    build, saved = times["build"], times["saved"]
    return build.over(saved) if saved.known else (np.inf, 0.0)


def stored_frames(times: Mapping[str, Timing]) -> float:
    """Frames, the first included, after which stored paths have paid at the latest; inf = never."""
    saved = times["trace"] - times["update"]
    if not saved.known:
        return np.inf
    return float(1 + np.ceil((times["full frame"].seconds - times["trace"].seconds) / saved.seconds))


# ---- verdicts -----------------------------------------------------------------------------------


def small_verdict(frames: Sequence[float]) -> Verdict:
    """Whether the index pays off after about 180 frames (factor 2) for a small radius and few photons."""
    found, error = frames
    near = SMALL_FRAMES / 2 <= found <= 2 * SMALL_FRAMES
    return Verdict(
        f"With a small radius and few photons an index pays after {SMALL_FRAMES} frames (paper 3).",
        "confirmed" if near else "refuted",
        f"With the smallest discs and the fewest paths it has paid after {_frames(found)} (± {error:.1f}).",
    )


def growth_verdict(frames: np.ndarray) -> Verdict:
    """Whether larger discs and more paths postpone that to 7,000 frames, within a factor of 2, or more."""
    small, wide, many, large = frames[0, 0], frames[0, -1], frames[-1, 0], frames[-1, -1]
    return Verdict(
        f"It takes {LARGE_FRAMES:,} frames, or for ever, as the radius and the photons grow (paper 3).",
        "confirmed" if large >= LARGE_FRAMES / 2 else "refuted",
        f"Smallest discs and fewest paths: {_frames(small)}; largest discs: {_frames(wide)}; most paths: "
        f"{_frames(many)}; both: {_frames(large)}; {_frames(np.max(frames))} at most.",
    )


def stored_verdict(paths: Sequence[int], payback: np.ndarray) -> Verdict:
    """Whether stored paths pay within a second of animation; the bound cannot refute it."""
    pairs = zip(paths, payback, strict=True)
    parts = ", ".join(f"{_frames(found)} at {count:,} paths" for count, found in pairs)
    return Verdict(
        "Stored paths with updates pay within the first second of animation, 25 frames.",
        "confirmed" if np.max(payback) <= 25 else "open",
        f"At the latest after {parts}.",
    )


def _frames(count: float) -> str:
    return f"{count:,.1f} frames" if np.isfinite(count) else "no number of frames"


# ---- tables and figures -------------------------------------------------------------------------


def _index_table(
    settings: Mapping[str, Any],
    changed: Sequence[int],
    index: Sequence[Sequence[Mapping[str, Timing]]],
    frames: np.ndarray,
) -> Table:
    rows: list[list[Cell]] = []
    for p, count in enumerate(settings["paths"]):
        for w, width in enumerate(settings["widths"]):
            cell = index[p][w]
            times = [x for name in ("build", "disc index", "sphere cache") for x in _ms(cell[name])]
            found: list[Cell] = [_finite(x) for x in frames[p, w]]
            rows.append([count, width, changed[p], *times, *found])
    columns = [PATHS, "disc radius / distance", "old and new segments"]
    for name in ("index's build", "frame by disc index", "frame by sphere cache"):
        columns += [f"{name} [ms]", f"{name}, standard error [ms]"]
    return Table("amortisation_index", [*columns, "frames until it pays", "standard error"], rows)


def _stored_table(paths: Sequence[int], stored: Sequence[Mapping[str, Timing]], payback: np.ndarray) -> Table:
    rows: list[list[Cell]] = [
        [count, *(value for name in SESSION_TIMES for value in _ms(times[name])), _finite(found)]
        for count, times, found in zip(paths, stored, payback, strict=True)
    ]
    columns = [PATHS]
    for label in SESSION_TIMES.values():
        columns += [f"{label} [ms]", f"{label}, standard error [ms]"]
    return Table("amortisation_stored", [*columns, "frames until it pays, at most"], rows)


def _finite(frames: float) -> float | None:
    """For a table: None = never."""
    return float(frames) if np.isfinite(frames) else None


def _ms(time: Timing) -> tuple[float, float]:
    return 1e3 * time.seconds, 1e3 * time.error


def _index_figure(paths: Sequence[int], frames: np.ndarray, settings: Mapping[str, Any]) -> Figure:
    widths = np.array(settings["widths"], float)
    shown = np.where(np.isfinite(frames[..., :1]), frames, np.nan)
    return Figure(
        "amortisation_index",
        f"Frames after which an index over {settings['samples']:,} static samples of the atrium has paid for "
        f"its build, trolley moving {STEP[0]:g} m a frame; seed {settings['seeds'][0]}; medians of "
        f"{settings['repetitions']} interleaved repetitions and their standard error. No point: never.",
        "disc radius / distance of samples",
        "frames until the index has paid",
        [
            Series(f"{count:,} paths", "frames", shown[p, :, 0], shown[p, :, 1]).curve(widths)
            for p, count in enumerate(paths)
        ],
        log_x=True,
    )


def _stored_figure(
    paths: Sequence[int], stored: Sequence[Mapping[str, Timing]], settings: Mapping[str, Any]
) -> Figure:
    counts = np.array(paths, float)
    repetitions = settings["sessions"] * settings["repetitions"]
    return Figure(
        "amortisation_stored",
        f"One frame of the atrium, {settings['samples']:,} samples, one thread, seed {settings['seeds'][0]}; "
        f"median and its standard error of {repetitions} updates and full frames.",
        PATHS,
        "time (ms)",
        [
            Series.of_times(label, [row[name] for row in stored]).curve(counts)
            for name, label in SESSION_TIMES.items()
        ],
        log_x=True,
        log_y=True,
    )


EXPERIMENT = Experiment(
    name="amortisation",
    title="After how many frames an index and stored paths pay",
    source="paper 3",
    question="After how many frames does an index over the static samples pay for its build, and after how "
    "many do stored paths with updates pay against computing every frame anew?",
    run=run,
    full={
        "seeds": [1],
        "paths": [10_000, 100_000, 1_000_000],
        "widths": [0.25, 0.5, 1.0, 2.0, 4.0, 8.0],
        "samples": 50_000,
        "detail": 1.0,
        "repetitions": 5,
        "sessions": 1,
    },
    quick={
        "paths": [1000, 10_000],
        "widths": [0.5, 1.0, 4.0],
        "samples": 2000,
        "detail": 0.5,
        "repetitions": 3,
        "sessions": 1,
    },
    timed=True,
)
