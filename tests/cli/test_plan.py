# SPDX-License-Identifier: Apache-2.0
"""`deltalux plan`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import deltalux as dl
import pytest

from .conftest import QUICK, Cli

METHODS = ["brute_force", "disc_index", "ray_map", "sphere_cache"]


def unwrapped(out: str) -> str:
    """Text without the line breaks that a narrow terminal brings."""
    return " ".join(out.split())


def test_json_has_every_method_of_every_part(cli: Cli, room: Path) -> None:
    data = cli("plan", room, *QUICK, "--json").data
    assert list(data["parts"]) == ["static", "MOVE_panel"]
    for part in data["parts"].values():
        assert sorted(m["method"] for m in part["methods"]) == METHODS
        assert part["chosen"] in METHODS
        assert part["frames"] == 100
        assert all(m["bytes"] >= 0 and m["bake_seconds"] > 0 for m in part["methods"])


def test_table_shows_the_choice_and_the_reason(cli: Cli, room: Path) -> None:
    out = unwrapped(cli("plan", room, *QUICK).out)
    assert "MOVE_panel" in out
    assert "sphere_cache" in out
    assert "next is" in out
    assert out.count("A disc index") == 2  # never pays, pays within the bake, or after some frames


def test_no_word_on_an_index_whose_cost_is_not_known(
    cli: Cli, room: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = dl.plan

    def without_pilots(*args: Any, **options: Any) -> dl.Plan:
        plan = whole(*args, **options)
        parts = {
            name: replace(part, methods=[replace(m, piloted=False) for m in part.methods])
            for name, part in plan.parts.items()
        }
        return replace(plan, parts=parts)

    monkeypatch.setattr(dl, "plan", without_pilots)
    out = unwrapped(cli("plan", room, *QUICK).out)
    assert "next is" in out
    assert "A disc index" not in out


def test_policy_and_frames_are_heard(cli: Cli, room: Path) -> None:
    data = cli("plan", room, *QUICK, "--policy", "paper-box", "--frames", "7", "--rebuild", "--json").data
    assert (data["policy"], data["rebuild"]) == ("paper-box", True)
    panel = data["parts"]["MOVE_panel"]
    assert panel["frames"] == 7
    assert panel["chosen"] == ("sphere_cache" if panel["size_by_box"] < 0.35 else "disc_index")


def test_quiet_says_nothing(cli: Cli, room: Path) -> None:
    outcome = cli("plan", room, *QUICK, "-q")
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")


def test_an_index_that_each_frame_builds_again_never_pays_after_some_frames(cli: Cli, room: Path) -> None:
    words = ("plan", room, *QUICK, "--rebuild")
    assert "A disc index" not in unwrapped(cli(*words).out)
    assert all(part["pays_after"] is None for part in cli(*words, "--json").data["parts"].values())
