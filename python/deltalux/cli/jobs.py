# SPDX-License-Identifier: Apache-2.0
"""The steps of each command, for the overall progress bar."""

from __future__ import annotations

import math
import os
import struct
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import deltalux as dl
from deltalux.pace import (
    MORE_RAYS,
    Counts,
    Overall,
    Step,
    Stored,
    baking,
    bundled,
    counts_with,
    drawing,
    loading,
    opening,
    recomputing,
    summing_up,
    updating,
    writing,
)
from deltalux.planning import is_calibrated
from deltalux.rendering import MOST_RAYS, SIZE
from deltalux.rendering import PATHS as PICTURE_PATHS

from .options import SESSION

BYTES_PER_TRIANGLE = 40.0  # of a scene file; estimate before it is read
USUAL_ERROR = 0.025  # relative standard error of a typical bake with 300,000 paths and their rays
USUAL_PATHS = 300_000
MOST_GROWN = 1e3  # largest factor by which paths and rays are assumed to grow


def before_loading(source: str, threads: int | None) -> Counts:
    """Estimated counts of a scene before it is loaded."""
    path = Path(source)
    is_scene = path.is_file() and path.suffix.lower() != SESSION  # most of a session is its light
    size = path.stat().st_size if is_scene else 0
    found = Counts(int(size / BYTES_PER_TRIANGLE)) if size else bundled(source.replace("-", "_"))
    return replace(found, threads=threads or os.cpu_count() or 1)


def counts_of_session(session: dl.Session) -> Counts:
    """Counts of an existing session."""
    return counts_with(session.scene, session.samples, session.options)


def in_pixels(counts: Counts, size: tuple[int, int]) -> Counts:
    """Counts with pictures of this size, if pictures have light per pixel."""
    return replace(counts, pixels=size[0] * size[1] if counts.pixels else 0)


def suffixes(targets: Sequence[Path]) -> list[str]:
    """Suffixes of result files."""
    return [path.suffix.lower() for path in targets]


def bake_job(counts: Counts, targets: Sequence[Path], target_error: float | None) -> list[Step]:
    """All steps after the samples are placed."""
    if target_error is None:
        return [*baking(counts, is_calibrated()), *writing(counts, suffixes(targets)), *summing_up(counts)]
    usual = USUAL_ERROR * math.sqrt(USUAL_PATHS / counts.paths)
    rounds = [counts]
    if usual > target_error:
        rounds.append(grown(counts, min(usual / target_error, MOST_GROWN) ** 2))
    return after_rounds(rounds, rounds[-1], targets)


def grown(counts: Counts, more: float) -> Counts:
    """Counts with `more` times the paths and rays."""
    return replace(counts, paths=int(more * counts.paths), rays=int(more * counts.rays))


def after_rounds(rounds: Sequence[Counts], last: Counts, targets: Sequence[Path]) -> list[Step]:
    """Steps of bakes with these counts whose error is checked, then of the last one's outputs and summary."""
    steps: list[Step] = []
    for counts in rounds:
        steps += [*baking(counts, is_calibrated()), *summing_up(counts)]
    return [*steps, *writing(last, suffixes(targets)), *summing_up(last)]


def update_job(
    path: Path, targets: Sequence[Path], size: tuple[int, int], threads: int | None, workers: int = 0
) -> list[Step]:
    """All steps of an update, before the file is opened; `size` of its pictures."""
    stored = look_into(path, threads)
    counts = replace(in_pixels(stored.counts, size), workers=workers)
    stored = replace(stored, counts=counts)
    return [*opening(stored, is_calibrated()), *after_opening(counts, targets)]


def look_into(path: Path, threads: int | None) -> Stored:
    """Facts from a session file's table of contents; opening the file reports any error in it."""
    sizes: dict[str, int] = {}
    errors = (OSError, zipfile.BadZipFile, NotImplementedError, ValueError, struct.error)
    with suppress(*errors), zipfile.ZipFile(path) as archive:
        sizes = {info.filename: info.file_size for info in archive.infolist()}
    samples = sizes.get("core/radius.npy", 0) // 4
    rays = sizes.get("core/gather.targets.npy", 0) / 4
    counts = Counts(
        triangles=sizes.get("meshes/triangles.npy", 0) // 24,
        samples=samples,
        paths=sizes.get("core/cut.npy", 0),
        rays=int(rays / MORE_RAYS / samples) if samples else MOST_RAYS,
        pixels=SIZE[0] * SIZE[1] if "display/points.npy" in sizes else 0,
        threads=threads or os.cpu_count() or 1,
    )
    of_rays = sum(size for name, size in sizes.items() if name.startswith("core/gather."))
    return Stored(counts, sum(sizes.values()), of_rays)


def after_opening(counts: Counts, targets: Sequence[Path], again: bool = False) -> list[Step]:
    """All steps of an update, after the file is opened; `again`: it is recomputed first."""
    steps = [*updating(counts), *writing(counts, suffixes(targets)), *summing_up(counts)]
    return [*recomputing(counts), *steps] if again else steps


def render_job(
    source: str, stored: bool, paths: int | None, rays: int | None, pixels: int, threads: int | None
) -> list[Step]:
    """All steps of a picture, before its session or scene is opened."""
    if stored:
        found = look_into(Path(source), threads)
        return [*opening(found, is_calibrated()), *picture_steps(found.counts, pixels, rays)]
    guess = before_loading(source, threads)
    counts = replace(guess, samples=0, paths=paths or PICTURE_PATHS, rays=rays or MOST_RAYS)
    return [loading(guess)[0], *after_loading(counts, pixels, rays)]


def after_loading(counts: Counts, pixels: int, rays: int | None) -> list[Step]:
    """Steps of a scene's bake for its picture only, and of the picture."""
    return [*baking(counts, is_calibrated()), *picture_steps(counts, pixels, rays)]


def picture_steps(counts: Counts, pixels: int, rays: int | None) -> list[Step]:
    """Steps of a picture of a baked session."""
    return [*drawing(replace(counts, pixels=pixels), rays or 0), Step("write files", 2.5e-6 * pixels)]


def edges_into(progress: Overall, counts: Counts, rays: int | None = None) -> Callable[[float], None]:
    """Callback that revises the forecast of a picture in `progress`, once its share of edges is known."""

    def known(share: float) -> None:
        progress.revise(drawing(replace(counts, edges=share), rays or 0))

    return known
