# SPDX-License-Identifier: Apache-2.0
"""`make bench`: the engine on the bundled atrium, every figure a ratio within one process.

Writes benchmarks/out/bench.json and prints a table of what was reached beside what is required.
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
    base, two = runs["3%"], runs["3%, 2 threads"]
    rows: list[tuple[str, str, str]] = [
        ("raw rays / tracing", f"{base['raw_over_trace']:.2f}", ">= 0.60"),
        ("deposit into 1e5 discs / raw ray", f"{base['deposit_over_raw']:.2f}", "<= 0.9"),
        ("search for affected segments, ns per stored segment", f"{base['search_ns']:.2f}", "<= 1.0"),
        ("  of which the scan", f"{base['scan_ns']:.2f}", ""),
        ("moving samples, share of a frame", f"{base['moving_share']:.1%}", "<= 10 %"),
        ("frame efficiency", f"{base['frame_efficiency']:.2f}", ">= 0.18"),
        ("bytes per segment", f"{base['bytes_per_segment']:.1f}", "<= 64"),
    ]
    required = {"1%": ">= 300x", "3%": ">= 80x", "10%": "", "3%, 10x triangles": "", "3%, 2 threads": ""}
    for name, run in runs.items():
        if name not in ("deposit", "gather"):
            rows.append((f"recompute / frame, object {name}", f"{run['speedup']:.0f}x", required[name]))
    rows.append(
        (
            "recompute, 1 thread / 2 threads, wall clock",
            f"{base['recompute_wall_ms'] / two['recompute_wall_ms']:.2f}",
            "",
        )
    )
    rays = runs["gather"]
    rows += [
        ("gather: a ray and its chain, in raw rays", f"{rays['ray_over_raw']:.1f}", ""),
        ("  a look-up, ns", f"{rays['look_up_ns']:.1f}", ""),
        (f"  bytes per sample of {rays['rays']} rays", f"{rays['bytes_per_sample']:.0f}", ""),
        ("  share of a frame", f"{rays['frame_share']:.0%}", ""),
        ("  recompute / frame", f"{rays['speedup']:.0f}x", ""),
    ]
    exact = all(run.get("exact", True) for run in runs.values())
    rows.append(("frames equal recompute to the bit", "yes" if exact else "NO", "yes"))
    for entry, most in zip(runs["deposit"]["results"], ("<= 0.9", "<= 1.5"), strict=False):
        discs = f"{entry['discs']:.0e}".replace("e+0", "e")
        rows.append((f"deposit, {discs} discs, in raw rays", f"{entry['deposit_in_rays']:.2f}", most))
        rows.append(
            ("  faster than Embree's oriented discs", f"{entry['faster_than_embree_discs']:.2f}x", ">= 2x")
        )
    width = max(len(row[0]) for row in rows)
    return "\n".join(f"{name:<{width}}  {value:>10}  {need}" for name, value, need in rows)


if __name__ == "__main__":
    main()
