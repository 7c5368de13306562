# SPDX-License-Identifier: Apache-2.0
"""`deltalux info`: contents of a scene before any light is traced, and of a session file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from deltalux.cli.console import Terminal
from deltalux.cli.inputs import open_scene
from deltalux.cli.options import (
    OF_THE_SCENE,
    SESSION,
    JsonOption,
    QuietOption,
    SourceArgument,
)
from deltalux.cli.session_arguments import refuse_options_of_the_bake, scene_arguments
from deltalux.quantities import significant
from deltalux.stored.facts import file_facts
from deltalux.units import LUX

from .node_list import node_facts, node_table
from .session_tables import session_tables


@scene_arguments()
def run(
    context: typer.Context,
    source: SourceArgument,
    *,
    reading: dict[str, Any],
    nodes: Annotated[
        bool,
        typer.Option("--nodes", help="Show the tree of nodes: names, sizes, triangles, lights, what moves."),
    ] = False,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Show what a scene holds: size, lights with their power, movable objects, warnings.

    Of a session: also what made it, its samples and paths, its edits, and its size by part.

    [bold]Examples[/]

    deltalux info office

    What could move, by name:
    deltalux info office --nodes

    deltalux info room.glb --movable 'chair*' --json

    deltalux info office.dlx
    """
    terminal = Terminal(as_json, quiet)
    stored = Path(source).suffix.lower() == SESSION
    session: dict[str, Any] = {}
    if stored:
        refuse_options_of_the_bake(context, source, OF_THE_SCENE, "info")
        with terminal.working("read session"):
            session, scene = file_facts(source)
    else:
        with terminal.working("load scene"):
            scene = open_scene(source, **reading)
    facts = dict(scene.info())
    tables = [_facts_table(source, facts)]
    if stored:
        facts["session"] = session
        tables += session_tables(session)
    if facts["lights"]:
        tables.append(_lights_table(facts))
    if nodes:
        facts["nodes"] = node_facts(scene)
        tables.append(node_table(facts["nodes"], scene.unit))
    terminal.result(facts, *tables)
    if not as_json:
        terminal.warn(facts["warnings"])


def _facts_table(name: str, facts: Mapping[str, Any]) -> Table:
    table = Table(title=name, show_header=False, title_justify="left")
    low, high = facts["bounds"]
    size = " × ".join(significant(b - a) for a, b in zip(low, high, strict=True))
    table.add_row("triangles", f"{facts['triangles']:,}")
    luminous = significant(facts["emissive_area"])
    table.add_row("area", f"{significant(facts['area'])} m², of which {luminous} m² luminous")
    table.add_row("size", f"{size} m")
    table.add_row("movable", ", ".join(facts["movable"]) or "nothing (see --movable)")
    table.add_row("unit of results", "lx" if facts["unit"] == LUX else facts["unit"])
    return table


def _lights_table(facts: Mapping[str, Any]) -> Table:
    unit = "lm" if facts["unit"] == LUX else "W"
    table = Table("light", "kind", "group", f"power ({unit})", title="lights", title_justify="left")
    table.columns[3].justify = "right"
    for light in facts["lights"]:
        power = light["power"]
        shown = "unbounded" if power is None else significant(power)
        table.add_row(light["name"], light["kind"], light["group"], shown)
    return table
