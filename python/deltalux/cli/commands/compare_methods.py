# SPDX-License-Identifier: Apache-2.0
"""`deltalux compare-methods`: every method on the same segments and samples, as one page."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from deltalux.cli.console import Terminal
from deltalux.cli.inputs import open_scene
from deltalux.cli.options import (
    JsonOption,
    QuietOption,
    SceneArgument,
    SeedOption,
    SpacingOption,
    ThreadsOption,
    parse_count,
)
from deltalux.cli.session_arguments import scene_arguments
from deltalux.cli.targets import check_writable, keep_inputs
from deltalux.files import written_aside
from deltalux.outputs.images import Picture
from deltalux.studies import MethodStudy
from deltalux.studies.report.method_findings import findings
from deltalux.studies.report.method_tables import equal_count_csv, methods_csv
from deltalux.studies.report.methods_page import methods_page

from .method_pictures import make_views, sheets

PAGE, TABLES = "report.html", ("methods.csv", "equal_count.csv")
PICTURES = {
    "whole.png": "The scene through its camera; all pictures have one exposure.",
    "close_up.png": "Close up, where most small surfaces are seen.",
}
LABELS = {  # captions of the pictures, in their order
    "reference": "reference",
    "session": "session (clipped discs)",
    "disc_index": "discs (whole)",
    "sphere_cache_literal": "sphere cache, literal (lossy)",
    "photon_map": "photon map",
    "photon_map_surface": "photon map, surface area",
    "patch_sum": "patch sum",
    "local_linear": "local linear",
}
FULL = {"paths": 300_000, "samples": 20_000, "reference": 16}
QUICK = {"paths": 30_000, "samples": 2_000, "reference": 8}
SIZE, QUICK_SIZE = (480, 300), (240, 150)

FolderOption = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        metavar="DIR",
        help="Folder for the page, its pictures and tables.",
        show_default=False,
    ),
]
PathsOption = Annotated[
    int | None,
    typer.Option(
        "--paths",
        parser=parse_count,
        metavar="N",
        help="Light paths that feed every method.  [dim]\\[default: 300000; quick: 30000][/]",
        show_default=False,
    ),
]
SamplesOption = Annotated[
    int | None,
    typer.Option(
        "--samples",
        parser=parse_count,
        metavar="N",
        help="Number of samples to estimate, drawn from the mesh's vertices; brute force gets "
        "fewer.  [dim]\\[default: 20000; quick: 2000][/]",
        show_default=False,
    ),
]
CountOption = Annotated[
    int,
    typer.Option(
        "--k",
        min=3,
        max=2**31 - 1,
        metavar="K",
        help="Number of nearest hits or segments that the K-nearest methods use.",
    ),
]
ReferenceOption = Annotated[
    int | None,
    typer.Option(
        "--reference",
        min=2,
        metavar="F",
        help="Paths of the reference, as a multiple of --paths.  [dim]\\[default: 16; quick: 8][/]",
        show_default=False,
    ),
]
QuickOption = Annotated[
    bool, typer.Option("--quick", help="Few paths and samples, small pictures: a first look.")
]


@scene_arguments(without=("movable",))
def run(
    context: typer.Context,
    scene: SceneArgument,
    output: FolderOption,
    *,
    paths: PathsOption = None,
    samples: SamplesOption = None,
    spacing: SpacingOption = None,
    k: CountOption = 50,
    reference: ReferenceOption = None,
    seed: SeedOption = 1,
    threads: ThreadsOption = None,
    reading: dict[str, Any],
    quick: QuickOption = False,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Compare every method of the system on the same light and the same samples of a scene.

    Discs by brute force, index, sphere cache and ray map; the k nearest segments; photon maps; patch
    sums; local-linear fits. Writes report.html with time, memory, errors, bias at edges and on small
    surfaces, and pictures side by side; the tables as .csv, the pictures as .png beside it.

    [bold]Examples[/]

    Two to three minutes:
    deltalux compare-methods atrium -o methods

    A first look at a scene of your own:
    deltalux compare-methods room.glb --quick -o methods
    """
    terminal = Terminal(as_json, quiet)
    with terminal.working("load scene"):
        loaded = open_scene(scene, **reading)
    terminal.warn(loaded.warnings)
    output.mkdir(parents=True, exist_ok=True)
    results = [output / name for name in (PAGE, *TABLES, *PICTURES)]
    for path in results:
        check_writable(path)
    keep_inputs(results, loaded.files)
    given = {"paths": paths, "samples": samples, "reference": reference}
    settings = (QUICK if quick else FULL) | {key: value for key, value in given.items() if value is not None}
    with terminal.progress() as progress:
        progress("samples", 0.0)
        study = MethodStudy(loaded, **settings, spacing=spacing, seed=seed, k=k, threads=threads)
        study.trace(progress)
        views = make_views(study, QUICK_SIZE if quick else SIZE)
        data = study.run(views.vertices, progress)
        values = study.pictures(list(LABELS), progress)
        progress("write report", 0.0)
        drawn = sheets(views, {LABELS[name]: value for name, value in values.items()})
    command = shlex.join(["deltalux", *context.obj])
    data |= {"scene": scene, "command": command, "findings": findings(data)}
    outputs = _write(output, data, dict(zip(PICTURES, drawn, strict=True)))
    data["outputs"] = [str(path) for path in outputs]
    terminal.result(
        data, _table(data), *data["findings"], f"report.html, pictures and tables are in {output}"
    )


def _write(folder: Path, data: dict[str, Any], pictures: dict[str, Picture]) -> list[Path]:
    for name, picture in pictures.items():
        picture.save(folder / name)
    shown = [(folder / name, caption) for name, caption in PICTURES.items()]
    about = f"Made by: {data['command']}"
    texts = {
        "methods.csv": methods_csv(data),
        "equal_count.csv": equal_count_csv(data),
        PAGE: methods_page(f"Every method on the same light: {data['scene']}", about, data, shown),
    }
    for name, text in texts.items():
        with written_aside(folder / name) as file:
            file.write(text.encode())
    return [folder / name for name in (*pictures, *texts)]


def _table(data: dict[str, Any]) -> Table:
    """Return times and errors as a table for the terminal; the page has more."""
    table = Table(title=data["scene"], title_justify="left")
    table.add_column("method", no_wrap=True)
    for column in ("CPU µs", "RMS error", "mean error", "edge", "very small"):
        table.add_column(column, justify="right")
    for row in data["methods"]:
        seconds = row.get("cpu_seconds")
        groups = (row["by_class"][name] for name in ("edge", "very small"))
        table.add_row(
            row["label"],
            "–" if seconds is None else f"{1e6 * seconds / row['samples']:.1f}",
            f"{row['rms_error']:.1%}",
            f"{row['bias']:+.1%}",
            *("–" if group is None else f"{group['bias']:+.1%}" for group in groups),
        )
    table.caption = "per sample; mean errors of all samples, at edges, on very small surfaces"
    return table
