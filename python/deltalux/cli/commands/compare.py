# SPDX-License-Identifier: Apache-2.0
"""`deltalux compare`: differences between two results, as numbers and as a picture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

import deltalux as dl
from deltalux.cli.console import ProgressCallback, Terminal
from deltalux.cli.options import (
    SESSION,
    CameraOption,
    EyeOption,
    JsonOption,
    QuietOption,
    SizeOption,
    TargetOption,
)
from deltalux.cli.shots import PICTURE, Shot, shot_of
from deltalux.cli.targets import check_writable, keep_inputs
from deltalux.outputs import tables
from deltalux.outputs.images import difference
from deltalux.outputs.plans import grid_picture, plan_axes
from deltalux.quantities import significant
from deltalux.report import compare as compare_values
from deltalux.units import LUX, photopic

RESULT_HELP = "A .dlx, .npz or .csv that bake or update wrote."
PictureOption = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="OUT.png",
        help="Picture of B minus A, orange where B is brighter; for sessions (.dlx).",
        show_default=False,
    ),
]


@dataclass(frozen=True, eq=False)
class Loaded:
    """A result and, if the file was a session, that session."""

    result: Any
    session: dl.Session | None


def run(
    a: Annotated[Path, typer.Argument(metavar="A", help=RESULT_HELP, show_default=False)],
    b: Annotated[Path, typer.Argument(metavar="B", help=RESULT_HELP, show_default=False)],
    output: PictureOption = None,
    camera: CameraOption = None,
    eye: EyeOption = None,
    target: TargetOption = None,
    size: SizeOption = None,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Compare two results of the same samples: how large are the differences, and where.

    [bold]Examples[/]

    What did moving the chair change?
    deltalux compare office.dlx moved.dlx -o difference.png --size 1920x1200

    How noisy is a bake?
    deltalux compare seed1.npz seed2.npz --json
    """
    for path in (a, b):
        if path.suffix.lower() not in (SESSION, ".npz", ".csv"):
            raise typer.BadParameter(f"'{path}': found suffix '{path.suffix}', expected .dlx, .npz or .csv")
    if output is not None:
        _check_picture(output, a, b)
    shot = shot_of(camera, eye, target, size, targets=[output] if output else [])
    terminal = Terminal(as_json, quiet)
    with terminal.progress() as progress:
        first, second = _load(a, progress), _load(b, progress)
        for session in (first.session, second.session):
            if output is not None and session is not None:
                keep_inputs([output], session.scene.files)
        progress("compare values", 0.0)
        data = _numbers(first, second, str(a), str(b))
        if output is not None:
            _write_picture(output, first, second, shot)
    lines = [f"wrote {output}"] if output is not None else []
    terminal.result(data | {"a": str(a), "b": str(b)}, _table(data), *lines)


def _check_picture(output: Path, a: Path, b: Path) -> None:
    if output.suffix.lower() != PICTURE:
        raise typer.BadParameter(f"output '{output}': found suffix '{output.suffix}', expected .png")
    if any(path.suffix.lower() != SESSION for path in (a, b)):
        raise typer.BadParameter(f"output '{output}': a picture needs sessions (.dlx); tables hold no scene")
    check_writable(output)
    keep_inputs([output], [a, b])


def _load(path: Path, progress: ProgressCallback) -> Loaded:
    if path.suffix.lower() != SESSION:
        return Loaded(tables.read(path), None)
    session = dl.Session.open(path, progress=progress)
    return Loaded(session.result, session)


def _numbers(a: Loaded, b: Loaded, name_a: str, name_b: str) -> dict[str, Any]:
    if a.result.unit != b.result.unit:
        raise dl.FormatError(f"{name_b}: found unit {b.result.unit}, expected {a.result.unit} as in {name_a}")
    if len(a.result.points) != len(b.result.points):
        raise dl.FormatError(
            f"{name_b}: found {len(b.result.points)} samples, expected {len(a.result.points)} "
            f"as in {name_a}; compare results of one scene and spacing"
        )
    moved = np.abs(a.result.points - b.result.points).max(axis=1, initial=0.0) > 1e-6
    data = compare_values(a.result.irradiance, b.result.irradiance)
    data |= {"unit": a.result.unit, "moved_samples": int(moved.sum())}
    if len(moved):
        data["largest_at"] = b.result.points[data.pop("largest_index")].tolist()
    if a.session and b.session:
        data["same_digest"] = a.session.digest() == b.session.digest()
    return data


def _table(data: dict[str, Any]) -> Table:
    unit = "lx" if data["unit"] == LUX else data["unit"].replace("m2", "m²")
    table = Table(show_header=False, title="B minus A", title_justify="left")
    table.add_row("samples", f"{data['samples']:,}, of which {data['changed']:,} differ")
    if data["moved_samples"]:
        table.add_row("moved samples", f"{data['moved_samples']:,} (compared by number, not by place)")
    table.add_row(
        "mean of A, of B", f"{significant(data['mean_a'], 5)}, {significant(data['mean_b'], 5)} {unit}"
    )
    table.add_row("mean difference", f"{data['mean_difference']:+.3g} {unit}")
    table.add_row("RMS difference", f"{significant(data['rms_difference'], 3)} {unit}")
    table.add_row("RMS relative difference", f"{data['rms_relative_difference']:.3%}")
    if "largest_at" in data:
        place = ", ".join(f"{c:.2f}" for c in data["largest_at"])
        table.add_row("largest difference", f"{data['largest_difference']:+.3g} {unit} at ({place})")
    if "same_digest" in data:
        table.add_row("digest", "the same" if data["same_digest"] else "different")
    return table


def _write_picture(path: Path, a: Loaded, b: Loaded, shot: Shot) -> None:
    session = b.session
    if session is None:
        return
    samples = session.samples
    if samples.display is None and samples.grid_shape is not None:
        shot.refuse_plans(1)
        change = photopic(b.result.irradiance) - photopic(a.result.irradiance)
        axes = plan_axes(samples)
        grid_picture(samples.in_grid(change), b.result.unit, axes=axes).save(path)
        return
    if samples.display is None:
        raise dl.OptionError(f"output '{path}': found samples without a mesh or grid; compare without -o")
    difference(
        session.scene, samples.display, a.result.irradiance, b.result.irradiance, poses=session.poses,
        camera=shot.camera_in(session.scene), size=shot.size,
    ).save(path)  # fmt: skip
