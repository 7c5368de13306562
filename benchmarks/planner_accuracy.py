# SPDX-License-Identifier: Apache-2.0
"""What the pilot predicts against what the methods count and take, on all segments of whole scenes.

Samples lie on the surfaces of the atrium and the expo, and in the volume of the uniform lines. Counts come
from `dl.estimate`, times from benchmarks/method_times.cpp: one thread, processor time, medians of five
interleaved repetitions. Writes benchmarks/out/planner_accuracy.json.
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
from deltalux.planning import machine_constants
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
    """Predicted and full counts, and times."""
    full: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        batch = Batch(Path(folder), REPETITIONS, tuple(TESTS))
        for key, segments, samples in inputs():
            batch.add(key, segments, samples)
            full[key] = {"samples": len(samples)} | {
                method: {
                    kind: count
                    for kind, count in getattr(dl.estimate, method)(
                        segments, samples, segment_end="first"
                    ).stats.items()
                    if kind in kinds
                }
                for method, kinds in TESTS.items()
            }
        results = batch.measure(launcher)
    return {key: result | {"full": full[key]} for key, result in results.items()}


def report(results: dict[str, Any]) -> str:
    """Predicted over full."""
    lines = []
    for key, result in results.items():
        full = result["full"]
        sizes = float(full["samples"]), float(result["segments"])
        lines.append(f"{key} samples, {result['segments']:,} segments, planning {result['planning']:.2f} s")
        for method, kinds in TESTS.items():
            errors = ", ".join(
                f"{kind} {result['counts'][method][kind] / full[method][kind] - 1:+.2%}" for kind in kinds
            )
            lines.append(f"  {method}: {errors}")
        times = seconds_of(result["measured"], True)
        for method in TESTS:
            build, search = _core.predicted_seconds(
                method, result["counts"][method], *sizes, machine_constants()
            )
            error = (build + search) / times[method] - 1
            lines.append(f"  {method}: {times[method]:.3f} s, predicted {build + search:.3f} s, {error:+.0%}")
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
