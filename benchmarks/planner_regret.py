# SPDX-License-Identifier: Apache-2.0
"""Is the planner right? Regret of its choices, and of the paper's rule, over many configurations.

A configuration is a moving object: so many samples on a sphere of so large a share of the scene, and the
segments of so many paths that meet that sphere. Every method is timed, building apart from searching
(benchmarks/method_times.cpp), with estimators that are kept and with ones that are rebuilt in each frame.
Regret is the time of the chosen method over that of the best. Results are kept in
benchmarks/out/planner_regret.json; a run goes on where the last one stopped.
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux.planning import predict

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build" / "bench" / "method_times"
OUT = ROOT / "benchmarks" / "out" / "planner_regret.json"
SCENES = ("atrium", "expo", "lines")
SIZES = (0.01, 0.05, 0.2, 0.6)  # radius of the object over that of the scene
SAMPLES = (10_000, 100_000, 1_000_000)
PATHS = (100_000, 1_000_000, 4_000_000)
MANY = 1_000_000  # samples that only the middle number of paths is combined with
BATCH = 1_000_000  # paths traced at a time
MOST_SEGMENTS = 700_000  # near an object; beyond it a configuration takes too long
MOST_PAIRS = 3e8  # beyond it brute force takes seconds where others take a fraction
HITS = 0.75  # discs that a line through the object crosses on each side
METHODS = ("brute_force", "disc_index", "ray_map", "sphere_cache")
PAPER_SIZE = 0.35
REPETITIONS = 3


class NearSegments:
    """Segments of a scene's paths that meet spheres of all sizes around its middle."""

    def __init__(self, scene: str) -> None:
        self._scene = None if scene == "lines" else getattr(dl.scenes, scene)()
        if self._scene is None:
            self.centre, self.radius = np.zeros(3), 1.0
        else:
            low, high = np.array(self._scene.info()["bounds"])
            self.centre, self.radius = (low + high) / 2, float(np.linalg.norm(high - low) / 2)
        self._batches: dict[int, dl.Segments] = {}

    def _batch(self, paths: int, seed: int) -> dl.Segments:
        if self._scene is None:
            return dl.uniform_lines(paths, seed=seed)
        return dl.trace(self._scene, paths, seed=seed)

    def __call__(self, paths: int, size: float) -> dl.Segments | None:
        """Segments that meet the sphere, or None if there are too many of them."""
        parts = []
        for k in range(max(1, paths // BATCH)):
            key = k if paths >= BATCH else -1
            if key not in self._batches:
                self._batches[key] = self._batch(min(paths, BATCH), k + 1)
            segments = self._batches[key]
            parts.append(segments.select(self._meets(segments, size * self.radius)))
            if sum(map(len, parts)) > MOST_SEGMENTS:
                return None
        columns = [np.concatenate([getattr(p, c) for p in parts]) for c in ("origin", "direction", "length")]
        return dl.Segments(*columns, 1.0)

    def _meets(self, segments: dl.Segments, radius: float) -> np.ndarray:
        to = self.centre - segments.origin
        along = np.clip((to * segments.direction).sum(axis=1), 0, segments.length)
        nearest = to - segments.direction * along[:, None]
        return (nearest**2).sum(axis=1) <= radius**2

    def samples(self, count: int, size: float) -> dl.Samples:
        """Samples on the object, along a spiral, so that neighbours lie near each other."""
        radius = size * self.radius
        z = 1 - (2 * np.arange(count) + 1) / count
        angle = np.sqrt(4 * np.pi * count) * np.arccos(z)
        flat = np.sqrt(1 - z**2)
        normals = np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
        return dl.Samples(self.centre + radius * normals, normals, radius=radius * np.sqrt(4 * HITS / count))


def timed(segments: dl.Segments, samples: dl.Samples, methods: tuple[str, ...], launcher: list[str]) -> Any:
    """Medians of seconds to build and to search, by method."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "input"
        with file.open("wb") as out:
            np.array([len(segments), len(samples)], np.uint64).tofile(out)
            for column in (*segments.origin.T, *segments.direction.T, segments.length, segments.extended):
                np.ascontiguousarray(column, np.float32).tofile(out)
            for column in (samples.points, samples.normals, samples.radius):
                column.astype(np.float32).tofile(out)
        command = [*launcher, str(PROGRAM), str(file), str(REPETITIONS), *methods]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"method_times failed ({done.returncode}): {done.stderr}")
    return {
        name: {kind: float(np.median(values)) for kind, values in times.items()}
        for name, times in json.loads(done.stdout).items()
    }


def measure(segments: dl.Segments, object_samples: dl.Samples, launcher: list[str]) -> dict[str, Any]:
    """Predicted and measured seconds of one configuration."""
    start = time.process_time()
    predicted = predict(segments, object_samples, segment_end="first", threads=1)
    planning = time.process_time() - start
    methods = tuple(
        m for m in METHODS if m != "brute_force" or len(segments) * len(object_samples) <= MOST_PAIRS
    )
    return {
        "segments": len(segments),
        "planning": planning,
        "predicted": {
            m: {"build": cost.build_seconds, "search": cost.search_seconds} for m, cost in predicted.items()
        },
        "measured": timed(segments, object_samples, methods, launcher),
    }


def configurations() -> Iterator[tuple[str, int, float, int]]:
    """Scene, paths, size, samples."""
    for scene, paths, size, samples in itertools.product(SCENES, PATHS, SIZES, SAMPLES):
        if samples < MANY or paths == PATHS[1]:
            yield scene, paths, size, samples


def run(seconds: float, results: dict[str, Any], launcher: list[str]) -> bool:
    """Measure what is missing for about so long; True when nothing is."""
    start = time.perf_counter()
    near: tuple[str, NearSegments] | None = None
    for scene, paths, size, samples in configurations():
        key = f"{scene} {paths} {size} {samples}"
        if key in results:
            continue
        if time.perf_counter() - start > seconds:
            return False
        if near is None or near[0] != scene:
            near = scene, NearSegments(scene)
        segments = near[1](paths, size)
        skipped = segments is None or len(segments) == 0
        results[key] = None if skipped else measure(segments, near[1].samples(samples, size), launcher)
        OUT.parent.mkdir(parents=True, exist_ok=True)
        OUT.write_text(json.dumps(results, indent=1))
        print(key, "skipped" if skipped else f"{len(segments):,} segments", file=sys.stderr, flush=True)
    return True


def seconds_of(times: dict[str, dict[str, float]], rebuilt: bool) -> dict[str, float]:
    """By method, with the build or without."""
    return {m: t["search"] + (t["build"] if rebuilt else 0.0) for m, t in times.items()}


def regrets(results: dict[str, Any]) -> list[dict[str, Any]]:
    """One row per configuration and context."""
    rows = []
    for key, result in results.items():
        if result is None:
            continue
        size = float(key.split()[2])
        for rebuilt in (False, True):
            measured = seconds_of(result["measured"], rebuilt)
            predicted = seconds_of(result["predicted"], rebuilt)
            best = min(measured, key=lambda m: measured[m])
            chosen = min(predicted, key=lambda m: predicted[m])
            paper = "sphere_cache" if size < PAPER_SIZE else "disc_index"
            # Brute force that was too slow to be timed counts as ten times the best.
            worst = 10 * measured[best]
            rows.append(
                {
                    "key": key,
                    "rebuilt": rebuilt,
                    "best": best,
                    "chosen": chosen,
                    "regret": measured.get(chosen, worst) / measured[best],
                    "paper": measured[paper] / measured[best],
                    "accuracy": {m: predicted[m] / measured[m] for m in measured},
                }
            )
    return rows


def report(results: dict[str, Any]) -> str:
    """The table."""
    rows = regrets(results)
    lines = [f"{'configuration':<32}{'':<9}{'best':<14}{'chosen':<14}{'regret':>8}{'paper':>8}"]
    for row in rows:
        context = "rebuilt" if row["rebuilt"] else "kept"
        lines.append(
            f"{row['key']:<32}{context:<9}{row['best']:<14}{row['chosen']:<14}"
            f"{row['regret']:>8.2f}{row['paper']:>8.2f}"
        )
    for name, chosen in (("planner", "regret"), ("paper's rule", "paper")):
        for context in ("kept", "rebuilt", "all"):
            own = np.array([r[chosen] for r in rows if context in ("all", ("kept", "rebuilt")[r["rebuilt"]])])
            lines.append(
                f"{name:<14}{context:<9}{len(own):>4} choices: regret at most 1.10 in "
                f"{(own <= 1.1).mean():.1%}, mean {own.mean():.2f}, most {own.max():.2f}"
            )
    for method in METHODS:
        ratios = np.array([r["accuracy"][method] for r in rows if r["rebuilt"] and method in r["accuracy"]])
        if len(ratios):
            lines.append(
                f"{method:<14} predicted over measured: median {np.median(ratios):.2f}, "
                f"within 20 % in {(np.abs(ratios - 1) <= 0.2).mean():.0%}, "
                f"10 to 90 %: {np.percentile(ratios, 10):.2f} to {np.percentile(ratios, 90):.2f}"
            )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=1e9, help="stop after about so long")
    parser.add_argument("--fresh", action="store_true", help="forget what was measured before")
    parser.add_argument("--launcher", default="", help='words before the timed program, as "taskset -c 1"')
    arguments = parser.parse_args()
    results = json.loads(OUT.read_text()) if OUT.exists() and not arguments.fresh else {}
    done = run(arguments.seconds, results, arguments.launcher.split())
    print(report(results))
    if not done:
        print("not finished: run again to go on")


if __name__ == "__main__":
    main()
