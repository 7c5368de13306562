# SPDX-License-Identifier: Apache-2.0
"""`deltalux plan`."""

from __future__ import annotations

from pathlib import Path

from .conftest import QUICK, Cli

METHODS = ["brute_force", "disc_index", "ray_map", "sphere_cache"]


def test_json_has_every_method_of_every_part(cli: Cli, room: Path) -> None:
    data = cli("plan", room, *QUICK, "--json").data
    assert list(data["parts"]) == ["static", "MOVE_panel"]
    for part in data["parts"].values():
        assert sorted(m["method"] for m in part["methods"]) == METHODS
        assert part["chosen"] in METHODS
        assert part["frames"] == 100
        assert all(m["bytes"] >= 0 and m["bake_seconds"] > 0 for m in part["methods"])


def test_table_shows_the_choice_and_the_reason(cli: Cli, room: Path) -> None:
    out = cli("plan", room, *QUICK).out
    assert "MOVE_panel" in out
    assert "sphere_cache" in out
    assert "next is" in out


def test_policy_and_frames_are_heard(cli: Cli, room: Path) -> None:
    data = cli("plan", room, *QUICK, "--policy", "paper-box", "--frames", "7", "--rebuild", "--json").data
    assert (data["policy"], data["rebuild"]) == ("paper-box", True)
    panel = data["parts"]["MOVE_panel"]
    assert panel["frames"] == 7
    assert panel["chosen"] == ("sphere_cache" if panel["size_by_box"] < 0.35 else "disc_index")


def test_quiet_says_nothing(cli: Cli, room: Path) -> None:
    outcome = cli("plan", room, *QUICK, "-q")
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
