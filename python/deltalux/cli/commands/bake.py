# SPDX-License-Identifier: Apache-2.0
"""`deltalux bake`: trace the light of a scene and write the requested results."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import typer

from deltalux.cli.baking import bake_scene, figures, make_samples, summary_table
from deltalux.cli.console import Terminal
from deltalux.cli.inputs import open_scene
from deltalux.cli.jobs import bake_job, before_loading, in_pixels
from deltalux.cli.options import (
    AUTO,
    NONE,
    CameraOption,
    DetailOption,
    ExposureOption,
    EyeOption,
    FalseColourOption,
    GridOption,
    JsonOption,
    MarginOption,
    MoreOutputsArgument,
    OutputsOption,
    QuietOption,
    RadiusOption,
    SceneArgument,
    SizeOption,
    SpacingOption,
    TargetErrorOption,
    TargetOption,
)
from deltalux.cli.places import ClusterOption, WorkersOption, is_shared, notes_of, place_of
from deltalux.cli.session_arguments import scene_arguments, session_arguments
from deltalux.cli.shots import shot_of
from deltalux.cli.targets import check_targets, keep_inputs, refine_shown, write_targets
from deltalux.pace import loading


@scene_arguments()
@session_arguments()
def run(
    context: typer.Context,
    scene: SceneArgument,
    more: MoreOutputsArgument = None,
    *,
    output: OutputsOption = None,
    reading: dict[str, Any],
    session: dict[str, Any],
    target_error: TargetErrorOption = None,
    spacing: SpacingOption = None,
    detail: DetailOption = AUTO,
    grid: GridOption = None,
    margin: MarginOption = 0.0,
    radius: RadiusOption = None,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    camera: CameraOption = None,
    eye: EyeOption = None,
    target: TargetOption = None,
    size: SizeOption = None,
    exposure: ExposureOption = 0.0,
    false_colour: FalseColourOption = False,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Bake a scene: trace its light and write pictures, meshes, tables or a session.

    [bold]Examples[/]

    A picture, and a session for later updates:
    deltalux bake office -o office.png office.dlx

    Lux on a desk, 0.8 m above the floor, as a table:
    deltalux bake room.glb --grid 0.5,0.8,0.5,4,3,0.25 --margin 0.5 -o desk.csv desk.png

    The same of a session as it was edited, where the furniture stands now:
    deltalux bake moved.dlx --grid 0.5,0.8,0.5,4,3,0.25 -o desk.csv

    Shared among four processes of this machine:
    deltalux bake room.glb --workers 4 -o lit.glb

    With a standard error below 1 %, in at most 8 GB of memory:
    deltalux bake room.glb --target-error 0.01 --memory-limit 8G -o lit.glb
    """
    planes = len(grid or ())
    targets = check_targets(output, more, [scene], planes=planes)
    shot = shot_of(camera, eye, target, size, exposure, false_colour, targets=targets, planes=planes)
    shot.check_size(session["memory_limit"])
    terminal = Terminal(as_json, quiet)
    guess = in_pixels(before_loading(scene, session["threads"]), shot.size)
    guess = replace(guess, workers=int(is_shared(workers, cluster)) * (workers or 1))
    steps = [*loading(guess), *bake_job(guess, targets, target_error)]
    with terminal.overall(steps) as progress, ExitStack() as stack:
        progress.begin("load scene")
        loaded = open_scene(scene, **reading)
        keep_inputs(targets, loaded.files)
        shot.camera_in(loaded)
        terminal.warn(loaded.warnings)
        progress.begin("place samples")
        samples, sets, left_out = make_samples(loaded, spacing, grid or (), radius, margin=margin)
        terminal.warn(left_out)
        place = stack.enter_context(place_of(workers, cluster, session["threads"], terminal, progress))
        baked, frame = bake_scene(
            loaded,
            samples,
            target_error,
            targets,
            size=shot.size,
            progress=progress,
            place=place,
            **session,
        )
        with baked:
            refine_shown(baked, targets, None if detail == NONE else detail, progress)
            write_targets(baked, targets, context.obj, shot, progress)
            progress.begin("sum up")
            data = figures(baked, frame, sets)
            terminal.warn(notes_of(baked))
    data["warnings"] += left_out
    data |= {"scene": scene, "outputs": [str(path) for path in targets]}
    written = [f"wrote {path}" for path in targets]
    terminal.result(data, summary_table(scene, data), *written)
