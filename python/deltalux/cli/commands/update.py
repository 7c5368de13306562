# SPDX-License-Identifier: Apache-2.0
"""`deltalux update`: edit a saved session and trace only what the edit touches."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from deltalux.cli.baking import figures, summary_table, total_milliseconds
from deltalux.cli.console import Terminal
from deltalux.cli.edits import Edits, queue_edits
from deltalux.cli.inputs import foreign_light
from deltalux.cli.jobs import after_opening, counts_of_session, in_pixels, update_job
from deltalux.cli.options import (
    CameraOption,
    ExposureOption,
    EyeOption,
    FalseColourOption,
    JsonOption,
    MoreOutputsArgument,
    Move,
    OutputsOption,
    QuietOption,
    SessionArgument,
    Setting,
    SizeOption,
    TargetOption,
    ThreadsOption,
    parse_dim,
    parse_move,
    parse_reflectance,
)
from deltalux.cli.places import ClusterOption, WorkersOption, is_shared, notes_of, place_of
from deltalux.cli.shots import shot_of
from deltalux.cli.targets import check_targets, keep_inputs, write_refined

from .watch import Watch, WatchedFile

MoveOption = Annotated[
    list[Move] | None,
    typer.Option(
        "--move",
        parser=parse_move,
        metavar="NAME=dx,dy,dz[,degrees]",
        help="Move an object by metres, and turn it by degrees about +Y through its own origin.",
    ),
]
RemoveOption = Annotated[
    list[str] | None, typer.Option("--remove", metavar="NAME", help="Remove an object from the scene.")
]
AddOption = Annotated[
    list[str] | None, typer.Option("--add", metavar="NAME", help="Put a removed object back.")
]
DimOption = Annotated[
    list[Setting] | None,
    typer.Option(
        "--dim",
        parser=parse_dim,
        metavar="GROUP=f",
        help="Set a light group to f times its loaded power (0 = off, 1 = as loaded). Where lamps of one "
        "name are groups of their own, lamp means all of them, lamp#1 the first; 'spot*' describes several.",
    ),
]
ReflectanceOption = Annotated[
    list[Setting] | None,
    typer.Option(
        "--reflectance",
        parser=parse_reflectance,
        metavar="MATERIAL=r,g,b",
        help="Set a material's reflectance, 0 to 1.",
    ),
]

WatchOption = Annotated[
    Path | None,
    typer.Option(
        "--watch",
        metavar="FILE.json",
        help="Keep running and follow this file of edits: whenever it changes, results are written anew.",
        show_default=False,
    ),
]


def run(
    context: typer.Context,
    session: SessionArgument,
    more: MoreOutputsArgument = None,
    output: OutputsOption = None,
    move: MoveOption = None,
    remove: RemoveOption = None,
    add: AddOption = None,
    dim: DimOption = None,
    reflectance: ReflectanceOption = None,
    watch: WatchOption = None,
    threads: ThreadsOption = None,
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
    """Edit a saved session: only the light that the edit touches is traced again.

    Every edit can be repeated; all are applied together. The result equals a bake of the session in
    its new state to the last bit. (A file in which lamps stand elsewhere or reflectances differ is another
    scene: its paths and rays aim elsewhere, so that its light differs by noise.) A session of another
    build or processor, whose bits may differ, is computed again first. The session file itself stays as it
    is: write a new one with -o.

    [bold]Examples[/]

    Half a metre along +X and a quarter turn:
    deltalux update office.dlx --move chair=0.5,0,0,90 -o moved.png moved.dlx

    The lamps at the wall at 30 %, the lamp on the desk away:
    deltalux update office.dlx --dim "wall row=0.3" --remove desk_lamp -o evening.png

    Again at each change of a file, without opening the session each time, until Ctrl-C:
    deltalux update office.dlx --watch edits.json -o now.png

    with such a file, whose kinds are the options, and which always starts from the session as it was
    opened: {"move": {"chair": [0.5, 0, 0, 90]}, "dim": {"wall row": 0.3}, "remove": ["desk_lamp"]}
    """
    edits = Edits(add or (), move or (), remove or (), dim or (), reflectance or ())
    inputs = [session] if watch is None else [session, watch]
    targets = check_targets(output, more, inputs)
    shot = shot_of(camera, eye, target, size, exposure, false_colour, targets=targets)
    terminal = Terminal(as_json, quiet)
    with ExitStack() as stack:
        shared = workers or 1 if is_shared(workers, cluster) else 0
        with terminal.overall(update_job(session, targets, shot.size, threads, shared)) as progress:
            place = stack.enter_context(place_of(workers, cluster, threads, terminal, progress))
            opened = stack.enter_context(place.open(session, threads=threads, progress=progress))
            keep_inputs(targets, opened.scene.files)
            shot.camera_in(opened.scene)
            shot.check_size(opened.options["memory_limit"])
            counts = in_pixels(counts_of_session(opened), shot.size)
            foreign = foreign_light(opened, str(session))
            progress.expect(after_opening(counts, targets, again=bool(foreign)))
            if foreign:
                terminal.warn(foreign)
                opened.recompute()
            queue_edits(opened, edits)
            if watch is None:
                frame = opened.update()
                write_refined(opened, targets, context.obj, shot, progress)
                progress.begin("sum up")
                data = figures(opened, frame)
                terminal.warn(notes_of(opened))
        if watch is not None:
            follower = Watch(opened, str(session), watch, targets, context.obj, shot, terminal)
            terminal.say(f"{session} is open and follows {watch}; Ctrl-C ends it")
            follower.follow(WatchedFile(watch))
            return
    data |= {
        "session": str(session),
        "affected_paths": frame.affected_paths,
        "retraced_segments": frame.retraced_segments,
        "recomputed": bool(foreign),
        "recomputed_because": " ".join(foreign) or None,
        "outputs": [str(path) for path in targets],
    }
    lines = [
        f"{frame.affected_paths:,} paths traced again ({frame.retraced_segments:,} segments) "
        f"in {total_milliseconds(frame):,.1f} ms",
        *(f"wrote {path}" for path in targets),
    ]
    terminal.result(data, summary_table(str(session), data), *lines)
