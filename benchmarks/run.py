# SPDX-License-Identifier: Apache-2.0
"""`make bench`: the engine on the bundled atrium, every figure a ratio within one process.

Writes benchmarks/out/bench.json and prints a table of what was reached beside what is required; results.py
puts it into RESULTS.md.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import deltalux as dl
from deltalux.studies.scene_samples import uniform_on_surfaces
from dump import write_dump
from results import engine as engine_rows
from uniform_samples import radius_for_hits

ROOT = Path(__file__).resolve().parent.parent
PROGRAMS = ROOT / "build" / "bench"
OUT = ROOT / "benchmarks" / "out"
SAMPLES = 100_000
HITS = 0.75  # crossings per segment, as in the cost study that set the requirements
RADIUS = 0.1  # metres; of no use to what gathers


def run_program(program: str, scene: dl.Scene, samples: dl.Samples, *numbers: float) -> dict[str, Any]:
    """One run of a program that takes a scene and some numbers."""
    with tempfile.TemporaryDirectory() as folder:
        dump = Path(folder) / "scene.dump"
        write_dump(dump, scene, samples)
        command = [str(PROGRAMS / program), str(dump), *map(str, numbers)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{program} failed ({done.returncode}): {done.stderr or done.stdout}")
    return json.loads(done.stdout)


def engine(scene: dl.Scene, paths: int, threads: int, step: float) -> dict[str, Any]:
    """One run of engine_bench."""
    samples = uniform_on_surfaces(scene, SAMPLES, seed=1, radius=radius_for_hits(scene, SAMPLES, HITS))
    return run_program("engine_bench", scene, samples, paths, threads, step)


def gather(scene: dl.Scene, samples: int, rays: int) -> dict[str, Any]:
    """One run of gather_bench."""
    return run_program(
        "gather_bench", scene, uniform_on_surfaces(scene, samples, seed=1, radius=RADIUS), 200_000, rays, 1.0
    )


def deposit() -> dict[str, Any]:
    """One run of deposit_bench."""
    done = subprocess.run([str(PROGRAMS / "deposit_bench")], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer paths, no ten-fold scene")
    quick = parser.parse_args().quick
    paths = 200_000 if quick else 1_000_000
    runs: dict[str, Any] = {}
    for size in (0.01, 0.03, 0.10):
        print(f"atrium, trolley {size:.0%} of the scene, {paths:,} paths …", file=sys.stderr, flush=True)
        runs[f"{size:.0%}"] = engine(dl.scenes.atrium(trolley_size=size), paths, 1, step=1.0)
    print("the same with two threads …", file=sys.stderr, flush=True)
    runs["3%, 2 threads"] = engine(dl.scenes.atrium(trolley_size=0.03), paths, 2, step=1.0)
    if not quick:
        print("ten times the static triangles …", file=sys.stderr, flush=True)
        runs["3%, 10x triangles"] = engine(dl.scenes.atrium(detail=10, trolley_size=0.03), paths, 1, step=1.0)
    print("gather …", file=sys.stderr, flush=True)
    runs["gather"] = gather(dl.scenes.atrium(trolley_size=0.03), 5_000 if quick else 20_000, 128)
    print("deposit alone …", file=sys.stderr, flush=True)
    runs["deposit"] = deposit()
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "bench.json").write_text(json.dumps(runs, indent=1))
    print(table(runs))
    print(f"wrote {OUT / 'bench.json'}")


def table(runs: dict[str, Any]) -> str:
    """What was reached beside what is required."""
    rows = list(engine_rows(runs))
    width, wide = (max(len(row[k]) for row in rows) for k in (0, 1))
    return "\n".join(f"{name:<{width}}  {value:>{wide}}  {need}".rstrip() for name, value, need in rows)


if __name__ == "__main__":
    main()
