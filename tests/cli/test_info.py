# SPDX-License-Identifier: Apache-2.0
"""`deltalux info`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

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


def test_quiet_says_nothing(cli: Cli, room: Path) -> None:
    outcome = cli("info", room, "-q")
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
