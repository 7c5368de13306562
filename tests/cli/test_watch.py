# SPDX-License-Identifier: Apache-2.0
"""`update --watch`: a session that stays open and follows a file of edits."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from deltalux.cli.commands import watch
from deltalux.cli.commands.watch import WatchedFile
from deltalux.cli.edits import Edits, edits_of_json
from deltalux.cli.options import Move, Setting
from deltalux.errors import FormatError, OptionError
from deltalux.outputs import tables
from processes import listen_to_interrupts

from .conftest import Cli
from .test_process import PROGRAM

MOVE = {"move": {"MOVE_panel": [1, 0, -1]}}
SAME_MOVE = ("--move", "MOVE_panel=1,0,-1")
TIMEOUT = 30.0  # seconds


def write(path: Path, data: Any) -> None:
    """As many editors do: written beside and renamed."""
    aside = path.with_suffix(".tmp")
    aside.write_text(data if isinstance(data, str) else json.dumps(data))
    aside.replace(path)


class Running:
    """`deltalux update … --watch edits.json --json` as a process."""

    def __init__(self, session: Path, folder: Path, *words: str) -> None:
        self.file = folder / "edits.json"
        self.process = subprocess.Popen(
            [*PROGRAM, "update", session, "--watch", self.file, "--json", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=listen_to_interrupts,
        )

    def record(self) -> dict[str, Any]:
        """The next line of standard output."""
        assert self.process.stdout is not None
        return json.loads(self.process.stdout.readline())

    def end(self) -> tuple[int, str, str]:
        """Interrupt it: exit code, what else it wrote, errors."""
        self.process.send_signal(signal.SIGINT)
        out, err = self.process.communicate(timeout=TIMEOUT)
        return self.process.returncode, out, err


@pytest.fixture
def start(session_file: Path, tmp_path: Path) -> Iterator[Callable[..., Running]]:
    started: list[Running] = []

    def call(*words: str) -> Running:
        started.append(Running(session_file, tmp_path, *words))
        return started[-1]

    yield call
    for running in started:
        running.process.kill()
        running.process.communicate()


def test_each_change_gives_what_update_gives_and_nothing_is_left_of_the_one_before(
    cli: Cli, session_file: Path, tmp_path: Path, start: Callable[..., Running]
) -> None:
    before = hashlib.sha256(session_file.read_bytes()).digest()
    original = cli("update", session_file, "--json").data["digest"]
    moved = cli("update", session_file, *SAME_MOVE, "--json").data["digest"]
    both = cli("update", session_file, *SAME_MOVE, "--dim", "lamp=0.5", "--json").data["digest"]
    result = tmp_path / "now.npz"
    running = start("-o", str(result))
    write(running.file, MOVE)
    first = running.record()
    assert (first["digest"], first["outputs"]) == (moved, [str(result)])
    assert first["affected_paths"] > 0
    assert tables.read(result).points[:, 0].max() <= 2.0
    write(running.file, MOVE | {"dim": {"lamp": 0.5}})
    second = running.record()
    assert (second["digest"], second["affected_paths"]) == (both, 0)  # not moved twice
    write(running.file, {})
    assert running.record()["digest"] == original
    assert running.end() == (0, "", "")
    assert hashlib.sha256(session_file.read_bytes()).digest() == before
    assert {path.name for path in tmp_path.iterdir()} == {"edits.json", "now.npz"}


def test_broken_files_are_one_line_each_and_the_watch_goes_on(
    tmp_path: Path, start: Callable[..., Running]
) -> None:
    result = tmp_path / "now.csv"
    running = start("-o", str(result))
    assert "No such file" in running.record()["problem"]
    write(running.file, {})
    digest = running.record()["digest"]
    texts = {
        '{"move": ': "found no JSON at line 1, column 10",
        '{"move": {"sofa": [1, 0, 0]}}': 'mesh "sofa": not in the scene',
        '{"dim": {"lamp": 0.5}, "move": {"MOVE_panel": [2e15, 0, 0]}}': "would lie beyond 1e15 m",
        '{"dim": {"lamp": -1}}': "dim: found 'lamp=-1', expected a factor of 0 or more",
    }
    result.unlink()
    for text, expected in texts.items():
        write(running.file, text)
        assert expected in running.record()["problem"]
    assert not result.exists()
    write(running.file, {"dim": {"lamp": 1}})
    assert running.record()["digest"] == digest  # of what was refused nothing was done
    code, out, err = running.end()
    assert (code, out) == (0, "")
    lines = err.splitlines()
    assert len(lines) == 1 + len(texts)
    assert all(line.startswith("error: ") and line.endswith("; watching on") for line in lines)


def test_results_that_cannot_be_written_are_tried_again(
    tmp_path: Path, start: Callable[..., Running]
) -> None:
    folder = tmp_path / "results"
    folder.mkdir()
    running = start("-o", str(folder / "now.csv"))
    write(running.file, {})
    assert running.record()["outputs"]
    folder.rename(tmp_path / "away")
    write(running.file, MOVE)
    assert "results" in running.record()["problem"]
    (tmp_path / "away").rename(folder)
    write(running.file, MOVE)  # the same bytes
    assert running.record()["outputs"] == [str(folder / "now.csv")]


def test_equal_edits_write_nothing(tmp_path: Path, start: Callable[..., Running]) -> None:
    result = tmp_path / "now.csv"
    running = start("-o", str(result))
    write(running.file, MOVE)
    running.record()
    result.unlink()
    write(running.file, json.dumps(MOVE, indent=4))
    assert running.record()["outputs"] == []
    write(running.file, json.dumps(MOVE, indent=4))  # not even a line
    time.sleep(1.0)
    assert not result.exists()
    assert running.end() == (0, "", "")


def test_of_refused_edits_nothing_is_left(tmp_path: Path, start: Callable[..., Running]) -> None:
    """Nor does what they began to say count as done: said again, it is."""
    result = tmp_path / "now.csv"
    running = start("-o", str(result))
    write(running.file, {})
    before = running.record()["digest"]
    write(running.file, MOVE | {"dim": {"nobody": 0.5}})
    assert "nobody" in running.record()["problem"]
    write(running.file, MOVE)
    done = running.record()
    assert done["outputs"] == [str(result)]
    assert done["digest"] != before
    running.end()


def test_waiting_takes_no_time_of_a_processor(start: Callable[..., Running]) -> None:
    running = start()
    write(running.file, {})
    running.record()
    time.sleep(watch.COARSEST)

    def used() -> float:
        fields = Path(f"/proc/{running.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    begin = used()
    time.sleep(2.0)
    assert used() - begin <= 0.1


def test_interrupted_at_work_it_ends_with_130(cli: Cli, session_file: Path, tmp_path: Path,
                                              monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    (tmp_path / "edits.json").write_text("{}")

    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(watch, "write_refined", interrupted)
    outcome = cli("update", session_file, "--watch", tmp_path / "edits.json")
    assert (outcome.code, outcome.error) == (130, "error: cancelled")


def test_the_terminal_gets_one_line_for_each_change(
    cli: Cli, session_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    contents = iter([b"{}", json.dumps(MOVE).encode()])

    def following(self: WatchedFile) -> bytes:
        for content in contents:
            return content
        raise KeyboardInterrupt

    monkeypatch.setattr(WatchedFile, "next", following)
    result = tmp_path / "now.csv"
    outcome = cli("update", session_file, "--watch", tmp_path / "edits.json", "-o", result)
    assert (outcome.code, outcome.err) == (0, "")
    said, first, second = outcome.out.splitlines()
    assert said.endswith("edits.json; Ctrl-C ends it")
    assert "edits.json: 0 paths traced again in " in first
    assert second.endswith(f"ms; wrote {result}")


def test_neither_session_nor_edits_are_written_over(cli: Cli, session_file: Path, tmp_path: Path) -> None:
    file = tmp_path / "edits.csv"
    file.write_text("{}")
    outcome = cli("update", session_file, "--watch", file, "-o", file)
    assert outcome.code == 2
    assert "which this command reads" in outcome.error


# ---- the file ----------------------------------------------------------------------------------------


class Sleeper:
    """Instead of sleeping: does what was planned for the first, second … wait."""

    def __init__(self, *plan: Callable[[], object]) -> None:
        self._plan = list(plan)
        self.waited = 0.0

    def __call__(self, seconds: float) -> None:
        self.waited += seconds
        assert self.waited < 1000, "it waits for ever"
        if self._plan:
            self._plan.pop(0)()


def test_a_file_is_read_once_it_has_come_to_rest(tmp_path: Path) -> None:
    path = tmp_path / "edits.json"
    path.write_text('{"dim"')
    half = Sleeper(lambda: path.write_text('{"dim": {'), lambda: path.write_text('{"dim": {}}'))
    assert WatchedFile(path, half).next() == b'{"dim": {}}'


def test_a_file_that_is_replaced_is_not_missed(tmp_path: Path) -> None:
    path, old = tmp_path / "edits.json", tmp_path / "edits.json~"
    path.write_text("1")
    plan: list[Callable[[], object]] = [
        lambda: None,
        lambda: path.rename(old),  # gone for a moment
        lambda: path.write_text("2"),
    ]
    file = WatchedFile(path, Sleeper(*plan))
    assert file.next() == b"1"
    assert file.next() == b"2"


def test_a_change_within_one_tick_of_the_clock_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "edits.json"
    path.write_text("1")
    look = path.stat()

    def again() -> None:
        path.write_text("2")
        os.utime(path, ns=(look.st_atime_ns, look.st_mtime_ns))

    class Blind(WatchedFile):
        def _look(self) -> tuple[int, ...] | None:
            found = super()._look()
            return found and found[:-1]  # without the time of the change of the time

    file = Blind(path, Sleeper(lambda: None, again))
    assert file.next() == b"1"
    assert file.next() == b"2"


def test_the_same_content_is_given_once(tmp_path: Path) -> None:
    path = tmp_path / "edits.json"
    path.write_text("1")
    file = WatchedFile(path, Sleeper(lambda: None, lambda: path.touch(), lambda: write(path, "1")))
    assert file.next() == b"1"
    with pytest.raises(AssertionError, match="for ever"):
        file.next()


def test_absent_files_and_pipes_are_told_once(tmp_path: Path) -> None:
    path = tmp_path / "edits.json"
    sleeper = Sleeper()
    file = WatchedFile(path, sleeper)
    with pytest.raises(FileNotFoundError):
        file.next()
    assert sleeper.waited >= watch.ABSENT
    os.mkfifo(path)
    opened = threading.Timer(5, lambda: path.write_bytes(b""))  # else a reader could wait for ever
    opened.start()
    with pytest.raises(FormatError, match="pipe"):
        file.next()
    opened.cancel()
    path.unlink()
    path.write_text("1")
    assert file.next() == b"1"


def test_a_folder_and_a_huge_file_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "LARGEST", 3)
    (tmp_path / "large").write_text("12345")
    with pytest.raises(FormatError, match="found more than"):
        WatchedFile(tmp_path / "large", Sleeper()).next()
    with pytest.raises((OSError, FormatError)):
        WatchedFile(tmp_path, Sleeper()).next()


# ---- its content -------------------------------------------------------------------------------------


def test_a_file_says_what_options_say() -> None:
    content = json.dumps(
        {
            "move": {"a=b": [1, 2.5, -3, 90]},
            "remove": ["c"],
            "add": ["d"],
            "dim": {"e": 0},
            "reflectance": {"f": [0.1, 0.2, 0.3], "g": 0.5},
        }
    )
    assert edits_of_json(b"\xef\xbb\xbf" + content.encode()) == Edits(
        add=["d"],
        move=[Move("a=b", (1, 2.5, -3), 90)],
        remove=["c"],
        dim=[Setting("e", (0,))],
        reflectance=[Setting("f", (0.1, 0.2, 0.3)), Setting("g", (0.5, 0.5, 0.5))],
    )


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", "found no JSON at line 1, column 1"),
        (b"[]", "found \\[\\], expected an object of edits by kind: add, move"),
        (b"{}{", "Extra data"),
        (b"\xff\xfe", "no UTF-8"),
        (b"[" * 100_000, "found no JSON"),
        (b'{"moves": {}}', 'found "moves", expected edits by kind'),
        (b'{"dim": {}, "dim": {}}', 'found "dim" twice'),
        (b'{"dim": {"a": 1, "a": 2}}', 'found "a" twice'),
        (b'{"remove": "lamp"}', 'remove: found "lamp", expected a list of names'),
        (b'{"remove": [1]}', "expected a list of names"),
        (b'{"move": ["chair"]}', "move: found .* expected an object"),
        (b'{"move": {"chair": [1, 0]}}', "move: found 'chair=1,0', expected NAME=dx,dy,dz"),
        (b'{"move": {"chair": [1, 0, "0"]}}', "expected numbers"),
        (b'{"move": {"chair": []}}', "expected numbers"),
        (b'{"move": {"": [1, 0, 0]}}', "expected NAME="),
        (b'{"dim": {"lamp": true}}', 'dim: "lamp": found true, expected numbers'),
        (b'{"dim": {"lamp": NaN}}', "GROUP=factor"),
        (b'{"dim": {"lamp": 1e999}}', "GROUP=factor"),
        (b'{"reflectance": {"oak": [0.5, 0.5, 1.5]}}', "values from 0 to 1"),
    ],
)
def test_what_a_file_must_not_say(content: bytes, text: str) -> None:
    with pytest.raises(OptionError, match=text):
        edits_of_json(content)
