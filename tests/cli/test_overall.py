# SPDX-License-Identifier: Apache-2.0
"""The overall bar foresees every stage of the long verbs, and is drawn while they are silent."""

from __future__ import annotations

import io
import time
from pathlib import Path

import deltalux as dl
import pytest
from deltalux.cli import console
from deltalux.pace import Overall, Step
from rich.console import Console

from .conftest import QUICK, Cli


@pytest.fixture
def bars(monkeypatch: pytest.MonkeyPatch) -> list[Overall]:
    """Whatever overall estimates commands make."""
    made: list[Overall] = []

    class Kept(Overall):
        def __init__(self, *given: object) -> None:
            super().__init__(*given)
            made.append(self)

    monkeypatch.setattr(console, "Overall", Kept)
    return made


def check(cli: Cli, bars: list[Overall], *words: str | Path) -> None:
    outcome = cli(*words)
    assert outcome.code == 0, outcome.err
    (bar,) = bars
    assert bar.unforeseen == []
    assert bar.state().share == 1.0
    bars.clear()


def test_every_stage_of_a_bake_is_foreseen(cli: Cli, bars: list[Overall], room: Path, tmp_path: Path) -> None:
    files = [tmp_path / f"out{suffix}" for suffix in (".dlx", ".png", ".glb", ".csv", ".npz")]
    check(cli, bars, "bake", room, *QUICK, "-o", *files)
    check(cli, bars, "bake", room, *QUICK, "-o", tmp_path / "discs.png", "--gather", "off")
    grid = ("--grid", "0.5,0.8,0.5,1,1,0.25")
    check(cli, bars, "bake", room, "--paths", "20000", "--gather", "64", *grid, "-o", tmp_path / "plane.png")
    check(cli, bars, "bake", room, *QUICK, "--gather", "32", "--target-error", "0.05")


def test_every_stage_of_an_update_is_foreseen(
    cli: Cli, bars: list[Overall], room: Path, tmp_path: Path
) -> None:
    session, files = tmp_path / "room.dlx", [tmp_path / f"new{suffix}" for suffix in (".dlx", ".png", ".npz")]
    check(cli, bars, "bake", room, *QUICK, "-o", session)
    with dl.Session.open(session) as opened:
        name, material = next(iter(opened.poses)), opened.scene.materials[0].name
        group = next(iter(opened.dim_factors))
    check(cli, bars, "update", session, f"--move={name}=0.05,0,0", "-o", *files)
    check(cli, bars, "update", session, "--remove", name, f"--dim={group}=0.5")
    check(cli, bars, "update", session, f"--reflectance={material}=0.8,0.8,0.8")


def test_every_stage_of_a_picture_is_foreseen(
    cli: Cli, bars: list[Overall], room: Path, tmp_path: Path
) -> None:
    session, small = tmp_path / "room.dlx", ("--size", "64x40")
    check(cli, bars, "bake", room, *QUICK, "-o", session)
    files = (tmp_path / "a.png", tmp_path / "a.exr")
    check(cli, bars, "render", session, *small, "-o", *files)
    check(cli, bars, "render", room, *small, "--paths", "20000", "--gather", "32", "-o", *files)


def test_the_bar_is_drawn_while_nothing_is_reported() -> None:
    screen = io.StringIO()
    overall = Overall([Step("silent", 5.0)])
    shown = Console(file=screen, force_terminal=True, width=100)
    with console.OverallBar(overall, shown, disable=False):
        overall.begin("silent")
        time.sleep(0.7)
    drawn = screen.getvalue().count("silent")
    assert drawn >= 3
    assert "ETA" in screen.getvalue()


def test_every_step_is_drawn_however_short() -> None:
    terminal, screen = console.Terminal(as_json=False, quiet=False), io.StringIO()
    terminal._err = Console(file=screen, force_terminal=True, width=100)
    with terminal.overall([Step(name, 5.0) for name in ("first", "second", "third")]) as overall:
        overall("first", 0.5)
        overall.begin("second")
        overall("third", 1.0)
    drawn = screen.getvalue()
    assert 0 <= drawn.find("first") < drawn.find("second") < drawn.find("third")
