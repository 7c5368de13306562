# SPDX-License-Identifier: Apache-2.0
"""`deltalux view`: a scene or a session in the browser, where objects can be dragged."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer

import deltalux as dl
from deltalux.cli.baking import make_samples
from deltalux.cli.console import Terminal
from deltalux.cli.inputs import foreign_light, open_scene
from deltalux.cli.options import (
    AUTO,
    OF_THE_SCENE,
    SESSION,
    DetailOption,
    QuietOption,
    RadiusOption,
    SourceArgument,
    SpacingOption,
)
from deltalux.cli.places import ClusterOption, WorkersOption, place_of
from deltalux.cli.serving import FolderOption, HostOption, PortOption, warn_of_others
from deltalux.cli.session_arguments import (
    of_the_bake,
    refuse_options_of_the_bake,
    scene_arguments,
    session_arguments,
)

OF_THE_BAKE = (*OF_THE_SCENE, "spacing", "detail", "radius", *of_the_bake())

NoBrowserOption = Annotated[
    bool, typer.Option("--no-browser", help="Print the address and do not open a browser.")
]


@scene_arguments()
@session_arguments()
def run(
    context: typer.Context,
    source: SourceArgument,
    *,
    reading: dict[str, Any],
    session: dict[str, Any],
    spacing: SpacingOption = None,
    detail: DetailOption = AUTO,
    radius: RadiusOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = 0,
    folder: FolderOption = Path(),
    no_browser: NoBrowserOption = False,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    quiet: QuietOption = False,
) -> None:
    """Show a scene in the browser: drag an object, and the light follows while it moves.

    The page bakes the scene first and shows coarse light meanwhile. Then select an object with a
    click and drag its arrows; dim lamps, change colours, compare, undo, export. Ctrl-C ends it.

    [bold]Examples[/]

    The bundled atrium with its trolley:
    deltalux view atrium

    A file of your own, in which two nodes can be moved:
    deltalux view room.glb --movable chair --movable "desk lamp"

    A session that was baked before, so that there is light at once:
    deltalux view office.dlx
    """
    terminal = Terminal(as_json=False, quiet=quiet)
    with ExitStack() as stack:
        place = stack.enter_context(place_of(workers, cluster, session["threads"], terminal))
        if Path(source).suffix.lower() == SESSION:
            refuse_options_of_the_bake(context, source, OF_THE_BAKE, "view")
            with terminal.progress() as progress:
                opened = place.open(source, threads=session["threads"], progress=progress)
            terminal.warn(foreign_light(opened, source))
        else:
            with terminal.working("load scene"):
                scene = open_scene(source, **reading)
            with terminal.working("place samples"):
                samples, _, _ = make_samples(scene, spacing, (), radius, detail)
                opened = place.make(scene, samples, **session)
        terminal.warn(opened.scene.warnings)
        if not opened.poses:
            terminal.warn(
                ["nothing here can be moved yet; use Make movable in the page, or name it with --movable"]
            )
        warn_of_others(terminal, host)
        with opened:
            shown = dl.view(
                opened, host=host, port=port, folder=folder, open_browser=not no_browser, block=False
            )
            typer.echo(f"{source} is shown at {shown.url}\nCtrl-C ends it")
            shown.wait()
