# SPDX-License-Identifier: Apache-2.0
"""`deltalux info`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from builders.gltf import GltfBuilder

from .conftest import CANDELA, Cli


def test_json_has_the_facts(cli: Cli, room: Path) -> None:
    facts = cli("info", room, "--json").data
    assert facts["triangles"] == 4
    assert facts["area"] == pytest.approx(16.25, rel=1e-6)
    assert facts["emissive_area"] == 0
    assert np.allclose(facts["bounds"], [[-2, 0, -2], [2, 0.7, 2]], atol=1e-6)
    assert facts["movable"] == ["MOVE_panel"]
    assert facts["unit"] == "lux"
    assert facts["warnings"] == []
    (lamp,) = facts["lights"]
    assert lamp["power"] == pytest.approx(4 * np.pi * CANDELA, rel=1e-6)


def test_table_shows_lumens_and_movables(cli: Cli, room: Path) -> None:
    out = cli("info", room).out
    assert "5,027" in out
    assert "MOVE_panel" in out


def test_movable_option_is_heard(cli: Cli, room: Path) -> None:
    assert set(cli("info", room, "--movable", "floor", "--json").data["movable"]) == {"floor", "MOVE_panel"}


def test_light_units_change_the_unit(cli: Cli, room: Path) -> None:
    assert cli("info", room, "--light-units", "unitless", "--json").data["unit"] == "W/m2"


def test_bundled_scene_by_name(cli: Cli) -> None:
    facts = cli("info", "cornell-box", "--json").data
    assert facts["triangles"] > 0
    assert facts["movable"]


def test_patterns_reach_bundled_scenes(cli: Cli) -> None:
    movable = cli("info", "expo", "--movable", "bench_*", "--json").data["movable"]
    assert {"bench_1", "bench_2"} <= set(movable)
    assert 'mesh "benk*": not in the scene; found bench_' in cli("info", "expo", "--movable", "benk*").error


def test_quiet_says_nothing(cli: Cli, room: Path) -> None:
    outcome = cli("info", room, "-q")
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")


@pytest.fixture
def furnished(tmp_path: Path) -> Path:
    """A room of 4 m with a table of 1 m, on which a glowing cup of 0.1 m and a lamp stand; two chairs."""
    builder = GltfBuilder()
    grey = builder.material(name="grey", colour=(0.5, 0.5, 0.5))
    glow = builder.material(name="glow", emissiveFactor=[100, 100, 100])
    cup = builder.node(root=False, name="cup", mesh=builder.quad(glow), scale=[0.1, 0.1, 0.1])
    bulb = builder.node(
        root=False, name="bulb", extensions=builder.light(type="point", intensity=40, color=[1, 1, 1])
    )
    builder.node(name="room", mesh=builder.quad(grey), scale=[4, 4, 4])
    builder.node(name="table", mesh=builder.quad(grey), children=[cup, bulb])
    for x in (1, 2):
        builder.node(name="chair", mesh=builder.quad(grey), translation=[x, 0, 0], scale=[0.5, 0.5, 0.5])
    builder.node(name="sun", extensions=builder.light(type="directional", intensity=1e4))
    return builder.write(tmp_path)


def test_nodes_tell_what_could_move(cli: Cli, furnished: Path) -> None:
    nodes = {node["name"]: node for node in cli("info", furnished, "--nodes", "--json").data["nodes"]}
    assert list(nodes) == ["room", "table", "cup", "bulb", "chair#1", "chair#2", "sun"]
    assert nodes["table"]["parent"] == -1
    assert nodes["cup"]["parent"] == nodes["bulb"]["parent"] == 1
    assert nodes["table"]["triangles"] == 4  # its own and the cup's
    np.testing.assert_allclose(nodes["table"]["size"], [1, 1, 0], atol=1e-6)
    np.testing.assert_allclose(nodes["cup"]["size"], [0.1, 0.1, 0], atol=1e-6)
    assert nodes["bulb"]["size"] is None
    lumens = {light["name"]: light["power"] for light in nodes["table"]["lights"]}
    assert lumens == pytest.approx({"cup (glow)": np.pi * 0.01 * 100, "bulb": 4 * np.pi * 40}, rel=1e-6)
    assert nodes["sun"]["lights"] == [{"name": "sun", "power": None}]
    assert {node["moves_with"] for node in nodes.values()} == {None}


def test_names_of_nodes_select_them(cli: Cli, furnished: Path) -> None:
    names = [node["name"] for node in cli("info", furnished, "--nodes", "--json").data["nodes"]]
    for name in names:
        movable = cli("info", furnished, "--movable", name, "--json").data["movable"]
        assert len(movable) == 1, name
    found = cli("info", furnished, "--movable", "table", "--nodes", "--json").data["nodes"]
    assert {node["name"] for node in found if node["moves_with"] == "table"} == {"table", "cup", "bulb"}


def test_the_table_of_nodes_is_indented_and_says_what_moves(cli: Cli, furnished: Path) -> None:
    out = cli("info", furnished, "--movable", "table", "--nodes").out
    lines = out[out.index("moves") :].splitlines()
    (table,) = (line for line in lines if "│ table " in line)
    (cup,) = (line for line in lines if "│   cup " in line)
    assert " 1 × 1 × 0 " in table
    assert "yes" in table
    assert " 2: 505.8 " in table
    assert "with it" in cup


def test_nodes_of_a_scene_without_a_file(cli: Cli) -> None:
    facts = cli("info", "office", "--nodes", "--json").data
    assert len(facts["nodes"]) >= 20
    assert sum(node["triangles"] for node in facts["nodes"]) == facts["triangles"]
    assert {node["moves_with"] for node in facts["nodes"]} == {None, *facts["movable"]}
    assert sum(len(node["lights"]) for node in facts["nodes"]) == len(facts["lights"])


def test_what_is_piped_is_not_cut_to_a_width(cli: Cli, tmp_path: Path) -> None:
    name = "a wall whose name is longer than terminals are wide" + "!" * 60
    builder = GltfBuilder()
    builder.node(name=name, mesh=builder.quad())
    builder.node(name="lamp", extensions=builder.light(type="point", intensity=100))
    out = cli("info", builder.write(tmp_path), "--nodes").out
    assert f"│ {name} " in out
    assert "…" not in out


def test_unit_and_upward_axis_are_heard(cli: Cli, room: Path) -> None:
    facts = cli("info", room, "--unit", "cm", "--up", "z", "--json").data
    np.testing.assert_allclose(facts["bounds"], [[-0.02, -0.02, -0.007], [0.02, 0.02, 0]], atol=1e-9)
    assert cli("info", room, "--unit", "0.01", "--up", "z", "--json").data["bounds"] == facts["bounds"]
    outcome = cli("info", room, "--unit", "mile")
    assert outcome.code == 2
    assert "found 'mile', expected one of mm, cm, m, in, ft, or how many metres" in outcome.error


def test_an_odd_size_is_asked_about(cli: Cli, tmp_path: Path) -> None:
    builder = GltfBuilder()
    builder.node(name="house", mesh=builder.quad(), scale=[0.5, 0.4, 0.3])
    path = builder.write(tmp_path)
    assert "measures 0.5 × 0.4 × 0 m: are its numbers metres?" in cli("info", path).err
    assert "are its numbers metres" not in cli("info", path, "--unit", "m").err
