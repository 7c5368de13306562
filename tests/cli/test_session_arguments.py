# SPDX-License-Identifier: Apache-2.0
"""Options of a session on the command line: which commands have them, and what becomes of their values."""

from __future__ import annotations

from typing import Any

import pytest
import typer
from deltalux.cli import app
from deltalux.cli.commands import render, view
from deltalux.cli.options import SESSION_OPTIONS
from deltalux.cli.session_arguments import session_arguments
from deltalux.session_options import OPTIONS, PlanOptions, options_of
from typer.main import get_command

COMMANDS = get_command(app).commands  # type: ignore[attr-defined]


def test_all_are_options_of_a_session() -> None:
    assert set(SESSION_OPTIONS) <= set(OPTIONS)


@pytest.mark.parametrize(
    ("verb", "others"),
    [
        ("bake", set()),
        ("view", set()),
        ("plan", set(SESSION_OPTIONS) - set(options_of(PlanOptions))),
        ("render", {"paths", "gather"}),
    ],
)
def test_commands_have_them_with_the_defaults_of_a_session(verb: str, others: set[str]) -> None:
    parameters = {parameter.name: parameter for parameter in COMMANDS[verb].params}
    for name in set(SESSION_OPTIONS) - others:
        assert parameters[name].default == OPTIONS[name].default
        assert f"--{name.replace('_', '-')}" in parameters[name].opts
        assert parameters[name].help
    assert "session" not in parameters
    assert ("memory_limit" in parameters) == (verb != "plan")


def test_a_command_gets_their_values_together() -> None:
    got: dict[str, Any] = {}

    @session_arguments(without=("gather",))
    def command(scene: str, *, session: dict[str, Any], quiet: bool = False) -> None:
        got.update(session, scene=scene, quiet=quiet)

    program = typer.Typer()
    program.command()(command)
    words = ["room", "--paths", "2e3", "--memory-limit", "1G", "--quiet"]
    get_command(program).main(words, standalone_mode=False)
    expected = {name: OPTIONS[name].default for name in SESSION_OPTIONS if name != "gather"}
    expected |= {"scene": "room", "quiet": True, "paths": 2000, "memory_limit": 2**30}
    assert got == expected


def test_a_stored_session_brings_all_but_threads() -> None:
    assert set(view.OF_THE_BAKE) >= set(SESSION_OPTIONS) - {"threads"}
    assert set(render.OF_THE_BAKE) >= set(SESSION_OPTIONS) - {"threads", "gather"}
    assert not {"threads", "gather"} & set(render.OF_THE_BAKE)
    assert "threads" not in view.OF_THE_BAKE
