# SPDX-License-Identifier: Apache-2.0
"""Names of files and objects are printed as they are, also those that look like markup of the terminal."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from builders.gltf import GltfBuilder
from deltalux.cli.console import OverallBar, Terminal, print_error
from deltalux.pace import Overall, Step
from rich.console import Console
from rich.table import Table
from thoroughness import all_but_slow

from .conftest import HALF_TURN_UP, Cli

NAMES = ["lamp [on]", "[/x]", "[bold]x[/bold]", "[link=a]", "desk :bulb: lamp", "\\[a]", "[[red]]", "[/]"]


def named_room(folder: Path, name: str) -> Path:
    builder = GltfBuilder()
    grey = builder.material(name=name, colour=(0.5, 0.5, 0.5))
    builder.node(name=name, mesh=builder.quad(grey), rotation=HALF_TURN_UP, extras={"movable": True})
    lamp = builder.light(name=name, type="point", intensity=400.0)
    builder.node(name=f"{name} light", translation=[0.5, 1, -0.5], extensions=lamp)
    return builder.write(folder)


@pytest.mark.parametrize("name", all_but_slow(NAMES[:2] + NAMES[4:5], NAMES[0]))
def test_names_are_printed_as_they_are(cli: Cli, tmp_path: Path, name: str) -> None:
    room, session = named_room(tmp_path, name), tmp_path / "room.dlx"
    for words in (("info", room), ("info", room, "--nodes"), ("plan", room)):
        outcome = cli(*words)
        assert outcome.code == 0, outcome.err
        assert name in outcome.out or words[0] == "plan"
    made = cli("bake", room, "--paths", "500", "--gather", "8", "--spacing", "0.5", "-o", session)
    assert made.code == 0, made.err
    assert name in made.out
    moved = tmp_path / "moved.dlx"
    edits = ("--remove", name, "--dim", f"{name} light=0.5", "--reflectance", f"{name}=0.2")
    made = cli("update", session, *edits, "-o", moved)
    assert made.code == 0, made.err
    assert name in cli("info", moved).out
    assert cli("compare", session, moved).code == 0
    assert f'"{name} absent"' in cli("info", room, "--movable", f"{name} absent").error
    assert json.loads(cli("info", room, "--json").out)["movable"] == [name]


@pytest.mark.parametrize("name", NAMES)
def test_tables_errors_warnings_and_progress_print_names(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    table = Table(name, title=name, caption=name)
    table.add_row(name)
    terminal = Terminal(as_json=False, quiet=False)
    terminal.result({}, table, f"wrote {name}")
    assert capsys.readouterr().out.count(name) == 5
    terminal.warn([name])
    print_error(name)
    assert capsys.readouterr().err.splitlines() == [f"warning: {name}", f"error: {name}"]

    stream = io.StringIO()
    terminal._err = Console(file=stream, force_terminal=True, width=200)
    with terminal.working(name):
        pass
    with terminal.progress() as progress:
        progress(name, 0.5)
    assert stream.getvalue().count(name) >= 2
    stream = io.StringIO()
    overall = Overall([Step(name, 1.0)])
    overall.begin(name)
    with OverallBar(overall, Console(file=stream, force_terminal=True, width=200), disable=False):
        pass
    assert name in stream.getvalue()
    assert np.isfinite(overall.state().share)
