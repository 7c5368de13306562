# SPDX-License-Identifier: Apache-2.0
"""How near the forecasts of memory and time come: forecast over true, over sizes of scenes and sessions.

    PYTHONPATH=python python benchmarks/forecast.py
    PYTHONPATH=python python benchmarks/forecast.py office atrium room.glb

Without names: halls with 10^4 to 10^6 triangles, 10^4 to 10^6 samples and 10^5 to 10^7 paths, each with and
without a gather, a Latin square of each. Every case is a child process. Memory: `forecast_bytes` of the
session over the growth of its peak resident memory from before the bake to its end, and what saving adds.
Time: `dl.plan` (with --time) over processor seconds of what it predicts. Writes
benchmarks/out/forecast.json.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux.memory import return_free_memory
from deltalux.planning import machine_constants
from deltalux.scenes.shapes import panel_lamp, room, sphere
from peers.pictured_rooms import ROOMS, named_scene

OUT = Path(__file__).resolve().parent / "out" / "forecast.json"
SIZES = (10**4, 10**5, 10**6)
BALLS = 36
RAYS = {10**4: 512, 10**5: 128, 10**6: 32}  # by samples: what a gather of many can afford
MIB = 2**20


def hall(triangles: int) -> dl.Scene:
    """12 x 4 x 12 m with balls of so many triangles, four panel lamps of two groups, one ball movable."""
    segments = max(8, round((triangles / BALLS) ** 0.5))
    ball = sphere(0.45, segments, "paint")
    meshes = [room(12, 4, 12, ["wall"] * 6).mesh("hall")]
    for i in range(BALLS):
        x, z = divmod(i, 6)
        meshes.append(ball.mesh(f"ball {i}", at=(2 * x - 5, 0.6 + 0.4 * (i % 4), 2 * z - 5), movable=i == 14))
    for i in range(4):
        lamp = panel_lamp(1.2, 0.08, 0.6, 0.03, "wall", f"glow {i % 2}")
        meshes.append(lamp.mesh(f"lamp {i}", at=(6 * (i % 2) - 3, 3.8, 6 * (i // 2) - 3)))
    glow = [
        dl.Material(f"glow {i}", (0, 0, 0), emission=(1000, 950, 900), group=f"row {i}") for i in range(2)
    ]
    return dl.Scene(
        meshes, [dl.Material("wall", (0.7, 0.68, 0.65)), dl.Material("paint", (0.5, 0.4, 0.3)), *glow]
    )


def spread_samples(scene: dl.Scene, count: int) -> dl.Samples:
    """So many samples, evenly by area, on all that is static."""
    meshes = [mesh for mesh in scene.meshes if not mesh.movable]
    corners = np.concatenate([m.world_vertices[m.triangles] for m in meshes])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    rng = np.random.default_rng(5)
    chosen = rng.choice(len(area), count, p=area / area.sum())
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = (corners[chosen, k] for k in range(3))
    return dl.Samples(a + u * (b - a) + v * (c - a), normals[chosen] / area[chosen, None])


def memory_now() -> dict[str, int]:
    """Resident bytes of this process: now, and at most since they were last asked to begin anew."""
    lines = Path("/proc/self/status").read_text().splitlines()
    words = (line.split() for line in lines if line.startswith(("VmRSS", "VmHWM")))
    return {word[0].rstrip(":"): int(word[1]) * 1024 for word in words}


def begin_peak() -> int:
    """Resident bytes now; the peak is measured from here."""
    return_free_memory()
    Path("/proc/self/clear_refs").write_text("5")
    return memory_now()["VmRSS"]


def measure(case: dict[str, Any]) -> dict[str, Any]:
    """Forecast and truth of one case, in this process."""
    name = case["scene"]
    scene = named_scene(name) if name else hall(case["triangles"])
    samples = spread_samples(scene, case["samples"]) if case["samples"] else dl.Samples.on_vertices(scene)
    options = {"paths": case["paths"], "gather": case["gather"], "threads": case["threads"]}
    row = dict(case) | {"triangles": sum(len(m.triangles) for m in scene.meshes), "samples": len(samples)}
    if case["time"]:
        row |= planned(dl.plan(scene, samples, **options))
    before = begin_peak()
    with dl.Session(scene, samples, **options) as session:
        made = memory_now()["VmRSS"]
        start = time.process_time()
        frame = session.bake()
        seconds = time.process_time() - start
        used = memory_now()
        about = session.statistics
        row |= {
            "paths": about["paths"], "rays": about.get("gather", {}).get("rays", 0),
            "segments": about["segments"], "forecast": about["forecast_bytes"], "counted": about["bytes"],
            "made": made - before, "grown": used["VmRSS"] - before, "peak": used["VmHWM"] - before,
            "seconds": seconds, "stages": frame.milliseconds,
        }  # fmt: skip
        before_save = begin_peak()
        with tempfile.TemporaryDirectory() as folder:
            session.save(Path(folder) / "session.dlx")
        row["saving"] = memory_now()["VmHWM"] - before_save
    whole = sum(row["stages"].values())
    true = sum(row["stages"].get(stage, 0.0) for stage in TIMED) / whole * row["seconds"]
    return row | {"true_seconds": true}


TIMED = ("prepare", "plan", "deposit", "guides", "gather")


def planned(plan: dl.Plan) -> dict[str, float]:
    """Seconds of a bake that a plan tells."""
    parts = sum(
        method.build_seconds + method.bake_seconds
        for part in plan.parts.values()
        for method in part.methods
        if method.method == part.chosen
    )
    return {"planned_seconds": parts + (plan.gather.bake_seconds if plan.gather else 0.0)}


def cases(options: argparse.Namespace) -> list[dict[str, Any]]:
    common = {"threads": options.threads, "time": options.time}
    if options.scenes:
        return [
            {"scene": name, "triangles": 0, "samples": 0, "paths": paths, "gather": gather} | common
            for name in options.scenes
            for paths, gather in ((None, "auto"), (10**6, "off"))
        ]
    return [
        {"scene": "", "triangles": SIZES[i], "samples": SIZES[j], "paths": 10 ** (5 + (i + j) % 3)}
        | {"gather": RAYS[SIZES[j]] if gathers else "off"}
        | common
        for i in range(3)
        for j in range(3)
        for gathers in (False, True)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", help=f"bundled scenes, {', '.join(ROOMS)}, or files")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--time", action="store_true", help="plan each case, too")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(json.loads(options.one))))
        return
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache  # children find what was calibrated here
        machine_constants()
        compare(options)


def compare(options: argparse.Namespace) -> None:
    """All cases, a line each."""
    rows = []
    print(f"{'scene':<12}{'triangles':>10}{'samples':>9}{'paths':>10}{'rays':>10}{'peak MiB':>10}"
          f"{'forecast':>10}{'/peak':>7}{'/grown':>7}{'saving':>8}"
          f"{'CPU s':>8}{'plan':>8}{'/true':>7}")  # fmt: skip
    for case in cases(options):
        command = [sys.executable, __file__, "--one", json.dumps(case)]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode:
            print(f"{case}: {run.stderr.strip().splitlines()[-1]}", flush=True)
            continue
        row = json.loads(run.stdout)
        rows.append(row)
        plan, true = row.get("planned_seconds", float("nan")), row["true_seconds"]
        print(f"{Path(row['scene'] or 'hall').stem:<12}{row['triangles']:>10}{row['samples']:>9}"
              f"{row['paths']:>10}{row['rays']:>10}{row['peak'] / MIB:>10.1f}{row['forecast'] / MIB:>10.1f}"
              f"{row['forecast'] / row['peak']:>7.2f}{row['forecast'] / row['grown']:>7.2f}"
              f"{row['saving'] / MIB:>8.1f}{true:>8.1f}{plan:>8.1f}"
              f"{plan / true:>7.2f}", flush=True)  # fmt: skip
        OUT.parent.mkdir(parents=True, exist_ok=True)
        OUT.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
