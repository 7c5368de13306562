# SPDX-License-Identifier: Apache-2.0
"""Are automatic methods ever slower than the best fixed ones, planning included?

In each bundled scene a session bakes and then moves its first movable a few times, with automatic methods
and with every pair of fixed ones that may compete. One thread, processor time, interleaved repetitions,
medians. The constants of the machine are known before, as in all but the first session on a machine.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux.planning import machine_constants

OUT = Path(__file__).resolve().parent / "out" / "planner_sessions.json"
SCENES = ("atrium", "expo", "office", "cornell_box")
PAIRS = (  # static, moving
    ("auto", "auto"),
    ("disc_index", "disc_index"),
    ("disc_index", "sphere_cache"),
    ("disc_index", "ray_map"),
    ("sphere_cache", "sphere_cache"),
)
FRAMES = 10
REPETITIONS = 3


def seconds(scene: dl.Scene, samples: dl.Samples, paths: int, pair: tuple[str, str]) -> dict[str, float]:
    """Processor seconds of a bake and of the frames after it."""
    with dl.Session(
        scene, samples, paths=paths, threads=1, gather="off", static_method=pair[0], moving_method=pair[1]
    ) as session:
        start = time.process_time()
        session.bake()
        baked = time.process_time()
        name = scene.movable[0]
        pose = session.pose(name)
        for frame in range(FRAMES):
            step = np.eye(4)
            step[0, 3] = 0.05 * (-1) ** frame
            session.move(name, pose @ step)
            session.update()
        return {"bake": baked - start, "frames": time.process_time() - baked}


def measure(name: str, paths: int, repetitions: int) -> dict[str, Any]:
    """Medians of every pair in one scene."""
    scene = getattr(dl.scenes, name)()
    samples = dl.Samples.on_vertices(scene)
    runs: dict[str, list[dict[str, float]]] = {"/".join(pair): [] for pair in PAIRS}
    for _ in range(repetitions):
        for pair in PAIRS:
            runs["/".join(pair)].append(seconds(scene, samples, paths, pair))
    return {
        pair: {kind: float(np.median([run[kind] for run in own])) for kind in ("bake", "frames")}
        for pair, own in runs.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=SCENES, help="bundled scenes; all when not given")
    parser.add_argument("--paths", type=int, default=200_000)
    parser.add_argument("--repetitions", type=int, default=REPETITIONS)
    arguments = parser.parse_args()
    machine_constants()
    results = json.loads(OUT.read_text()) if OUT.exists() else {}
    for name in arguments.scenes:
        results[name] = measure(name, arguments.paths, arguments.repetitions)
        OUT.parent.mkdir(parents=True, exist_ok=True)
        OUT.write_text(json.dumps(results, indent=1))
    print(f"{'scene':<14}{'static/moving':<30}{'bake':>9}{'frames':>9}{'all':>9}   automatic over this")
    for name, pairs in results.items():
        total = {pair: own["bake"] + own["frames"] for pair, own in pairs.items()}
        for pair, own in pairs.items():
            ratio = total["auto/auto"] / total[pair]
            times = "".join(f"{t:>8.2f}s" for t in (own["bake"], own["frames"], total[pair]))
            print(f"{name:<14}{pair:<30}{times}   {ratio:.3f}")


if __name__ == "__main__":
    main()
