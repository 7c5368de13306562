# SPDX-License-Identifier: Apache-2.0
"""`deltalux plan`: predicted cost of every disc method in a scene, and the one that a session chooses."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer
from rich.table import Table

import deltalux as dl
from deltalux.cli.baking import make_samples
from deltalux.cli.console import Terminal
from deltalux.cli.inputs import open_scene
from deltalux.cli.options import (
    GridOption,
    JsonOption,
    MarginOption,
    QuietOption,
    RadiusOption,
    SceneArgument,
    SpacingOption,
)
from deltalux.cli.session_arguments import scene_arguments, session_arguments
from deltalux.planning.parts import INDEX, PartPlan, duration
from deltalux.session_options import PlanOptions

PolicyOption = Annotated[
    Literal["measured", "paper-sphere", "paper-box"],
    typer.Option(
        "--policy",
        help="Choose by predicted time, or by the paper's rule: sphere cache for objects below 35 % of the "
        "scene, by their bounding spheres or boxes.",
    ),
]
FramesOption = Annotated[
    float | None,
    typer.Option(
        "--frames",
        min=0,
        metavar="N",
        help="Frames, each moving one object, that follow the bake; 100 if anything can move.",
        show_default=False,
    ),
]
RebuildOption = Annotated[
    bool, typer.Option("--rebuild", help="Plan as if every frame rebuilt its index, as in the paper.")
]


@scene_arguments()
@session_arguments(PlanOptions)
def run(
    scene: SceneArgument,
    *,
    reading: dict[str, Any],
    session: dict[str, Any],
    spacing: SpacingOption = None,
    grid: GridOption = None,
    margin: MarginOption = 0.0,
    radius: RadiusOption = None,
    policy: PolicyOption = "measured",
    frames: FramesOption = None,
    rebuild: RebuildOption = False,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Predict the cost of each disc method and of the gather in a scene, and which method is chosen per part.

    A pilot counts the tests of every method on a few of the paths; the first run on a machine also
    measures what a test costs there. For sessions that gather, two small bakes measure the gather's cost.
    Times are seconds of one processor.

    [bold]Examples[/]

    deltalux plan atrium

    deltalux plan room.glb --movable chair --paths 4e6 --frames 1000

    deltalux plan expo --policy paper-sphere --rebuild --json
    """
    terminal = Terminal(as_json, quiet)
    with terminal.working("load scene"):
        loaded = open_scene(scene, **reading)
    terminal.warn(loaded.warnings)
    with terminal.progress() as progress:
        progress("samples", 0.0)
        samples, _, left_out = make_samples(loaded, spacing, grid or (), radius, margin=margin)
        terminal.warn(left_out)
        plan = dl.plan(
            loaded,
            samples,
            **session,
            policy=policy,
            frames=frames,
            rebuild=rebuild,
            progress=progress,
        )
    data = {"scene": scene, **plan.as_dict()}
    tables = [
        item for part in plan.parts.values() for item in (_table(part, rebuild), _reason(part, rebuild))
    ]
    if plan.gather:
        tables.append(f"gather: {plan.gather}")
    terminal.result(data, *tables)


def _table(part: PartPlan, rebuild: bool) -> Table:
    title = f"{part.part}: {part.samples:,} samples, {part.bake_segments:,.0f} segments"
    table = Table(title=title, title_justify="left")
    table.add_column("method")
    for column in ("build", "bake", "frame", "bake and frames", "memory (MB)"):
        table.add_column(column, justify="right")
    for method in part.methods:
        table.add_row(
            method.method,
            *method.figures(),
            duration(method.seconds(part.frames, rebuild)),
            f"{method.bytes / 2**20:.1f}",
            style="bold" if method.method == part.chosen else None,
        )
    return table


def _reason(part: PartPlan, rebuild: bool) -> str:
    chosen = f"{part.chosen}: {part.reason}."
    paid = part.pays_after
    kept_anyway = paid is None and part.chosen == INDEX
    if rebuild or not part.all_piloted or kept_anyway:
        return chosen
    if paid is None:
        index = "never pays"
    elif paid == 0:
        index = "pays within the bake"
    else:
        index = f"pays after {paid:,.0f} frame{'s' * (paid != 1)}"
    return f"{chosen} A disc index {index}."
