# SPDX-License-Identifier: Apache-2.0
"""What the commands are about to do, as steps for the overall bar."""

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
from deltalux.core_session import default_paths, resolved_gather
from deltalux.pace import (
    MORE_RAYS,
    POINT,
    Counts,
    Overall,
    Step,
    Stored,
    baking,
    bundled,
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

BYTES_PER_TRIANGLE = 40.0  # of a scene file, before it is read
USUAL_ERROR = 0.025  # that 300,000 paths with their rays claim
USUAL_PATHS = 300_000
MOST_GROWN = 1e3  # times less error than is usual: no more is foreseen


def before_loading(source: str, threads: int | None) -> Counts:
    """Counts of a scene that nobody has looked into yet."""
    path = Path(source)
    size = path.stat().st_size if path.is_file() else 0
    found = Counts(int(size / BYTES_PER_TRIANGLE)) if size else bundled(source.replace("-", "_"))
    return replace(found, threads=threads or os.cpu_count() or 1)


def counts_of(
    scene: dl.Scene, samples: dl.Samples, paths: int | None, gather: str | int, threads: int | None
) -> Counts:
    """Counts of a session to be made."""
    rays = resolved_gather(gather, len(samples), "first", "reachable")
    lights = scene.info()["lights"]
    return Counts(
        triangles=sum(len(mesh.triangles) for mesh in scene.meshes),
        samples=len(samples),
        pixels=SIZE[0] * SIZE[1] if samples.display else 0,
        paths=default_paths(rays) if paths is None else int(paths),
        rays=0 if rays == "off" else int(rays),
        lights=sum(1 if light["kind"] == "area" else POINT for light in lights),
        suns=sum(light.place is None for light in scene.lights),
        threads=threads or os.cpu_count() or 1,
    )


def counts_of_session(session: dl.Session) -> Counts:
    """Counts of a session that is there."""
    options = session.options
    return counts_of(session.scene, session.samples, options["paths"], options["gather"], options["threads"])


def in_pixels(counts: Counts, size: tuple[int, int]) -> Counts:
    """With pictures of this size, where there are pictures per pixel at all."""
    return replace(counts, pixels=size[0] * size[1] if counts.pixels else 0)


def suffixes(targets: Sequence[Path]) -> list[str]:
    """Kinds of result files."""
    return [path.suffix.lower() for path in targets]


def bake_job(counts: Counts, targets: Sequence[Path], target_error: float | None) -> list[Step]:
    """All after the samples are placed."""
    if target_error is None:
        return [*baking(counts, is_calibrated()), *writing(counts, suffixes(targets)), *summing_up(counts)]
    usual = USUAL_ERROR * math.sqrt(USUAL_PATHS / counts.paths)
    rounds = [counts]
    if usual > target_error:
        rounds.append(grown(counts, min(usual / target_error, MOST_GROWN) ** 2))
    return after_rounds(rounds, rounds[-1], targets)


def grown(counts: Counts, more: float) -> Counts:
    """With so many times the paths and rays."""
    return replace(counts, paths=int(more * counts.paths), rays=int(more * counts.rays))


def after_rounds(rounds: Sequence[Counts], last: Counts, targets: Sequence[Path]) -> list[Step]:
    """Bakes with these counts whose error is looked at; then what is written and said of the last one."""
    steps: list[Step] = []
    for counts in rounds:
        steps += [*baking(counts, is_calibrated()), *summing_up(counts)]
    return [*steps, *writing(last, suffixes(targets)), *summing_up(last)]


def update_job(path: Path, targets: Sequence[Path], size: tuple[int, int], threads: int | None) -> list[Step]:
    """All of an update, before the file is opened; `size` of its pictures."""
    stored = look_into(path, threads)
    counts = in_pixels(stored.counts, size)
    return [*opening(stored, is_calibrated()), *after_opening(counts, targets)]


def look_into(path: Path, threads: int | None) -> Stored:
    """What the table of contents of a session file tells; whatever is wrong with it, opening it will say."""
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
    """All of an update, after the file is opened; `again`: it is computed anew before."""
    steps = [*updating(counts), *writing(counts, suffixes(targets)), *summing_up(counts)]
    return [*recomputing(counts), *steps] if again else steps


def render_job(
    source: str, stored: bool, paths: int | None, rays: int | None, pixels: int, threads: int | None
) -> list[Step]:
    """All of a picture, before its session, or its scene, is opened."""
    if stored:
        found = look_into(Path(source), threads)
        return [*opening(found, is_calibrated()), *picture_steps(found.counts, pixels, rays)]
    guess = before_loading(source, threads)
    counts = replace(guess, samples=0, paths=paths or PICTURE_PATHS, rays=rays or MOST_RAYS)
    return [loading(guess)[0], *after_loading(counts, pixels, rays)]


def after_loading(counts: Counts, pixels: int, rays: int | None) -> list[Step]:
    """A scene's bake, for its picture alone, and the picture."""
    return [*baking(counts, is_calibrated()), *picture_steps(counts, pixels, rays)]


def picture_steps(counts: Counts, pixels: int, rays: int | None) -> list[Step]:
    """A picture of what is baked."""
    return [*drawing(replace(counts, pixels=pixels), rays or 0), Step("write files", 2.5e-6 * pixels)]


def edges_into(progress: Overall, counts: Counts, rays: int | None = None) -> Callable[[float], None]:
    """What tells `progress` how long a picture takes, once the edges in it are known."""

    def known(share: float) -> None:
        progress.revise(drawing(replace(counts, edges=share), rays or 0))

    return known
