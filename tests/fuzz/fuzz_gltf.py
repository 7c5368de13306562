# SPDX-License-Identifier: Apache-2.0
"""Fuzz target of the glTF reader: crashes, hangs, allocation storms, uncaught exceptions, unsound scenes.

    python tests/fuzz/fuzz_gltf.py --minutes 20 --seed 1

Each case is a function of (seed, case number); `--case N` runs one alone and prints its traceback. Cases run
in child processes with a limit on address space; a child that dies or is late is replaced and counted as a
failure. With DELTALUX_SCENES set, small files of that folder are mutated too.
"""

from __future__ import annotations

import argparse
import collections
import json
import multiprocessing
import multiprocessing.connection
import os
import resource
import sys
import tempfile
import time
import traceback
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # each thread reserves address space
if __name__ in ("__main__", "__mp_main__"):
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import deltalux as dl
import numpy as np

from fuzz.mutate_gltf import Seed, mutated, seeds

SECONDS_LIMIT = 30.0  # wall time of one case; a typical one takes milliseconds
GROWTH_LIMIT = 256 << 20  # bytes of resident memory that one case may add; the files have kilobytes
ADDRESS_SPACE = 1 << 30  # beyond what the child has after its imports


@dataclass
class Report:
    """What a run found."""

    cases: int = 0
    accepted: int = 0
    refused: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    largest_growth: int = 0
    messages: collections.Counter[str] = field(default_factory=collections.Counter)
    failures: list[dict[str, Any]] = field(default_factory=list)

    def add(self, result: dict[str, Any]) -> None:
        """Count one case."""
        self.cases += 1
        self.slowest = max(self.slowest, result.get("seconds", 0.0))
        self.largest_growth = max(self.largest_growth, result.get("growth", 0))
        if result["outcome"] == "accepted":
            self.accepted += 1
        elif result["outcome"] == "refused":
            self.refused += 1
            self.messages[result["message"]] += 1
        else:
            self.failures.append(result)

    def summary(self) -> str:
        """One paragraph."""
        return (
            f"{self.cases} cases in {self.seconds:.0f} s: {self.accepted} accepted, {self.refused} refused "
            f"with {len(self.messages)} kinds of message, {len(self.failures)} failures; slowest "
            f"{self.slowest:.2f} s, largest growth {self.largest_growth / 2**20:.0f} MiB"
        )


def make_case(
    seed: int, case: int, valid: list[tuple[dict[str, Any], bytes]]
) -> tuple[bytes, dict[str, Any]]:
    """The file and the options of one case."""
    rng = np.random.default_rng([seed, case])
    options = {
        "movable": ["MOVE_cart"] if rng.random() < 0.2 else [],
        "light_units": ["spec", "blender-watts", "unitless"][rng.integers(3)],
    }
    return mutated(rng, valid), options


def check_scene(scene: dl.Scene) -> None:
    """Raise AssertionError where an accepted scene is not sound."""
    json.dumps(scene.info(), allow_nan=False)
    for mesh in scene.meshes:
        assert np.isfinite(mesh.world_vertices).all()
        assert len(mesh.triangles) == 0 or mesh.triangles.max() < len(mesh.vertices)
    for node in scene.nodes:
        assert np.isfinite(node.matrix).all()
        assert node.parent < len(scene.nodes)
    for material in scene.materials:
        assert np.isfinite(material.emission).all()
    for text in (*scene.warnings, *(m.name for m in scene.meshes)):
        text.encode("utf-8")


def run_case(folder: Path, seed: int, case: int, valid: list[Seed]) -> dict[str, Any]:
    """Load one case; the outcome is "accepted", "refused", or a failure's name."""
    data, options = make_case(seed, case, valid)
    path = folder / "scene.glb"
    path.write_bytes(data)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    result: dict[str, Any] = {"case": case}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # numpy's, say: a stray message on stderr is a failure too
            check_scene(dl.load(path, **options))
        result["outcome"] = "accepted"
    except dl.Error as error:
        # Digits out, so that messages of one kind count as one.
        kind = "".join("#" if c.isdigit() else c for c in str(error))[:60]
        result |= {"outcome": "refused", "message": f"{type(error).__name__} {kind}"}
        str(error).encode("utf-8")
    except MemoryError:
        result |= {"outcome": "allocation storm", "traceback": traceback.format_exc()}
    except BaseException:
        result |= {"outcome": "uncaught exception", "traceback": traceback.format_exc()}
    result["seconds"] = time.process_time() - start
    result["growth"] = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
    if result["growth"] > GROWTH_LIMIT and result["outcome"] in ("accepted", "refused"):
        result["outcome"] = "allocation storm"
    return result


def _child(pipe: multiprocessing.connection.Connection, seed: int) -> None:
    valid = seeds()
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + ADDRESS_SPACE
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    with tempfile.TemporaryDirectory() as folder:
        while (case := pipe.recv()) is not None:
            pipe.send(run_case(Path(folder), seed, case, valid))


class _Worker:
    """A child process and the case it works on."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, other = context.Pipe()
        self.process = context.Process(target=_child, args=(other, self._seed), daemon=True)
        self.process.start()
        other.close()
        self.case = -1
        self.since = time.monotonic()

    def give(self, case: int) -> None:
        self.case, self.since = case, time.monotonic()
        self.pipe.send(case)

    def is_late(self) -> bool:
        return time.monotonic() - self.since > SECONDS_LIMIT

    def take(self) -> dict[str, Any]:
        """The result; a child that died is a crash, and is replaced."""
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            return self.replace("crash")

    def replace(self, outcome: str) -> dict[str, Any]:
        self.process.kill()
        self.process.join()
        result = {"case": self.case, "outcome": outcome, "exit code": self.process.exitcode}
        self._start()
        return result

    def stop(self) -> None:
        self.process.kill()
        self.process.join()


def fuzz(seed: int, *, cases: int | None = None, seconds: float | None = None, processes: int = 1) -> Report:
    """Run cases 0, 1, 2, … until there are enough or the time is over."""
    report, begin, following = Report(), time.monotonic(), 0
    workers = [_Worker(seed) for _ in range(processes)]
    busy: dict[Any, _Worker] = {}

    def more() -> bool:
        in_time = seconds is None or time.monotonic() - begin < seconds
        return in_time and (cases is None or following < cases)

    try:
        for worker in workers:
            if more():
                worker.give(following)
                busy[worker.pipe] = worker
                following += 1
        while busy:
            ready = multiprocessing.connection.wait(list(busy), timeout=1.0)
            late = [
                w for w in busy.values() if time.monotonic() - w.since > SECONDS_LIMIT and w.pipe not in ready
            ]
            for worker in [busy[pipe] for pipe in ready] + late:
                del busy[worker.pipe]
                report.add(worker.replace("hang") if worker in late else worker.take())
                if more():
                    worker.give(following)
                    busy[worker.pipe] = worker
                    following += 1
    finally:
        for worker in workers:
            worker.stop()
    report.seconds = time.monotonic() - begin
    return report


def main() -> int:
    """Command line; the exit code is 1 when a case failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--case", type=int, help="run this case alone, in this process")
    parser.add_argument("--keep", type=Path, help="write the files of failed cases into this folder")
    arguments = parser.parse_args()
    if arguments.case is not None:
        with tempfile.TemporaryDirectory() as folder:
            result = run_case(Path(folder), arguments.seed, arguments.case, seeds())
        sys.stdout.write("\n".join(f"{key}: {value}" for key, value in result.items()) + "\n")
        return int(result["outcome"] not in ("accepted", "refused"))
    report = fuzz(arguments.seed, seconds=arguments.minutes * 60, processes=arguments.processes)
    for failure in report.failures:
        sys.stdout.write("\n".join(f"{key}: {value}" for key, value in failure.items()) + "\n\n")
        if arguments.keep:
            arguments.keep.mkdir(parents=True, exist_ok=True)
            data, _ = make_case(arguments.seed, failure["case"], seeds())
            (arguments.keep / f"{arguments.seed}-{failure['case']}.glb").write_bytes(data)
    sys.stdout.write(report.summary() + "\n")
    return int(bool(report.failures))


if __name__ == "__main__":
    sys.exit(main())
