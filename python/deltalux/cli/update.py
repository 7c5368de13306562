# SPDX-License-Identifier: Apache-2.0
"""`deltalux update`: edit a saved session and trace only what the edit touches."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import deltalux as dl
from deltalux.naming import meant_by

from .baking import figures, summary_table, total_milliseconds
from .console import Terminal
from .inputs import foreign_light
from .jobs import after_opening, counts_of_session, update_job
from .options import (
    FalseColourOption,
    JsonOption,
    MoreOutputsArgument,
    Move,
    OutputsOption,
    QuietOption,
    Setting,
    ThreadsOption,
    parse_dim,
    parse_move,
    parse_reflectance,
)
from .targets import check_targets, keep_inputs, refine_shown, write_targets

SessionArgument = Annotated[
    Path,
    typer.Argument(metavar="SESSION.dlx", help="A session that bake or update wrote.", show_default=False),
]
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
    list[str] | None, typer.Option("--remove", metavar="NAME", help="Take an object away.")
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
    threads: ThreadsOption = None,
    false_colour: FalseColourOption = False,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Edit a saved session: only the light that the edit touches is traced again.

    Every edit can be repeated; all are applied together. The result equals a bake of the edited
    scene to the last bit. A session of another build or processor, whose bits may differ, is computed
    again first. The session file itself stays as it is: write a new one with -o.

    [bold]Examples[/]

    Half a metre along +X and a quarter turn:
    deltalux update office.dlx --move chair=0.5,0,0,90 -o moved.png moved.dlx

    The lamps at the wall at 30 %, the lamp on the desk away:
    deltalux update office.dlx --dim "wall row=0.3" --remove desk_lamp -o evening.png
    """
    targets = check_targets(output, more, [session])
    terminal = Terminal(as_json, quiet)
    with (
        terminal.overall(update_job(session, targets, threads)) as progress,
        dl.Session.open(session, threads=threads, progress=progress) as opened,
    ):
        keep_inputs(targets, opened.scene.files)
        foreign = foreign_light(opened, str(session))
        progress.expect(after_opening(counts_of_session(opened), targets, again=bool(foreign)))
        if foreign:
            terminal.warn(foreign)
            opened.recompute()
        for name in add or ():
            opened.add(name)
        for step in move or ():
            opened.move(step.name, moved_pose(opened.pose(step.name), step))
        for name in remove or ():
            opened.remove(name)
        for setting in dim or ():
            for group in meant_by(setting.name, list(opened.dim_factors)):
                opened.dim(group, setting.values[0])
        for setting in reflectance or ():
            opened.set_reflectance(setting.name, setting.values)
        frame = opened.update()
        display = opened.samples.display
        refine_shown(opened, targets, display.detail_length if display else None, progress)
        write_targets(opened, targets, context.obj, false_colour, progress)
        progress.begin("sum up")
        data = figures(opened, frame)
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


def moved_pose(pose: np.ndarray, step: Move) -> np.ndarray:
    """Return `pose` (4x4) turned about +Y through its own origin and shifted.

    Parameters
    ----------
    pose : (4, 4) local to world, column vectors
    step : offset in metres, angle in degrees, counter-clockwise seen from above
    """
    angle = math.radians(step.degrees)
    c, s = math.cos(angle), math.sin(angle)
    result = np.array(pose, dtype=np.float64)
    if step.degrees:
        result[:3, :3] = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ result[:3, :3]
    result[:3, 3] += step.offset
    return result
