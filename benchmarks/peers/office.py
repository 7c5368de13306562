# SPDX-License-Identifier: Apache-2.0
"""The office at 50,000 points: CPU time to equal error for Deltalux, Mitsuba 3 and Radiance.

    make bench-peers

Every program uses one thread and gets the same points; its error is taken at those that have a
reference (reference_office.npz) on which Mitsuba and Radiance agree; with --open not at those in
slits between touching things. Then the chair moves: Deltalux updates, the others start again.
Results of programs that are not run again are kept in the JSON file.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from deltalux.scene import Scene
from deltalux.scenes import office
from numpy.typing import NDArray
from oracles import mitsuba_reference, radiance_reference
from oracles import office_reference as reference
from oracles.metrics import Run, change_error, relative_error, seconds_to

POINTS = 50_000
TARGETS = (0.10, 0.05, 0.02, 0.01)
MITSUBA_SAMPLES = (16, 64, 256, 1024)  # per point
CHANGE_SAMPLES = (256, 1024, 4096)
# Finer settings (-ab 5 -aa 0.2 -ar 64 -ad 1024) took eight times as long and had 67 % error.
RADIANCE = [{"ab": 4, "aa": 0.3, "ar": 32, "ad": 512, "as_": 128}]
RADIANCE_COMMON = {"lr": -10, "lw": 1e-4, "ds": 0.2, "dj": 0.9, "dt": 0.05, "dc": 0.5}
RADIANCE_PASSES = (1, 4, 16)  # without ambient cache, 16 ambient rays per point and pass
DELTALUX_SETTINGS = (  # rays of a sample, paths
    (16, 25_000),
    (32, 50_000),
    (64, 100_000),
    (128, 100_000),
    (256, 200_000),
    (384, 300_000),
    (512, 400_000),
    (1024, 1_000_000),
)
MOVES = 7  # of the chair there and back; the median counts
STATES = ("before", "after")
NEEDED = ("mitsuba_before", "mitsuba_after", "radiance_before", "radiance_after", "near_change")


class Bench:
    """The scenes, the points, and the answers they are held to."""

    def __init__(self, path: Path, open_only: bool) -> None:
        self.scenes: dict[str, Scene] = {"before": office()}
        self.scenes["after"] = reference.moved(self.scenes["before"])
        self.data = reference.load(self.scenes["before"], path, NEEDED)
        self.count = len(self.data["points"])
        near, near_normals = self.data["near_points"], self.data["near_normals"]
        more, more_normals = reference.reference_points(self.scenes["before"], POINTS - len(near))
        self.near = slice(self.count, self.count + len(near))
        self.points = np.concatenate([self.data["points"], near, more[self.count :]]).astype(np.float64)
        self.normals = np.concatenate([self.data["normals"], near_normals, more_normals[self.count :]])
        self.normals = self.normals.astype(np.float64)
        self.used = reference.is_certain(self.data) & (reference.is_open(self.data["free"]) | (not open_only))
        self.near_used = reference.is_open(self.data["near_free"]) | (not open_only)

    def error(self, irradiance: NDArray, state: str) -> float:
        """Relative error of irradiance at points that begin with the reference's."""
        name = f"mitsuba_{state}"
        arrays = irradiance[: self.count], self.data[name], self.data[f"{name}_error"]
        return relative_error(*(array[self.used].astype(np.float64) for array in arrays))

    def change_error(self, change: NDArray) -> float:
        """Relative error of the change at the points near the chair."""
        arrays = change, self.data["near_change"], self.data["near_change_error"]
        return change_error(*(array[self.near_used].astype(np.float64) for array in arrays))


def run_mitsuba(bench: Bench) -> dict[str, Any]:
    """Path tracing at the reference's points; the cost of all points is in proportion."""
    points, normals = bench.points[: bench.count], bench.normals[: bench.count]
    near, near_normals = bench.points[bench.near], bench.normals[bench.near]
    renderers = {}
    runs: dict[str, Any] = {}
    for state, scene in bench.scenes.items():
        renderer = renderers[state] = mitsuba_reference.Renderer(scene, sampler="multijitter")
        renderer.irradiance(points[:64], normals[:64], 4, passes=2)  # compiles the kernels
        runs[state] = []
        for samples in MITSUBA_SAMPLES:
            found = renderer.irradiance(points, normals, samples, passes=1, seed=7)
            seconds = found.cpu_seconds * POINTS / bench.count
            runs[state].append(_run(f"{samples} paths per point", seconds, bench.error(found.mean, state)))
    changes = []
    for samples in CHANGE_SAMPLES:
        found = mitsuba_reference.change(*renderers.values(), near, near_normals, samples, passes=1, seed=8)
        seconds = found.cpu_seconds * POINTS / len(near)
        name = f"{samples} paths per point, twice"
        changes.append(_run(name, seconds, bench.change_error(found.mean)))
    return {**runs, "change": changes}


def run_radiance(bench: Bench) -> dict[str, Any]:
    """rtrace with its ambient cache for all points in one process, and as a path tracer.

    The path tracer runs at the reference's points; the cost of all points is in proportion.
    """
    few = slice(0, bench.count)
    runs: dict[str, Any] = {}
    for state, scene in bench.scenes.items():
        renderer = radiance_reference.Renderer(scene)
        runs[state] = []
        for settings in RADIANCE:
            options = radiance_reference.Settings(**settings | RADIANCE_COMMON)
            found = renderer.irradiance(bench.points, bench.normals, options)
            name = " ".join(f"-{key.rstrip('_')} {value}" for key, value in settings.items())
            runs[state].append(_run(name, found.cpu_seconds, bench.error(found.mean, state)))
        for passes in RADIANCE_PASSES:
            traced = renderer.irradiance(
                bench.points[few], bench.normals[few], radiance_reference.Settings(), passes=passes
            )
            seconds = traced.cpu_seconds * POINTS / bench.count
            runs[state].append(_run(f"no cache, {passes} passes", seconds, bench.error(traced.mean, state)))
    return runs


def run_deltalux(bench: Bench) -> dict[str, Any]:
    """Bake, then the chair there and back; making the session and reading the result count."""
    import deltalux as dl

    runs: dict[str, Any] = {"before": [], "after": [], "change": []}
    there = bench.scenes["after"].mesh(reference.MOVED).pose
    for rays, paths in DELTALUX_SETTINGS:
        name = f"{rays} rays, {paths} paths"
        samples = dl.Samples(bench.points, bench.normals)
        start = time.process_time()
        session = dl.Session(bench.scenes["before"], samples, paths=paths, seed=1, threads=1, gather=rays)
        session.bake()
        before = session.irradiance
        runs["before"].append(_run(name, time.process_time() - start, bench.error(before, "before")))
        back = session.pose(reference.MOVED)
        seconds, results = [], []
        for i in range(MOVES):
            start = time.process_time()
            session.move(reference.MOVED, back if i % 2 else there)
            session.update()
            results.append(session.irradiance)
            seconds.append(time.process_time() - start)
        median = float(np.median(seconds))
        runs["after"].append(_run(name, median, bench.error(results[0], "after")))
        change = (results[0] - before)[bench.near]
        runs["change"].append(_run(name, median, bench.change_error(change)))
        session.close()
    return runs


PROGRAMS: dict[str, Callable[[Bench], dict[str, Any]]] = {
    "deltalux": run_deltalux,
    "mitsuba": run_mitsuba,
    "radiance": run_radiance,
}


def _run(setting: str, seconds: float, error: float) -> dict[str, Any]:
    run = Run(setting, round(seconds, 4), round(error, 5))
    print(f"    {setting}: {seconds:.3f} s, {error:.2%}", flush=True)
    return asdict(run)


def summary(runs: dict[str, Any]) -> dict[str, Any]:
    """CPU seconds to each target, and how many times sooner Deltalux gets there than the best peer."""
    table: dict[str, Any] = {}
    for state in STATES:
        for target in TARGETS:
            seconds = {
                name: seconds_to(target, [Run(**r) for r in found[state]], extrapolate=name != "deltalux")
                for name, found in runs.items()
            }
            peers = [s for name, s in seconds.items() if name != "deltalux" and s is not None]
            own = seconds.get("deltalux")
            ratio = min(peers) / own if peers and own else None
            table[f"{state} {target:.0%}"] = {**seconds, "times sooner": ratio}
    return table


def print_table(result: dict[str, Any]) -> None:
    """The summary as text."""
    names = [*result["runs"], "times sooner"]
    print(f"\nCPU seconds to an error, office, {POINTS} points, one thread")
    print(f"{'':14}" + "".join(f"{name:>14}" for name in names))
    for row, values in result["summary"].items():
        state, target = row.split()
        label = f"{'bake' if state == 'before' else 'moved'} {target}"
        cells = ("-" if values.get(name) is None else f"{values[name]:.3g}" for name in names)
        print(f"{label:14}" + "".join(f"{cell:>14}" for cell in cells))
    print("\nError of the change near the chair (RMS, of the RMS change)")
    for name, found in result["runs"].items():
        for run in found.get("change", []):
            print(f"  {name:10} {run['setting']:32} {run['cpu_seconds']:10.3f} s {run['error']:8.1%}")


def main() -> None:
    """Run the chosen programs, keep the others' results, write and print the table."""
    parser = argparse.ArgumentParser(description="Deltalux against Mitsuba 3 and Radiance")
    parser.add_argument("--programs", nargs="+", choices=PROGRAMS, default=list(PROGRAMS))
    parser.add_argument("--reference", type=Path, default=reference.PATH)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/out/peers.json"))
    parser.add_argument("--open", action="store_true", help="errors at open points alone")
    options = parser.parse_args()
    bench = Bench(options.reference, options.open)
    key = f"{bench.data['key']}{' open' if options.open else ''}"
    result: dict[str, Any] = json.loads(options.out.read_text()) if options.out.exists() else {}
    if result.get("reference") != key:
        result = {"reference": key, "points": POINTS, "runs": {}}
    options.out.parent.mkdir(parents=True, exist_ok=True)
    for name in options.programs:
        print(name, flush=True)
        result["runs"][name] = PROGRAMS[name](bench)
        result["summary"] = summary(result["runs"])
        options.out.write_text(json.dumps(result, indent=2) + "\n")
    print_table(result)


if __name__ == "__main__":
    main()
