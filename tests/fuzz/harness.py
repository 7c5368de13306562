# SPDX-License-Identifier: Apache-2.0
"""Runs a target's cases in forked children with limits, and keeps what went wrong.

A case is a function of (seed, number): `make` writes a folder, `run` reads nothing else. The process that
forks must not have started a thread, since threads do not survive a fork; the engine would wait for them.
"""

from __future__ import annotations

import collections
import contextlib
import json
import os
import resource
import select
import shutil
import signal
import sys
import time
import traceback
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import deltalux as dl
import numpy as np

GOOD = ("accepted", "refused")
BATCH = 25  # cases of one child
MIB = 2**20


@dataclass(frozen=True)
class Limits:
    """What one case may take."""

    cpu_seconds: int = 30  # a typical case takes milliseconds
    wall_seconds: float = 120.0  # for what sleeps; other programs may be at work
    growth: int = 256 * MIB  # of resident memory; the inputs have kilobytes
    address_space: int = 1024 * MIB  # beyond what the child has after its fork


class Target(Protocol):
    """What is fuzzed."""

    name: str
    limits: Limits

    def prepare(self, seeds: Path, scenes: Path | None) -> None:
        """Write valid inputs into `seeds`, small files of `scenes` among them; in a child of its own."""

    def load(self, seeds: Path) -> None:
        """Read them; starts no thread."""

    def make(self, rng: np.random.Generator, folder: Path) -> None:
        """Write one case into an empty folder."""

    def run(self, folder: Path) -> None:
        """Play a case; deltalux.Error = refused, any other exception = a failure."""


@dataclass
class Report:
    """What a run found."""

    target: str
    seed: int
    cases: int = 0
    outcomes: collections.Counter[str] = field(default_factory=collections.Counter)
    seconds: float = 0.0
    slowest: float = 0.0
    growth: int = 0
    messages: collections.Counter[str] = field(default_factory=collections.Counter)
    failures: list[dict[str, Any]] = field(default_factory=list)

    def add(self, result: dict[str, Any]) -> None:
        """Count one case."""
        self.cases += 1
        self.outcomes[result["outcome"]] += 1
        self.slowest = max(self.slowest, result.get("seconds", 0.0))
        self.growth = max(self.growth, result.get("growth", 0))
        if result["outcome"] == "refused":
            self.messages[result["message"]] += 1
        elif result["outcome"] not in GOOD:
            self.failures.append(result)

    def summary(self) -> str:
        """One line."""
        n = self.outcomes
        return (
            f"{self.target:<8} {self.cases} cases in {self.seconds:.0f} s: {n['accepted']} accepted, "
            f"{n['refused']} refused ({len(self.messages)} kinds of message), {n['crash']} crashes, "
            f"{n['hang']} hangs, {n['traceback']} tracebacks, {n['memory']} over memory; "
            f"slowest {self.slowest:.2f} s, largest growth {self.growth / MIB:.0f} MiB"
        )

    def record(self) -> dict[str, Any]:
        """All of it, for JSON."""
        return {
            "target": self.target,
            "seed": self.seed,
            "cases": self.cases,
            "outcomes": dict(self.outcomes),
            "kinds_of_message": len(self.messages),
            "seconds": self.seconds,
            "slowest": self.slowest,
            "growth": self.growth,
            "failures": self.failures,
        }


def generator(target: Target, seed: int, case: int) -> np.random.Generator:
    """The random numbers of a case."""
    return np.random.default_rng([seed, case, *target.name.encode()])


def play(target: Target, folder: Path) -> dict[str, Any]:
    """Run the case in a folder, in this process."""
    before, start = _peak(), time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # numpy's, say: a stray message on stderr is a failure too
            target.run(folder)
        result: dict[str, Any] = {"outcome": "accepted"}
    except dl.Error as error:
        # Digits out, so that messages of one kind count as one.
        text = str(error).replace(str(folder), "")
        kind = "".join("#" if c.isdigit() else c for c in text)[:60]
        result = {"outcome": "refused", "message": f"{type(error).__name__} {kind}"}
        if any("\ud800" <= c <= "\udfff" for c in text):
            result = {"outcome": "traceback", "detail": f"a message that cannot be printed: {text!r}"}
    except MemoryError:
        result = {"outcome": "memory", "detail": traceback.format_exc()}
    except BaseException:
        result = {"outcome": "traceback", "detail": traceback.format_exc()}
    result |= {"seconds": time.process_time() - start, "growth": _peak() - before}
    if result["growth"] > target.limits.growth and result["outcome"] in GOOD:
        result["outcome"] = "memory"
    return result


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def in_child(work: Any) -> int:
    """Call `work` in a forked child, wait, return its exit status as of `os.wait`."""
    pid = os.fork()
    if pid == 0:
        _end_with(work)
    return os.waitpid(pid, 0)[1]


def _end_with(work: Any) -> None:
    """Call `work` and end this process, without what an interpreter does at its end."""
    code = 70
    try:
        work()
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


class _Batch:
    """A child that works through some cases and tells the result of each."""

    def __init__(self, target: Target, seed: int, cases: range, work: Path) -> None:
        self._target, self._seed, self._work, self._cases = target, seed, work, cases
        self._reader, writer = os.pipe()
        self._pid = os.fork()
        if self._pid == 0:
            os.close(self._reader)
            _end_with(lambda: self._work_through(writer))
        os.close(writer)
        self._held = b""

    def _work_through(self, writer: int) -> None:
        log = os.open(self._work / "stderr.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(log, 2)
        os.dup2(log, 1)
        limits = self._target.limits
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        space = pages * resource.getpagesize() + limits.address_space
        resource.setrlimit(resource.RLIMIT_AS, (space, space))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        for case in self._cases:
            used = int(time.process_time())
            resource.setrlimit(resource.RLIMIT_CPU, (used + limits.cpu_seconds, resource.RLIM_INFINITY))
            folder = self._work / str(case)
            folder.mkdir()
            self._target.make(generator(self._target, self._seed, case), folder)
            result = play(self._target, folder)
            os.write(writer, json.dumps(result).encode() + b"\n")
            if result["outcome"] in GOOD:
                shutil.rmtree(folder, ignore_errors=True)

    def results(self) -> Any:
        """(case, result) of each case up to the end of the child, which may come early."""
        for case in self._cases:
            line = self._line()
            if line is None:
                yield case, self._ended(killed=True)
                return
            if not line:
                yield case, self._ended(killed=False)
                return
            yield case, json.loads(line)
        self._ended(killed=False)

    def _line(self) -> bytes | None:
        """The next result; empty at the child's end, None where it is late."""
        end = time.monotonic() + self._target.limits.wall_seconds
        while b"\n" not in self._held:
            if not select.select([self._reader], [], [], max(0.0, end - time.monotonic()))[0]:
                return None
            piece = os.read(self._reader, 1 << 16)
            if not piece:
                return b""
            self._held += piece
        line, self._held = self._held.split(b"\n", 1)
        return line

    def _ended(self, killed: bool) -> dict[str, Any]:
        """Bury the child; the result of the case that it was at."""
        if killed:
            os.kill(self._pid, signal.SIGKILL)
        code = os.waitstatus_to_exitcode(os.waitpid(self._pid, 0)[1])
        os.close(self._reader)
        late = killed or code == -signal.SIGXCPU
        log = (self._work / "stderr.txt").read_text(errors="replace")[-2000:]
        return {"outcome": "hang" if late else "crash", "exit_code": code, "detail": log}


def fuzz(
    target: Target,
    seed: int,
    work: Path,
    *,
    cases: int | None = None,
    seconds: float | None = None,
    scenes: Path | None = None,
    keep: Path | None = None,
) -> Report:
    """Run cases 0, 1, 2, … until there are enough or the time is over.

    Parameters
    ----------
    work : an empty folder for what is at work
    scenes : a folder with more seeds
    keep : where failed cases are left, each in a folder that `farm.py --replay` takes
    """
    report, begin, following = Report(target.name, seed), time.monotonic(), 0
    seeds = work / "seeds"
    seeds.mkdir(parents=True)
    os.environ["XDG_CACHE_HOME"] = str(work / "cache")  # what the user's planner reckons with is not ours
    if in_child(lambda: target.prepare(seeds, scenes)) != 0:
        raise RuntimeError(f"{target.name}: no seeds could be made")
    target.load(seeds)

    def more() -> bool:
        in_time = seconds is None or time.monotonic() - begin < seconds
        return in_time and (cases is None or following < cases)

    while more():
        end = following + (BATCH if cases is None else min(BATCH, cases - following))
        batch = _Batch(target, seed, range(following, end), work)
        for case, result in batch.results():
            following = case + 1
            report.add(result | {"case": case})
            if result["outcome"] not in GOOD and keep is not None:
                _keep(target, seed, case, result, work, keep)
            shutil.rmtree(work / str(case), ignore_errors=True)
    report.seconds = time.monotonic() - begin
    return report


def _keep(target: Target, seed: int, case: int, result: dict[str, Any], work: Path, keep: Path) -> None:
    """Leave a failed case with its verdict and the command that plays it again."""
    kept = keep / f"{target.name}-{seed}-{case}"
    shutil.rmtree(kept, ignore_errors=True)
    with contextlib.suppress(FileNotFoundError):
        shutil.copytree(work / str(case), kept, symlinks=True)
    kept.mkdir(parents=True, exist_ok=True)
    replay = f"PYTHONPATH=python python tests/fuzz/farm.py --replay {kept}"
    (kept / "verdict.json").write_text(json.dumps(result | {"replay": replay}, indent=1))
