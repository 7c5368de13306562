# SPDX-License-Identifier: Apache-2.0
"""What the pilot predicts against what the methods count and take, on all segments of whole scenes.

Samples lie on the surfaces of the atrium and the expo, and in the volume of the uniform lines. Counts come
from `dl.estimate`, times from benchmarks/method_times.cpp: one thread, processor time. Constants are measured
anew before and after each of five repetitions, since a shared machine is not as fast now as it was a second
ago: the mean of both predictions over the measured time, and of the five the median counts. Writes
benchmarks/out/planner_accuracy.json.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux import _core
from deltalux.studies.scene_samples import uniform_on_surfaces
from planner_regret import Batch, seconds_of
from uniform_samples import radius_for_hits

OUT = Path(__file__).resolve().parent / "out" / "planner_accuracy.json"
SAMPLES = (3_000, 20_000, 100_000)
PATHS, LINES, HITS = 1_000_000, 1 << 20, 0.75
REPETITIONS = 5
TESTS = {"disc_index": ("node_tests", "disc_tests"), "sphere_cache": ("sphere_tests", "disc_tests")}


def inputs() -> Iterator[tuple[str, dl.Segments, dl.Samples]]:
    """Every configuration."""
    for name in ("atrium", "expo"):
        scene = getattr(dl.scenes, name)()
        segments = dl.trace(scene, PATHS, seed=1)
        for count in SAMPLES:
            radius = radius_for_hits(scene, count, HITS)
            yield f"{name} {count}", segments, uniform_on_surfaces(scene, count, 1, radius, movables=False)
    lines, rng = dl.uniform_lines(LINES, seed=1), np.random.default_rng(1)
    side = 2 / np.sqrt(3)
    for count in SAMPLES[:2]:
        points = rng.uniform(-side / 2, side / 2, (count, 3))
        normals = rng.normal(size=(count, 3))
        yield f"lines {count}", lines, dl.Samples(points, normals, radius=side / count ** (1 / 3))


def measure(launcher: list[str]) -> dict[str, Any]:
    """Predicted and full counts, and the times of each repetition."""
    results: dict[str, Any] = {}
    for key, segments, samples in inputs():
        with tempfile.TemporaryDirectory() as folder:
            batch = Batch(Path(folder), 1, tuple(TESTS))
            batch.add(key, segments, samples)
            rounds, constants = [], [_core.calibrate(None)]
            for _ in range(REPETITIONS):
                result = batch.measure(launcher)[key]
                constants = [constants[-1], _core.calibrate(None)]
                times = seconds_of(result["measured"], True)
                sizes = float(len(samples)), float(len(segments))
                rounds.append(
                    {
                        method: {
                            "measured": times[method],
                            "predicted": sum(
                                sum(_core.predicted_seconds(method, result["counts"][method], *sizes, c))
                                for c in constants
                            )
                            / 2,
                        }
                        for method in TESTS
                    }
                )
        full = {
            method: getattr(dl.estimate, method)(segments, samples, segment_end="first").stats
            for method in TESTS
        }
        results[key] = {k: result[k] for k in ("segments", "planning", "counts")} | {
            "samples": len(samples),
            "full": {m: {kind: full[m][kind] for kind in kinds} for m, kinds in TESTS.items()},
            "rounds": rounds,
        }
    return results


def report(results: dict[str, Any]) -> str:
    """Predicted over full, and over measured."""
    lines = []
    for key, result in results.items():
        lines.append(f"{key} samples, {result['segments']:,} segments, planning {result['planning']:.2f} s")
        for method, kinds in TESTS.items():
            errors = ", ".join(
                f"{kind} {result['counts'][method][kind] / result['full'][method][kind] - 1:+.2%}"
                for kind in kinds
            )
            ratios = sorted(r[method]["predicted"] / r[method]["measured"] - 1 for r in result["rounds"])
            lines.append(
                f"  {method}: {errors}; time {np.median(ratios):+.0%} ({ratios[0]:+.0%} to {ratios[-1]:+.0%})"
            )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--launcher", default="", help='words before the timed program, as "taskset -c 1"')
    results = measure(parser.parse_args().launcher.split())
    OUT.parent.mkdir(parents=True, exist_ok=True)
    OUT.write_text(json.dumps(results, indent=1))
    print(report(results))


if __name__ == "__main__":
    main()
