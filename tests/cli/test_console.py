# SPDX-License-Identifier: Apache-2.0
"""Tables in narrow terminals, doubts, and signs of work."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest
from builders.gltf import GltfBuilder
from deltalux.cli.console import Terminal
from rich.console import Console
from rich.table import Table

from .conftest import HALF_TURN_UP, Cli


@pytest.mark.parametrize("width", [40, 60, 80])
def test_numbers_are_not_cut_in_a_narrow_terminal(
    width: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", str(width))
    table = Table("name of what is shown here at length")
    for name in ("count of something", "error, 90 % below"):
        table.add_column(name, justify="right")
    table.add_row("a lamp of which much is said", "0.0005527", "1,234,567.8")
    table.add_row("a_shelf_whose_name_is_one_word_of_many_letters_that_goes_on_and_on", "1", "2")
    Terminal(as_json=False, quiet=False).result({}, table)
    out = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out)
    assert "0.0005527" in out
    assert "1,234,567.8" in out
    assert "…" not in out
    assert max(map(len, out.splitlines())) <= width


def dim_room(folder: Path, candela: float) -> Path:
    builder = GltfBuilder()
    grey = builder.material(name="grey", colour=(0.5, 0.5, 0.5))
    builder.node(name="floor", mesh=builder.quad(grey), rotation=HALF_TURN_UP, scale=[4, 4, 4])
    lamp = builder.light(name="lamp", type="point", intensity=candela)
    builder.node(name="lamp", translation=[2, 2, -2], extensions=lamp)
    return builder.write(folder)


def test_levels_that_no_place_has_are_doubted(cli: Cli, tmp_path: Path) -> None:
    session = tmp_path / "a.dlx"
    options = ("--paths", "2000", "--gather", "off", "--spacing", "1", "-o", session)
    outcome = cli("bake", dim_room(tmp_path, 2e-5), *options)
    text = " ".join(outcome.out.split())
    assert "doubtful: no sample has more than" in text
    assert "e-6 lx, and a full moon gives 0.3 lx; the file's lights may be in watts" in text
    assert cli("update", session, "--json").data["doubt"] is not None
    assert cli("update", session, "--dim", "lamp=0.5", "--json").data["doubt"] is None  # asked for
    assert cli("bake", dim_room(tmp_path, 400), *options, "--json").data["doubt"] is None


def test_work_without_a_measure_shows_itself_on_terminals_only(monkeypatch: pytest.MonkeyPatch) -> None:
    for terminal_like, quiet, shown in ((True, False, True), (True, True, False), (False, False, False)):
        terminal, stream = Terminal(as_json=False, quiet=quiet), io.StringIO()
        terminal._err = Console(file=stream, force_terminal=terminal_like, width=60)
        with terminal.working("load scene"):
            pass
        assert ("load scene" in stream.getvalue()) is shown
