# SPDX-License-Identifier: Apache-2.0
"""Rooms with contacts, small things and narrow spots: CPU time to equal error for three programs.

    make bench-peers

One thread, the points of contacts.py: on what does not move, on things of 4 to 10 cm, and the change
near each object that moves. Deltalux updates, the others render both states.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from contacts import Asked
from numpy.typing import NDArray
from oracles import mitsuba_reference, radiance_reference
from oracles.metrics import Run, change_error, relative_error, seconds_to
from room_reference import ROOMS

TARGETS = (0.05, 0.02, 0.01)
ROOM_NAMES = ("contacts", "spots")
MITSUBA_SAMPLES = (64, 256, 1024, 4096)  # per point
RADIANCE_PASSES = (4, 16, 64)  # without ambient cache, 16 ambient rays per point and pass
DELTALUX_SETTINGS = ((64, 100_000), (256, 200_000), (1024, 200_000), (4096, 1_000_000))  # rays, paths
PARTS = ("static", "small")
Row = dict[str, Any]


class Judge:
    """A room's points, and how wrong answers for them are."""

    def __init__(self, name: str) -> None:
        self.room = ROOMS[name]
        self.asked = Asked(self.room)
        self.scene, self.data = self.asked.scene, self.asked.data
        self.points = np.concatenate([self.data[f"{part}_points"] for part in PARTS])
        self.normals = np.concatenate([self.data[f"{part}_normals"] for part in PARTS])

    def row(self, setting: str, seconds: float, light: NDArray) -> Row:
        """A run: of the points of PARTS, in this order."""
        found, start = {}, 0
        for part in PARTS:
            reference, noise = self.data[part], self.data[f"{part}_error"]
            found[part] = relative_error(light[start : (start := start + len(reference))], reference, noise)
        return _shown({"setting": setting, "seconds": seconds, **found})

    def change_row(self, setting: str, seconds: list[float], changes: list[NDArray]) -> Row:
        """A run: the change near what moves, by move; seconds of one move."""
        errors = [
            change_error(found, self.data[f"near_{i}"], self.data[f"near_{i}_error"])
            for i, found in enumerate(changes)
        ]
        return _shown({"setting": setting, "seconds": float(np.median(seconds)), "change": errors})


def _shown(row: Row) -> Row:
    errors = [*(row[part] for part in PARTS if part in row), *row.get("change", [])]
    print(
        f"    {row['setting']:34} {row['seconds']:9.2f} s  {'  '.join(f'{e:.2%}' for e in errors)}",
        flush=True,
    )
    return row


def run_deltalux(judge: Judge) -> dict[str, list[Row]]:
    """Bakes of the points of PARTS; moves in sessions of the points near what moves, update alone timed."""
    runs: dict[str, list[Row]] = {"light": [], "change": []}
    for rays, paths in DELTALUX_SETTINGS:
        setting = f"{rays} rays, {paths} paths"
        options = {"paths": paths, "gather": rays, "seed": 1, "threads": 1}
        start = time.process_time()
        with dl.Session(judge.scene, dl.Samples(judge.points, judge.normals), **options) as session:
            session.bake()
            light = session.irradiance
            runs["light"].append(judge.row(setting, time.process_time() - start, light))
        seconds, changes = [], []
        for i, move in enumerate(judge.room.moves):
            near = dl.Samples(judge.data[f"near_{i}_points"], judge.data[f"near_{i}_normals"])
            with dl.Session(judge.scene, near, **options) as session:
                session.bake()
                before = session.irradiance
                start = time.process_time()
                session.move(move.mesh, judge.room.after(judge.scene, move).mesh(move.mesh).pose)
                session.update()
                changes.append(session.irradiance - before)
                seconds.append(time.process_time() - start)
        runs["change"].append(judge.change_row(setting, seconds, changes))
    return runs


def run_mitsuba(judge: Judge) -> dict[str, list[Row]]:
    """Path tracing with light selection, multijitter."""

    def renderer(scene: dl.Scene) -> mitsuba_reference.Renderer:
        made = mitsuba_reference.Renderer(scene, sampler="multijitter")
        made.irradiance(judge.points[:64], judge.normals[:64], 4, passes=2)  # compiles the kernels
        return made

    base = renderer(judge.scene)
    moved = [renderer(judge.room.after(judge.scene, move)) for move in judge.room.moves]
    runs: dict[str, list[Row]] = {"light": [], "change": []}
    for samples in MITSUBA_SAMPLES:
        found = base.irradiance(judge.points, judge.normals, samples, passes=1, seed=7)
        runs["light"].append(judge.row(f"{samples} paths per point", found.cpu_seconds, found.mean))
        near = [(judge.data[f"near_{i}_points"], judge.data[f"near_{i}_normals"]) for i in range(len(moved))]
        both = [
            mitsuba_reference.change(base, after, *places, samples, passes=1, seed=8)
            for after, places in zip(moved, near, strict=True)
        ]
        seconds = [pair.cpu_seconds for pair in both]
        setting = f"{samples} paths per point, twice"
        runs["change"].append(judge.change_row(setting, seconds, [pair.mean for pair in both]))
    return runs


def run_radiance(judge: Judge) -> dict[str, list[Row]]:
    """rtrace without its ambient cache."""
    base = radiance_reference.Renderer(judge.scene)
    moved = [radiance_reference.Renderer(judge.room.after(judge.scene, move)) for move in judge.room.moves]
    settings = radiance_reference.Settings()
    runs: dict[str, list[Row]] = {"light": [], "change": []}
    for passes in RADIANCE_PASSES:
        found = base.irradiance(judge.points, judge.normals, settings, passes=passes)
        runs["light"].append(judge.row(f"{passes} passes", found.cpu_seconds, found.mean))
        changes, seconds = [], []
        for i, after in enumerate(moved):
            near = judge.data[f"near_{i}_points"], judge.data[f"near_{i}_normals"]
            pair = [one.irradiance(*near, settings, passes=passes) for one in (base, after)]
            changes.append(pair[1].mean - pair[0].mean)
            seconds.append(sum(one.cpu_seconds for one in pair))
        runs["change"].append(judge.change_row(f"{passes} passes, twice", seconds, changes))
    return runs


PROGRAMS: dict[str, Callable[[Judge], dict[str, list[Row]]]] = {
    "deltalux": run_deltalux,
    "mitsuba": run_mitsuba,
    "radiance": run_radiance,
}


def print_table(room: str, runs: dict[str, dict[str, list[Row]]]) -> None:
    """Seconds to each target; of peers, beyond their best run by the square root."""
    print(f"\n{room}: CPU seconds to an error, one thread; changes: the worst move")
    for part in (*PARTS, "change"):
        for target in TARGETS:
            cells = []
            for name, found in runs.items():
                rows = [
                    Run(row["setting"], row["seconds"], float(np.max(row[part])))
                    for row in found["change" if part == "change" else "light"]
                ]
                seconds = seconds_to(target, rows, extrapolate=name != "deltalux")
                cells.append(f"{name} {'-' if seconds is None else f'{seconds:.3g}'}")
            print(f"  {part:8}{target:4.0%}   " + "   ".join(cells))


def main() -> None:
    """Run the chosen programs in the chosen rooms, write and print what they took."""
    parser = argparse.ArgumentParser(description="Rooms with contacts: Deltalux, Mitsuba 3 and Radiance")
    parser.add_argument("--room", nargs="+", choices=ROOM_NAMES, default=list(ROOM_NAMES))
    parser.add_argument("--programs", nargs="+", choices=PROGRAMS, default=list(PROGRAMS))
    parser.add_argument("--out", type=Path, default=Path("benchmarks/out/peers_rooms.json"))
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    table: dict[str, Any] = json.loads(options.out.read_text()) if options.out.exists() else {}
    for name in options.room:
        judge = Judge(name)
        runs = table.setdefault(name, {})
        for program in options.programs:
            print(f"{name}, {program}: static, small; changes by move", flush=True)
            runs[program] = PROGRAMS[program](judge)
            options.out.write_text(json.dumps(table, indent=2) + "\n")
        print_table(name, runs)


if __name__ == "__main__":
    main()
