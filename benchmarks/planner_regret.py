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
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux import _core
from deltalux.planning import machine_constants, predict
from near_segments import NearSegments

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build" / "bench" / "method_times"
OUT = ROOT / "benchmarks" / "out" / "planner_regret.json"
SCENES = ("atrium", "expo", "lines")
SIZES = (0.01, 0.05, 0.2, 0.6)  # radius of the object over that of the scene
SAMPLES = (10_000, 100_000, 1_000_000)
PATHS = (100_000, 1_000_000, 4_000_000)
MANY = 1_000_000  # samples that only the middle number of paths is combined with
MOST_SEGMENTS = 700_000  # near an object; beyond it a configuration takes too long
ALWAYS = ("disc_index", "sphere_cache")  # are timed
# The others are not where they are predicted to take so many times the fastest, and so many seconds.
HOPELESS, LEAST_SKIPPED = 10, 0.3
METHODS = ("brute_force", "disc_index", "ray_map", "sphere_cache")
PAPER_SIZE = 0.35
REPETITIONS = 3


class Batch:
    """Configurations that are timed in one go.

    Parameters
    ----------
    folder : for the inputs of the timed program
    repetitions : of every method, interleaved
    methods : which may be timed
    """

    def __init__(
        self, folder: Path, repetitions: int = REPETITIONS, methods: Sequence[str] = METHODS
    ) -> None:
        self._folder, self._repetitions, self._methods = folder, repetitions, methods
        self._pending: dict[str, dict[str, Any]] = {}
        self._commands: list[str] = []
        self.seconds = 0.0  # that the timing will take, about

    def add(self, key: str, segments: dl.Segments, samples: dl.Samples) -> None:
        """Run the pilots of one configuration, and keep its segments for the timing."""
        start = time.process_time()
        predicted = predict(segments, samples, self._methods, segment_end="first", threads=1)
        planning = time.process_time() - start
        fastest = min(cost.search_seconds + 0.1 * cost.build_seconds for cost in predicted.values())
        methods = [
            m
            for m, cost in predicted.items()
            if m in ALWAYS or cost.seconds < max(LEAST_SKIPPED, HOPELESS * fastest)
        ]
        self.seconds += self._repetitions * sum(predicted[m].seconds for m in methods)
        self._pending[key] = {
            "segments": len(segments),
            "planning": planning,
            "counts": {m: dict(cost.counts) for m, cost in predicted.items()},
        }
        file = self._folder / str(len(self._commands))
        with file.open("wb") as out:
            np.array([len(segments), len(samples)], np.uint64).tofile(out)
            for column in (*segments.origin.T, *segments.direction.T, segments.length, segments.extended):
                np.ascontiguousarray(column, np.float32).tofile(out)
            for column in (samples.points, samples.normals, samples.radius):
                column.astype(np.float32).tofile(out)
        self._commands.append(shlex.join([str(PROGRAM), str(file), str(self._repetitions), *methods]))

    def measure(self, launcher: list[str]) -> dict[str, Any]:
        """Time them all: by configuration, medians of seconds to build and to search by method."""
        script = self._folder / "script"
        script.write_text("set -e\n" + "\n".join(self._commands) + "\n")
        done = subprocess.run([*launcher, "sh", str(script)], capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"method_times failed ({done.returncode}): {done.stderr}")
        for result, line in zip(self._pending.values(), done.stdout.splitlines(), strict=True):
            result["measured"] = {
                name: {kind: float(np.median(values)) for kind, values in times.items()}
                for name, times in json.loads(line).items()
            }
        return self._pending


def configurations() -> Iterator[tuple[str, int, float, int]]:
    """Scene, paths, size, samples."""
    for scene, paths, size, samples in itertools.product(SCENES, PATHS, SIZES, SAMPLES):
        if samples < MANY or paths == PATHS[1]:
            yield scene, paths, size, samples


def run(seconds: float, results: dict[str, Any], launcher: list[str]) -> None:
    """Measure what is missing, so many seconds of timing at a time."""
    near: tuple[str, NearSegments] | None = None
    missing = [c for c in configurations() if " ".join(map(str, c)) not in results]
    while missing:
        with tempfile.TemporaryDirectory() as folder:
            batch = Batch(Path(folder))
            while missing and batch.seconds < seconds:
                scene, paths, size, samples = missing.pop(0)
                key = f"{scene} {paths} {size} {samples}"
                if near is None or near[0] != scene:
                    near = scene, NearSegments(scene)
                segments = near[1](paths, size, MOST_SEGMENTS)
                if segments is None or len(segments) == 0:
                    results[key] = None
                else:
                    batch.add(key, segments, near[1].samples(samples, size))
                print(key, 0 if segments is None else len(segments), file=sys.stderr, flush=True)
            results |= batch.measure(launcher)
        OUT.parent.mkdir(parents=True, exist_ok=True)
        OUT.write_text(json.dumps(results, indent=1))


def seconds_of(times: dict[str, dict[str, float]], rebuilt: bool) -> dict[str, float]:
    """By method, with the build or without."""
    return {m: t["search"] + (t["build"] if rebuilt else 0.0) for m, t in times.items()}


def regrets(results: dict[str, Any]) -> list[dict[str, Any]]:
    """One row per configuration and context."""
    rows = []
    for key, result in results.items():
        if result is None:
            continue
        size, samples = float(key.split()[2]), float(key.split()[3])
        prediction = {}
        for m, counts in result["counts"].items():
            build, search = _core.predicted_seconds(
                m, counts, samples, result["segments"], machine_constants()
            )
            prediction[m] = {"build": build, "search": search}
        for rebuilt in (False, True):
            measured = seconds_of(result["measured"], rebuilt)
            predicted = seconds_of(prediction, rebuilt)
            best = min(measured, key=lambda m: measured[m])
            chosen = min(predicted, key=lambda m: predicted[m])
            paper = "sphere_cache" if size < PAPER_SIZE else "disc_index"
            # One that was not timed and chosen all the same counts as hopeless.
            worst = HOPELESS * measured[best]
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
    parser.add_argument("--seconds", type=float, default=100, help="of timing between two savings, about")
    parser.add_argument("--fresh", action="store_true", help="forget what was measured before")
    parser.add_argument("--launcher", default="", help='words before the timed program, as "taskset -c 1"')
    arguments = parser.parse_args()
    results = json.loads(OUT.read_text()) if OUT.exists() and not arguments.fresh else {}
    run(arguments.seconds, results, arguments.launcher.split())
    print(report(results))


if __name__ == "__main__":
    main()
