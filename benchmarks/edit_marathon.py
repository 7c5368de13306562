# SPDX-License-Identifier: Apache-2.0
"""Ten thousand random edits of one session; the digest must stay that of a computation from scratch.

    PYTHONPATH=python python benchmarks/edit_marathon.py

Edits are moves, nudges, removals, additions, dimming, new reflectances and a few new lamps, now and
then several at once or on a budget. Every 100 edits, and at the end, digest,
irradiance and standard error are compared with those of recompute(). Exit 1 at the first difference.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import deltalux as dl
import numpy as np
from deltalux import scenes
from deltalux.studies.scene_samples import uniform_on_surfaces

MOST_NEW_LAMPS = 20
REPORT_EVERY = 1000


def resident_mib() -> float:
    """Memory of this process."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return float("nan")


def random_pose(rng: np.random.Generator, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Anywhere in the box, turned about a random axis."""
    axis, angle = rng.normal(size=3), rng.uniform(-np.pi, np.pi)
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    pose = np.eye(4)
    pose[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    pose[:3, 3] = rng.uniform(low, high)
    return pose


def lamp(name: str, material: str, pose: np.ndarray) -> dl.Mesh:
    """A luminous tetrahedron of about ten centimetres."""
    corners = 0.05 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
    return dl.Mesh(
        name, corners, [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)], material, pose=pose, movable=True
    )


class Marathon:
    """A session and a stream of random edits."""

    def __init__(self, session: dl.Session, seed: int) -> None:
        self.session, self.rng = session, np.random.default_rng(seed)
        self.low, self.high = session.scene.bounds
        self.materials = [m.name for m in session.scene.materials if not m.emissive]
        self.luminous = [m.name for m in session.scene.materials if m.emissive and m.group]
        self.edits = self.updates = self.new_lamps = self.refused = 0
        self.counts: dict[str, int] = {}
        self.update_ms: list[float] = []

    def edit(self) -> None:
        """Queue one edit."""
        kinds = ("move", "nudge", "toggle", "dim", "paint", "lamp")
        kind = str(self.rng.choice(kinds, p=(0.35, 0.25, 0.15, 0.1, 0.145, 0.005)))
        if kind == "lamp" and (self.new_lamps >= MOST_NEW_LAMPS or not self.luminous):
            kind = "move"
        try:
            getattr(self, f"_{kind}")()
        except dl.OptionError as error:
            if "would leave" not in str(error):
                raise
            self.refused += 1
            return
        self.edits += 1
        self.counts[kind] = self.counts.get(kind, 0) + 1

    def _name(self) -> str:
        return str(self.rng.choice(list(self.session.poses)))

    def _move(self) -> None:
        self.session.move(self._name(), random_pose(self.rng, self.low, self.high))

    def _nudge(self) -> None:
        name = self._name()
        pose = self.session.pose(name)
        pose[:3, 3] += self.rng.normal(size=3) * 0.05
        self.session.move(name, pose)

    def _toggle(self) -> None:
        name = self._name()
        (self.session.add if self.session.poses[name] is None else self.session.remove)(name)

    def _dim(self) -> None:
        group = self.rng.choice(list(self.session.dim_factors))
        self.session.dim(group, float(self.rng.choice([0.0, 0.5, 1.0, self.rng.uniform()])))

    def _paint(self) -> None:
        self.session.set_reflectance(self.rng.choice(self.materials), self.rng.uniform(0, 0.8, 3))

    def _lamp(self) -> None:
        name = f"new lamp {self.new_lamps}"
        material = str(self.rng.choice(self.luminous))
        self.session.add(lamp(name, material, random_pose(self.rng, self.low + 0.2, self.high - 0.2)))
        self.new_lamps += 1

    def step(self) -> None:
        """One edit, sometimes up to four, then an update."""
        for _ in range(1 if self.rng.random() < 0.8 else self.rng.integers(2, 5)):
            self.edit()
        start = time.perf_counter()
        budget = float(self.rng.uniform(0.01, 3)) if self.rng.random() < 0.15 else None
        self.session.update(budget_ms=budget)
        self.update_ms.append(1e3 * (time.perf_counter() - start))
        self.updates += 1

    def check(self) -> bool:
        """Compare with a computation from scratch."""
        session = self.session
        digest = session.digest()  # finishes what is pending
        before = session.irradiance, session.standard_error, session.sums
        session.recompute()
        after = session.irradiance, session.standard_error, session.sums
        energy = session.energy
        kept = np.add(energy["absorbed"], energy["escaped"])
        return (
            session.digest() == digest
            and all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
            and bool((kept == energy["emitted"]).all())
        )


def run(args: argparse.Namespace) -> int:
    """The marathon; returns the exit code."""
    scene = getattr(scenes, args.scene)()
    samples = uniform_on_surfaces(scene, args.samples, seed=1, radius=None)
    gather = int(args.gather) if args.gather.isdigit() else args.gather
    options = {
        "direct": args.direct,
        "segment_end": args.segment_end,
        "threads": args.threads,
        "gather": gather,
    }
    with dl.Session(scene, samples, paths=args.paths, seed=args.seed, **options) as session:
        session.bake()
        marathon = Marathon(session, args.seed)
        start, checks, next_check, next_report = time.perf_counter(), 0, args.check_every, REPORT_EVERY
        memory = resident_mib()
        while marathon.edits < args.edits:
            marathon.step()
            last = marathon.edits >= args.edits
            if marathon.edits < next_check and not last:
                continue
            next_check += args.check_every
            checks += 1
            if not marathon.check():
                print(f"DIFFERENT after {marathon.edits} edits (check {checks}, seed {args.seed})")
                return 1
            if marathon.edits >= next_report or last:
                next_report += REPORT_EVERY
                print(
                    f"{marathon.edits:6d} edits, {marathon.updates} updates, {checks} checks equal, "
                    f"median update {np.median(marathon.update_ms):.1f} ms, "
                    f"{session.statistics['segments']} segments, {resident_mib():.0f} MiB, "
                    f"{time.perf_counter() - start:.0f} s",
                    flush=True,
                )
        print(f"{args.scene}, {args.paths} paths, {len(samples)} samples, {options}")
        print(f"edits by kind: {marathon.counts}; {marathon.refused} more left the box and were refused")
        print(f"memory at the start {memory:.0f} MiB, at the end {resident_mib():.0f} MiB")
        print(f"EQUAL: {marathon.edits} edits, all {checks} comparisons with recompute() to the bit")
    return 0


def main() -> int:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="office", choices=("office", "expo", "atrium", "cornell_box"))
    parser.add_argument("--edits", type=int, default=10_000)
    parser.add_argument("--check-every", type=int, default=100, help="edits; 1 checks every update")
    parser.add_argument("--paths", type=int, default=4000)
    parser.add_argument("--samples", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--direct", default="auto", choices=("auto", "paths", "sampled"))
    parser.add_argument("--segment-end", default="first", choices=("first", "second", "bounded"))
    parser.add_argument("--gather", default="off", help='"off", "auto" or rays per sample')
    return run(parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
