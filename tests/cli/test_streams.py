# SPDX-License-Identifier: Apache-2.0
"""Standard streams that are closed, or that nobody reads: commands do their work and end as they would."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from deltalux.cli.streams import Unheard
from thoroughness import all_but_slow, slow

from .conftest import QUICK

PROGRAM = (sys.executable, "-m", "deltalux_program")
CLOSED = {"stdin": "<&-", "stdout": ">&-", "stderr": "2>&-", "both": ">&- 2>&-", "all": "<&- >&- 2>&-"}
GOOD, FAILURE, USAGE = 0, 1, 2


def unread() -> int:
    """The end of a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    return writing


def ran(words, **streams) -> int:
    return subprocess.run([*PROGRAM, *map(str, words)], timeout=120, **streams).returncode


@pytest.mark.parametrize("stream", all_but_slow(CLOSED, "all"))
def test_closed_streams_end_no_command(room: Path, tmp_path: Path, stream: str) -> None:
    closed = CLOSED[stream]
    outputs = [tmp_path / "a.csv", tmp_path / "a.dlx"]
    words = ["bake", room, *QUICK, "-o", *outputs]
    command = " ".join(map(str, [*PROGRAM, *words]))
    assert subprocess.run(["sh", "-c", f"{command} {closed}"], timeout=120).returncode == GOOD
    assert outputs[0].stat().st_size > 0
    # No output of the program went into its files.
    assert ran(["info", outputs[1], "--json"], stdout=subprocess.DEVNULL) == GOOD
    missing = f"{' '.join(PROGRAM)} info {tmp_path / 'none.glb'} {closed}"
    assert subprocess.run(["sh", "-c", missing], timeout=120, stderr=subprocess.DEVNULL).returncode == FAILURE


WORDS = {
    "info": (("info", "ROOM", "--json"), GOOD),
    "bake": (("bake", "ROOM", *QUICK, "-o", "OUT"), GOOD),
    "help": (("bake", "--help"), GOOD),
    "no command": ((), USAGE),
    "version": (("--version",), GOOD),
    "missing": (("info", "none.glb"), FAILURE),
    "usage": (("bake", "--no-such"), USAGE),
}


@pytest.mark.parametrize("stream", ["both", slow("stdout"), slow("stderr")])
@pytest.mark.parametrize("name", all_but_slow(WORDS, "info", "bake", "usage"))
def test_what_nobody_reads_ends_no_command(room: Path, tmp_path: Path, name, stream) -> None:
    words, code = WORDS[name]
    out = tmp_path / "a.npz"
    names = {"ROOM": room, "OUT": out}
    words = [names.get(word, word) for word in words]
    streams = ("stdout", "stderr") if stream == "both" else (stream,)
    pipe = unread()
    try:
        others = {name: subprocess.PIPE for name in ("stdout", "stderr") if name not in streams}
        done = subprocess.run(
            [*PROGRAM, *map(str, words)], timeout=120, text=True, **dict.fromkeys(streams, pipe), **others
        )
    finally:
        os.close(pipe)
    assert done.returncode == code
    assert "Traceback" not in (done.stderr or "") and "Exception" not in (done.stderr or "")
    assert out.exists() == (out in words)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
@pytest.mark.parametrize("words", [("info", "ROOM", "--json"), slow(("info", "ROOM")), slow(("--version",))])
def test_a_full_disk_is_told_in_one_line(room: Path, words) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*PROGRAM, *[str(room) if word == "ROOM" else word for word in words]],
            stdout=full, stderr=subprocess.PIPE, text=True, timeout=120,
        )  # fmt: skip
    assert done.returncode == FAILURE
    assert done.stderr == "error: No space left on device; free some space, or choose another disk\n"


def test_a_stream_without_reader_takes_everything_and_hides_no_other_failure() -> None:
    unheard = Unheard(os.fdopen(unread(), "w"))
    for _ in range(3):
        assert unheard.write("x" * 100_000) == 100_000
        unheard.flush()
    assert not unheard.isatty()
    unheard.close()
    with pytest.raises(ValueError, match="closed file"):
        unheard.write("x")
    heard = io.StringIO()
    Unheard(heard).write(json.dumps([1]))
    assert heard.getvalue() == "[1]"
