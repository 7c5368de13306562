# SPDX-License-Identifier: Apache-2.0
"""The program as a process: streams, terminals, signals."""

from __future__ import annotations

import inspect
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from processes import interrupt_after, listen_to_interrupts
from thoroughness import slow

from .conftest import QUICK

PROJECT = Path(__file__).parents[2] / "pyproject.toml"
PROGRAM = (sys.executable, "-m", "deltalux_program")
LONG = ("cornell_box", "--paths", "5e7", "--gather", "off", "--memory-limit", "400G")  # a minute and more


def test_streams_of_a_pipe_hold_the_result_and_nothing_else(room: Path) -> None:
    done = subprocess.run([*PROGRAM, "bake", room, *QUICK, "--json"], capture_output=True, text=True)
    assert done.returncode == 0
    assert json.loads(done.stdout)["samples"] > 0
    assert done.stderr == ""


def test_progress_appears_on_a_terminal(room: Path) -> None:
    master, terminal = pty.openpty()
    with subprocess.Popen(
        [*PROGRAM, "bake", room, "--paths", "2e5", "--gather", "64", "--json"],
        stdout=subprocess.PIPE,
        stderr=terminal,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    ) as process:
        os.close(terminal)
        assert process.stdout is not None
        result = shown = b""
        streams = [master, process.stdout.fileno()]
        # Both in turn: a terminal holds few bytes, and a writer that is not read waits.
        while streams:
            for stream in select.select(streams, [], [])[0]:
                try:
                    chunk = os.read(stream, 65536)
                except OSError:  # the terminal's other end is closed
                    chunk = b""
                if not chunk:
                    streams.remove(stream)
                elif stream == master:
                    shown += chunk
                else:
                    result += chunk
    os.close(master)
    assert process.returncode == 0
    assert json.loads(result)["paths"] == 200_000
    assert b"trace" in shown
    assert b"%" in shown


def test_interrupt_cancels_soon_with_130_and_leaves_no_file(tmp_path: Path) -> None:
    file = tmp_path / "result.npz"
    with subprocess.Popen(
        [*PROGRAM, "bake", *LONG, "-o", file],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=listen_to_interrupts,
    ) as process:
        out, err, still_taken = interrupt_after(process, 3)  # libraries, and some of the bake
    assert process.returncode == 130
    assert (out, err) == ("", "error: cancelled\n")
    assert still_taken < 2.0
    assert list(tmp_path.iterdir()) == []


class InterruptedAt:
    """An importer that interrupts its own process, or kills it, when a module is looked for."""

    def __init__(self, name: str, by: int = signal.SIGINT) -> None:
        self._name, self._by = name, by

    def find_spec(self, name: str, *_: object) -> None:
        if name == self._name:
            os.kill(os.getpid(), self._by)


def test_a_terminal_is_told_at_once_that_libraries_are_loaded(tmp_path: Path) -> None:
    """What it shows when the first one is looked for; the process ends there."""
    code = f"import os, signal, sys\n{inspect.getsource(InterruptedAt)}\n"
    code += "sys.meta_path.insert(0, InterruptedAt('numpy', signal.SIGKILL))\n"
    code += "from deltalux_program import main; main()"
    master, terminal = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", code, "update", tmp_path / "none.dlx"], stderr=terminal
    ) as process:
        os.close(terminal)
        assert process.wait(60) == -signal.SIGKILL
        assert os.read(master, 65536).startswith(b"loading libraries")
    os.close(master)


@pytest.mark.parametrize(
    "module", ["deltalux", slow("numpy"), "deltalux._core", slow("typer"), "deltalux.cli.commands.view"]
)
def test_interrupt_while_libraries_are_loaded_is_as_quiet(module: str) -> None:
    entry = re.search(r'^deltalux = "(\w+(?:\.\w+)*):(\w+)"$', PROJECT.read_text(), re.MULTILINE)
    assert entry is not None
    code = f"import os, signal, sys\n{inspect.getsource(InterruptedAt)}\n"
    code += f"sys.meta_path.insert(0, InterruptedAt({module!r}))\n"
    code += f"from {entry[1]} import {entry[2]} as main\nsys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", code, "--version"],
        capture_output=True,
        text=True,
        preexec_fn=listen_to_interrupts,
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: cancelled\n")


def test_an_ignored_interrupt_stays_ignored() -> None:
    """As that of a job in the background of a script."""
    code = f"import os, signal, sys\n{inspect.getsource(InterruptedAt)}\n"
    code += "sys.meta_path.insert(0, InterruptedAt('numpy'))\nfrom deltalux_program import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "--version"],
        capture_output=True,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("deltalux ")


def test_reader_that_closes_early_is_no_failure(room: Path) -> None:
    command = " ".join(map(str, [*PROGRAM, "info", room, "--json"]))
    done = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command} | true"], capture_output=True, text=True
    )
    assert done.stderr == ""
