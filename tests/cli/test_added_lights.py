# SPDX-License-Identifier: Apache-2.0
"""`--lamp` and `--sun`: which commands have them, their values, and light in a file that has none."""

from __future__ import annotations

from pathlib import Path

import pytest
from builders.gltf import GltfBuilder
from deltalux.cli import app
from typer.main import get_command

from .conftest import HALF_TURN_UP, QUICK, Cli

COMMANDS = get_command(app).commands  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def dark(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A floor of 4 m x 4 m and nothing else."""
    builder = GltfBuilder()
    floor = {"rotation": HALF_TURN_UP, "translation": [-2, 0, 2], "scale": [4, 4, 4]}
    builder.node(name="floor", mesh=builder.quad(builder.material(colour=(0.5, 0.5, 0.5))), **floor)
    return builder.write(tmp_path_factory.mktemp("dark"), "dark.glb")


@pytest.mark.parametrize("verb", ["bake", "render", "plan", "view", "info", "compare-methods"])
def test_commands_that_read_a_scene_have_them(verb: str) -> None:
    names = {parameter.name for parameter in COMMANDS[verb].params}
    assert {"lamp", "sun", "light_units", "unit", "up", "groups"} <= names
    assert ("movable" in names) == (verb != "compare-methods")
    assert "reading" not in names


def test_a_dark_file_says_how_to_add_light(cli: Cli, dark: Path) -> None:
    assert "add some (--lamp auto, --lamp X,Y,Z or --sun" in cli("info", dark).err
    assert "no light" not in cli("info", dark, "--lamp", "auto").err


def test_info_shows_the_lights(cli: Cli, dark: Path) -> None:
    added = cli("info", dark, "--lamp", "0,2,0,1000", "--lamp", "auto", "--sun", "90,45", "--json").data
    shown = {light["name"]: light["kind"] for light in added["lights"]}
    assert shown == {"lamp": "point", "lamp 2": "point", "sun": "sun"}
    assert added["lights"][0]["power"] == pytest.approx(1000)


def test_they_shine(cli: Cli, dark: Path, tmp_path: Path) -> None:
    table = tmp_path / "floor.csv"
    grid = ("--grid", "-0.5,0.0,-0.5,1,1,0.5")
    run = cli("bake", dark, *grid, *QUICK, "--sun", "0,30,1000", "--lamp", "0,2,0,0", "-o", table, "--json")
    assert run.code == 0, run.err
    assert run.data["sets"][0]["mean"] == pytest.approx(500, rel=1e-3)


@pytest.mark.parametrize("word", ["1,2", "1,2,3,-4", "here"])
def test_lamps_that_there_are_not(cli: Cli, dark: Path, word: str) -> None:
    run = cli("info", dark, "--lamp", word)
    assert run.code == 2
    assert f"found '{word}', expected X,Y,Z in metres" in " ".join(run.err.split())


@pytest.mark.parametrize(
    "words", [("--sun", "1"), ("--sun", "0,91"), ("--sun", "0,30,-1"), ("--sun", "nan,3")]
)
def test_suns_that_there_are_not(cli: Cli, dark: Path, words: tuple[str, str]) -> None:
    run = cli("info", dark, *words)
    assert run.code == 2
    assert f"found '{words[1]}', expected AZIMUTH,ELEVATION" in " ".join(run.err.split())


def test_a_stored_session_has_its_lights(cli: Cli, session_file: Path) -> None:
    run = cli("info", session_file, "--lamp", "auto")
    assert run.code == 2
    assert "--lamp" in run.err
