# SPDX-License-Identifier: Apache-2.0
"""Shared by bake, update and demo: samples from options, the bake itself, the session's figures."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

import deltalux as dl
from deltalux.pace import Overall, counts_of
from deltalux.quantities import significant
from deltalux.report import ClaimedError, SetSummary, advice, claimed_error, light_doubt, summarise
from deltalux.solid_places import inside_solids, near_walls
from deltalux.units import LUX

from .jobs import after_rounds, bake_job, grown, in_pixels
from .options import NONE, Grid
from .places import Place

# The next bake aims slightly below the target, because the estimated error is itself off by some per cent.
AIM = 0.97
# Largest ratio of errors by which paths grow, with its square; no session can have so many more paths.
MOST = 1e6
REBAKE_PAYS = 1.5  # from this gain on, the user is told


def make_samples(
    scene: dl.Scene,
    spacing: float | None,
    grids: Sequence[Grid],
    radius: float | None,
    detail: float | str = NONE,
    margin: float = 0.0,
) -> tuple[dl.Samples, dict[str, np.ndarray] | None, list[str]]:
    """Return samples on the surfaces, or on working planes if there are any.

    Points of planes inside or behind walls and furniture, or nearer than `margin` to some, are removed.

    Returns
    -------
    samples, the indices of each plane's samples by name (None without planes), and sentences about the
    removed points

    Raises
    ------
    OptionError : no point of a plane remains
    """
    if not grids:
        own = None if detail == NONE else detail
        return dl.Samples.on_vertices(scene, spacing=spacing, radius=radius, detail=own), None, []
    names = ["plane"] if len(grids) == 1 else [f"plane {i + 1}" for i in range(len(grids))]
    whole = [_plane(grid, radius) for grid in grids]
    inside = inside_solids(scene, np.concatenate([plane.points for plane in whole]))
    planes, notes = [], []
    parts = np.split(inside, np.cumsum([len(plane) for plane in whole])[:-1])
    for name, plane, part in zip(names, whole, parts, strict=True):
        free, note = _free_part(scene, name, plane, part, margin)
        planes.append(free)
        notes += note
    starts = np.cumsum([0, *map(len, planes)])
    sets = {
        name: np.arange(first, end) for name, first, end in zip(names, starts[:-1], starts[1:], strict=True)
    }
    return (planes[0] if len(planes) == 1 else dl.Samples.concatenate(planes)), sets, notes


def _free_part(
    scene: dl.Scene, name: str, plane: dl.Samples, inside: np.ndarray, margin: float
) -> tuple[dl.Samples, list[str]]:
    """The part of a plane in free air, and a sentence about the rest."""
    near = near_walls(scene, plane.points, margin) & ~inside if margin > 0 else np.zeros(len(plane), bool)
    counts = {"inside of or behind walls and furniture": inside, f"nearer than {margin:g} m to some": near}
    said = [f"{int(marked.sum()):,} {what}" for what, marked in counts.items() if marked.any()]
    if not said:
        return plane, []
    told = f"{name}: of {len(plane):,} points are left out: {', '.join(said)}"
    if (inside | near).all():
        raise dl.OptionError(
            f"{told}; expected some in free air: check the plane's corner, its size and height"
        )
    return plane.without(inside | near), [told]


def _plane(grid: Grid, radius: float | None) -> dl.Samples:
    """Return rows along +X, the first at the smallest Z, as a plan is drawn; normals point up."""
    below = dl.Samples.on_grid(grid.corner, (grid.width, 0, 0), (0, 0, grid.depth), grid.spacing)
    plane = dl.Samples(below.points, (0, 1, 0), radius)  # X × Z points down
    plane.grid_shape, plane.spacing = below.grid_shape, below.spacing
    return plane


def bake_scene(
    scene: dl.Scene,
    samples: dl.Samples,
    target_error: float | None,
    targets: Sequence[Path],
    *,
    progress: Overall,
    place: Place,
    size: tuple[int, int],
    paths: int | None,
    gather: str | int,
    **options: Any,
) -> tuple[dl.Session, dl.Frame]:
    """Bake, then again with more paths and rays until the error is below `target_error`.

    Each bake starts from scratch, so that result and digest equal those of a plain bake with the final
    numbers.

    Parameters
    ----------
    scene, samples : scene to light, and where
    target_error : of the 90th percentile of `claimed_error`; None = one bake
    targets : files that will be written afterwards
    progress : is given the steps that follow
    place : where sessions are
    size : of pictures
    paths, gather : of the first bake
    options : of `deltalux.Session`

    Returns
    -------
    session, and the frame of its bake

    Raises
    ------
    OptionError : the target needs more paths or rays than are possible, or than fit into memory
    """
    reached = ""
    counts = in_pixels(counts_of(scene, samples, paths, gather, options["threads"]), size)
    counts = replace(counts, workers=place.workers)
    progress.expect(bake_job(counts, targets, target_error))
    while True:
        progress.begin("make session")
        try:
            session = place.make(scene, samples, paths=paths, gather=gather, progress=progress, **options)
            frame = session.bake()
        except dl.OptionError as problem:
            raise dl.OptionError(f"{reached}{problem}") from None
        if target_error is None:
            return session, frame
        progress.begin("sum up")
        error = claimed_error(session.irradiance, session.standard_error, samples.areas).p90
        if error <= target_error:
            progress.expect(after_rounds([], counts, targets))
            return session, frame
        used = session.options
        session.close()
        reached = (
            f"target error: found {target_error:g}, expected one within reach, such as the {error:.2g} of "
            f"{used['paths']:,} paths and gather={used['gather']}; with more of them: "
        )
        more = max(1.25, min(error / (AIM * target_error), MOST) ** 2)
        counts = grown(counts, more)
        progress.expect(after_rounds([counts], counts, targets))
        paths = math.ceil(used["paths"] * more)
        if used["gather"] != "off":
            gather = math.ceil(int(used["gather"]) * more)


def total_milliseconds(frame: dl.Frame) -> float:
    """Return the wall-clock time of a bake or update."""
    stages = frame.milliseconds
    return stages["total"] if "total" in stages else sum(stages.values())


def sample_sets(session: dl.Session) -> dict[str, np.ndarray]:
    """Return the indices of each set of samples: static ones, then those of each present movable."""
    samples = session.samples
    static = "surfaces" if samples.display else "plane" if samples.grid_shape else "samples"
    sets = {static: np.flatnonzero(samples.attached == None)}  # noqa: E711, elementwise
    for name, pose in session.poses.items():
        if pose is not None:
            sets[name] = np.flatnonzero(samples.attached == name)
    return sets


def figures(
    session: dl.Session, frame: dl.Frame, sets: Mapping[str, np.ndarray] | None = None
) -> dict[str, Any]:
    """Return the data that --json prints about a baked or updated session.

    Parameters
    ----------
    session : baked
    frame : of the bake or update
    sets : name -> indices of samples; None = `sample_sets`
    """
    irradiance, error = session.irradiance, session.standard_error
    statistics, display = session.statistics, session.samples.display
    sets = sets or sample_sets(session)
    claimed = claimed_error(irradiance, error, session.samples.areas, sets)
    summaries = summarise(irradiance, error, sets)
    undimmed = min(session.dim_factors.values(), default=1.0) >= 1  # otherwise darkness was requested
    return {
        "unit": session.scene.unit,
        "samples": len(irradiance),
        "spacing": session.samples.spacing,
        "vertices": None if display is None else len(display.points),
        "detail": None if display is None else display.detail_length,
        "detail_vertices": 0 if display is None or display.detail is None else len(display.detail),
        "paths": statistics["paths"],
        "gather": session.options["gather"],
        "segments": statistics["segments"],
        "bytes": statistics["bytes"],
        "milliseconds": dict(frame.milliseconds),
        "error": dataclasses.asdict(claimed),
        "rebake_gain": session.rebake_gain if frame.rebake_gain is None else frame.rebake_gain,
        "unreached": session.unreached,
        "sets": [dataclasses.asdict(summary) for summary in summaries],
        "doubt": light_doubt(summaries, session.scene.unit) if undimmed else None,
        "digest": session.digest(),
        "warnings": list(session.scene.warnings),
    }


def summary_table(title: str, data: Mapping[str, Any]) -> Table:
    """Return minimum, mean, maximum and uniformity of each set of `figures` as a table."""
    unit = data["unit"]
    table = Table(title=title, title_justify="left")
    table.add_column("samples of")
    shown = "lx" if unit == LUX else unit.replace("m2", "m²")
    for column in ("count", f"min ({shown})", "mean", "max", "uniformity", "error, 90 % below"):
        table.add_column(column, justify="right")
    errors = data["error"]["sets"]
    for row in (SetSummary(**s) for s in data["sets"]):
        values = map(significant, (row.minimum, row.mean, row.maximum))
        share = f"{errors[row.name]:.1%}" if row.name in errors else "–"
        table.add_row(row.name, f"{row.samples:,}", *values, f"{row.uniformity:.2f}", share)
    table.caption = "\n".join(_notes(data))
    table.caption_justify = "left"
    return table


def _notes(data: Mapping[str, Any]) -> list[str]:
    """What `figures` contain about all samples together, as lines of text."""
    claimed = ClaimedError(**data["error"])
    lines = [f"samples at most {data['spacing']:.3g} m apart"] if data["spacing"] else []
    if data["detail_vertices"]:
        lines.append(
            f"shown by {data['vertices']:,} vertices, {data['detail_vertices']:,} of them at edges of "
            f"shadows, down to {data['detail']:.2g} m"
        )
    if claimed.p90 > 0:
        worst = f", worst: {claimed.worst}" if len(claimed.sets) > 1 else ""
        lines.append(
            f"error of what is lit: median {claimed.median:.1%}, 90 % below {claimed.p90:.1%}{worst}"
        )
    if data["rebake_gain"] > REBAKE_PAYS:
        lines.append(
            "rays are aimed by lamps and paints as loaded: a bake of the scene as it is now may make the "
            f"error up to {data['rebake_gain']:.1f} times smaller"
        )
    if warning := advice(claimed, data["paths"], data["gather"]):
        lines.append(warning)
    if data["doubt"]:
        lines.append(data["doubt"])
    if data["unreached"]:
        lines.append(f"{data['unreached']:,} samples: no path reached them, their error is a bound")
    return lines
