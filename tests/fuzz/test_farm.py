# SPDX-License-Identifier: Apache-2.0
"""A short run of every fuzz target, and proof that the harness notices what it looks for."""

from __future__ import annotations

import faulthandler
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from thoroughness import slow

from fuzz import cli_target
from fuzz.harness import MIB, Limits, fuzz

FARM = Path(__file__).parent / "farm.py"


@pytest.mark.parametrize(
    ("target", "cases", "accepted", "kinds"),
    [
        ("gltf", 30, 3, 8),
        ("obj", 80, 12, 15),
        ("session", 30, 1, 2),
        ("viewer", 5, 5, 0),
        ("cli", 6, 1, 2),
        slow("gltf", 150, 15, 25),
        slow("obj", 400, 60, 40),
        slow("session", 50, 5, 4),
        slow("viewer", 25, 25, 0),
        slow("cli", 30, 5, 10),
    ],
)
def test_a_short_run_finds_nothing(target, cases, accepted, kinds, tmp_path):
    """In a process of its own, since the engine's threads in this one would not survive a fork."""
    command = [sys.executable, str(FARM), target, "--cases", str(cases), "--seed", "9", "--json"]
    done = subprocess.run([*command, "--keep", str(tmp_path)], capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stdout + done.stderr
    (report,) = json.loads(done.stdout.splitlines()[-1])
    assert report["cases"] == cases
    assert report["failures"] == []
    # Mutations that are all refused at the door, or all harmless, would test nothing.
    assert report["outcomes"]["accepted"] >= accepted
    assert report["kinds_of_message"] >= kinds


@pytest.mark.parametrize("lines", ["", "error: found nothing\n"])
def test_an_interrupt_while_a_command_ends_is_no_failure(lines, tmp_path, monkeypatch):
    """The program's entry point answers it; the target calls what that calls."""

    def interrupted(words):
        sys.stderr.write(lines)
        raise KeyboardInterrupt

    monkeypatch.setattr(cli_target, "run", interrupted)
    (tmp_path / "case.json").write_text('[["info", "room.glb"], ["room.glb"]]')
    with pytest.raises(dl.Error, match="found nothing" if lines else "cancelled"):
        cli_target.CliTarget().run(tmp_path)


class Misbehaving:
    """A target whose cases do what the test wants."""

    name = "misbehaving"
    limits = Limits(cpu_seconds=1, wall_seconds=5.0, growth=64 * MIB, address_space=256 * MIB)

    def __init__(self, deed):
        self._deed = deed

    def prepare(self, seeds, scenes):
        (seeds / "seed.txt").write_text("a seed")

    def load(self, seeds):
        self._text = (seeds / "seed.txt").read_text()

    def make(self, rng, folder):
        (folder / "case.json").write_text(json.dumps([self._text, int(rng.integers(1000))]))

    def run(self, folder):
        assert json.loads((folder / "case.json").read_text())[0] == "a seed"
        self._deed()


def refuse():
    raise dl.FormatError("scene 17: found nothing")


def raise_key_error():
    raise KeyError("x")


def recurse():
    recurse()


def warn():
    np.float32(1e300)
    np.array([1.0]) / np.array([0.0])


def die():
    faulthandler.disable()  # pytest's would report it
    os.kill(os.getpid(), signal.SIGSEGV)


def spin():
    while True:
        pass


def sleep():
    time.sleep(60)


def allocate_much():
    np.ones(100 * MIB, np.uint8)


def allocate_too_much():
    np.ones(1000 * MIB, np.uint8)


@pytest.mark.parametrize(
    ("deed", "outcome"),
    [
        (lambda: None, "accepted"),
        (refuse, "refused"),
        (raise_key_error, "traceback"),
        (recurse, "traceback"),
        (warn, "traceback"),
        (sys.exit, "traceback"),
        (die, "crash"),
        (lambda: os._exit(0), "crash"),
        (spin, "hang"),
        (sleep, "hang"),
        (allocate_much, "memory"),
        (allocate_too_much, "memory"),
    ],
)
def test_what_a_case_does_is_noticed(deed, outcome, tmp_path):
    report = fuzz(Misbehaving(deed), 1, tmp_path / "work", cases=2, keep=tmp_path / "kept")
    assert report.cases == 2
    # The second of two large allocations does not raise the peak of the process.
    assert report.outcomes[outcome] == 2 - (deed is allocate_much)
    kept = sorted(path.name for path in (tmp_path / "kept").iterdir()) if report.failures else []
    assert kept == [f"misbehaving-1-{failure['case']}" for failure in report.failures]
    for name in kept:
        verdict = json.loads((tmp_path / "kept" / name / "verdict.json").read_text())
        assert verdict["outcome"] == outcome
        assert verdict["replay"].endswith(f"farm.py --replay {tmp_path / 'kept' / name}")
        assert (tmp_path / "kept" / name / "case.json").is_file()


def test_messages_of_a_kind_count_once_and_cases_are_functions_of_seed_and_number(tmp_path):
    def seen(seed, run):
        numbers = []
        report = fuzz(
            Misbehaving(raise_key_error), seed, tmp_path / f"work{run}", cases=3, keep=tmp_path / f"kept{run}"
        )
        for failure in report.failures:
            folder = tmp_path / f"kept{run}" / f"misbehaving-{seed}-{failure['case']}"
            numbers.append(json.loads((folder / "case.json").read_text())[1])
        return numbers

    first = seen(1, 0)
    assert len(set(first)) == 3
    assert seen(1, 1) == first != seen(2, 2)
    report = fuzz(Misbehaving(refuse), 1, tmp_path / "work", cases=5)
    assert report.messages == {"FormatError scene ##: found nothing": 5}
    assert "5 refused (1 kinds of message), 0 crashes, 0 hangs" in report.summary()


def test_a_kept_case_is_played_again(tmp_path):
    for name, content, code in (("gltf", b"no scene", 0), ("cli", b"", 1)):
        folder = tmp_path / f"{name}-1-0"
        folder.mkdir()
        (folder / "scene.glb").write_bytes(content)
        (folder / "case.json").write_text("{}" if name == "gltf" else "[]")
        command = [sys.executable, str(FARM), "--replay", str(folder)]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == code
        assert ("outcome: refused" if code == 0 else "outcome: traceback") in done.stdout
