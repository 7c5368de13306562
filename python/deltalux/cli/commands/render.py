# SPDX-License-Identifier: Apache-2.0
"""`deltalux render`: a picture of a scene or a session, with light computed for each pixel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import deltalux as dl
from deltalux.cli.console import Terminal
from deltalux.cli.inputs import foreign_light, open_scene
from deltalux.cli.jobs import after_loading, counts_of_session, edges_into, picture_steps, render_job
from deltalux.cli.options import (
    OF_THE_SCENE,
    SESSION,
    CameraOption,
    ExposureOption,
    EyeOption,
    FalseColourOption,
    JsonOption,
    MoreOutputsArgument,
    QuietOption,
    SizeOption,
    SourceArgument,
    TargetOption,
    parse_count,
    parse_gather,
)
from deltalux.cli.session_arguments import (
    of_the_bake,
    refuse_options_of_the_bake,
    scene_arguments,
    session_arguments,
)
from deltalux.cli.shots import LAYERS, PICTURE, shot_of
from deltalux.cli.targets import check_targets, command_line, keep_inputs
from deltalux.pace import counts_of
from deltalux.rendering import (
    MOST_RAYS,
    PATHS,
    check_size,
    render_session,
    write_exr,
)

OWN = ("paths", "gather")  # options of sessions that have other defaults here
OF_THE_BAKE = (*OF_THE_SCENE, "paths", *of_the_bake(without=OWN))

KINDS = {PICTURE: "picture", LAYERS: "light per pixel"}

RenderOutputsOption = Annotated[
    list[Path] | None,
    typer.Option(
        "-o",
        "--output",
        metavar="OUT…",
        help="Result file, its kind by suffix (repeatable, or several after one -o): .png picture, .exr "
        "numbers per pixel in layers: light, direct, indirect, albedo, normal, depth, object.",
        show_default=False,
    ),
]
RaysOption = Annotated[
    str,
    typer.Option(
        "--gather",
        parser=parse_gather,
        metavar="N|auto",
        help=f"Final-gather rays per gathered place: four times as many halve the noise. auto: {MOST_RAYS}.",
    ),
]


RenderPathsOption = Annotated[
    int | None,
    typer.Option(
        "--paths", parser=parse_count, metavar="N",
        help=f"Light paths to trace.  [dim]\\[default: {PATHS}][/]", show_default=False,
    ),
]  # fmt: skip


@scene_arguments()
@session_arguments(without=OWN)
def run(
    context: typer.Context,
    source: SourceArgument,
    more: MoreOutputsArgument = None,
    *,
    output: RenderOutputsOption = None,
    camera: CameraOption = None,
    eye: EyeOption = None,
    target: TargetOption = None,
    size: SizeOption = None,
    exposure: ExposureOption = 0.0,
    false_colour: FalseColourOption = False,
    gather: RaysOption = "auto",
    reading: dict[str, Any],
    paths: RenderPathsOption = None,
    session: dict[str, Any],
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Draw a picture in which every pixel has its own light: shadows are sharp, whatever the mesh.

    A session's picture shows its light as it is, edits included, and is the same for the same state.

    [bold]Examples[/]

    A bundled scene, and a larger picture of a file's camera:
    deltalux render office -o office.png
    deltalux render room.glb -o room.png --camera Hall --size 1920x1080

    Lux in false colours, from a place of your own, after an update:
    deltalux render moved.dlx -o lux.png --false-colour --eye 4,1.6,3 --target 0,1,0

    A picture, and its numbers for compositing:
    deltalux render room.glb -o room.png room.exr
    """
    targets = check_targets(output, more, [source], kinds=KINDS)
    if not targets:
        raise typer.BadParameter("found no result file, expected -o OUT.png or -o OUT.exr")
    if gather == "off":
        raise typer.BadParameter("found --gather off; a picture per pixel needs rays, auto or a number")
    shot = shot_of(camera, eye, target, size, exposure, false_colour, targets=targets)
    check_size(shot.size, session["memory_limit"])
    rays = None if gather == "auto" else int(gather)
    terminal, threads = Terminal(as_json, quiet), session["threads"]
    pixels, stored = shot.pixels, Path(source).suffix.lower() == SESSION
    if stored:
        refuse_options_of_the_bake(context, source, OF_THE_BAKE, "render")
    with terminal.overall(render_job(source, stored, paths, rays, pixels, threads)) as progress:
        if stored:
            opened = dl.Session.open(source, threads=threads, progress=progress)
            terminal.warn(foreign_light(opened, source))
            progress.expect(picture_steps(counts_of_session(opened), pixels, rays))
        else:
            progress.begin("load scene")
            scene = open_scene(source, **reading)
            keep_inputs(targets, scene.files)
            nowhere = dl.Samples(np.zeros((0, 3)), np.zeros((0, 3)))
            counts = counts_of(scene, nowhere, paths or PATHS, rays or MOST_RAYS, threads)
            progress.expect(after_loading(counts, pixels, rays))
            progress.begin("make session")
            opened = dl.Session(
                scene, nowhere, paths=paths or PATHS, gather=rays or MOST_RAYS, progress=progress, **session
            )
        with opened:
            terminal.warn(opened.scene.warnings)
            chosen = shot.camera_in(opened.scene)
            if not stored:
                opened.bake()
            counts = replace(counts_of_session(opened), pixels=pixels)
            progress.begin("view")
            edges_known = edges_into(progress, counts, rays)
            rendering = render_session(
                opened, camera=chosen, size=shot.size, rays=rays, keep=False, edges_known=edges_known
            )
            progress.begin("finish picture")
            picture = shot.picture_of(rendering)
            data = _facts(opened, rendering.gathered, len(rendering.pixel), picture.exposure)
        progress.begin("write files")
        about = {"program": f"deltalux {dl.__version__}", "command": command_line(context.obj), **data}
        for path in targets:
            if path.suffix.lower() == LAYERS:
                write_exr(path, rendering, about)
            else:
                replace(picture, about=about).save(path)
    data |= {"source": source, "outputs": [str(path) for path in targets]}
    terminal.result(data, *(f"wrote {path}" for path in targets))


def _facts(session: dl.Session, gathered: int, places: int, exposure: float | None) -> dict[str, Any]:
    options = session.options
    return {
        "paths": options["paths"],
        "seed": options["seed"],
        "places": places,
        "gathered": gathered,
        "exposure": exposure,
        "unit": session.scene.unit,
        "digest": session.digest(),
    }
