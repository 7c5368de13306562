# SPDX-License-Identifier: Apache-2.0
"""Updates by default options, against the bake: what moving each movable of a scene costs.

    PYTHONPATH=python:benchmarks python benchmarks/default_updates.py office expo gallery study
    PYTHONPATH=python:benchmarks python benchmarks/default_updates.py room.glb --movable chair

Each movable is moved along +X by a hundredth of the scene's diagonal and back (the other way, if it would
leave the scene), and both updates are timed, on the wall clock. After all of them the session must equal a
recompute, which is timed, too. "at most" is the ratio of an update that casts only the rays that change, if
each took as long as one of the recompute. Writes benchmarks/out/default_updates.json.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from edited_rooms import room_named

OUT = Path(__file__).resolve().parent / "out" / "default_updates.json"
STEP = 0.01  # of the diagonal


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds on the wall clock, and the result."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def moves(session: dl.Session, name: str) -> list[dict[str, float]]:
    """Times and rays of a step and of the way back."""
    low, high = session.scene.bounds
    there = np.array(session.poses[name])
    aside = there.copy()
    aside[0, 3] += STEP * float(np.linalg.norm(high - low))
    try:
        session.move(name, aside)
    except dl.OptionError:
        aside[0, 3] = 2 * there[0, 3] - aside[0, 3]
    found = []
    for pose in (aside, there):
        session.move(name, pose)
        seconds, frame = timed(session.update)
        rays = {"rays": frame.gathered_rays, "changed": frame.changed_rays}
        found.append({"seconds": seconds, **rays, "paths": frame.affected_paths})
    return found


def measured(source: str, movable: list[str]) -> dict[str, Any]:
    """Bake, updates and recompute of one scene."""
    scene = room_named(source)
    if movable:
        scene = dl.scene.make_movable(scene, movable)
    with dl.Session(scene, dl.Samples.on_vertices(scene)) as session:
        bake, _ = timed(session.bake)
        updates = {name: moves(session, name) for name in scene.movable}
        digest = session.digest()
        recompute, _ = timed(session.recompute)
        if session.digest() != digest:
            raise SystemExit(f"{source}: the updated session differs from a recompute")
        rays = session.statistics["gather"]["rays"] if session.options["gather"] != "off" else 0
        return {
            "samples": len(session.samples),
            "rays": rays,
            "bake": bake,
            "recompute": recompute,
            "updates": updates,
        }


def main() -> int:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", default=["office", "expo"])
    parser.add_argument("--movable", action="append", default=[])
    args = parser.parse_args()
    found = {"load": os.getloadavg()[0], "scenes": {s: measured(s, args.movable) for s in args.scenes}}
    for source, scene in found["scenes"].items():
        print(f"{source}: {scene['samples']:,} samples, {scene['rays']:,} rays, equal to a recompute")
        for name, steps in scene["updates"].items():
            seconds = max(step["seconds"] for step in steps)
            again = max(step["rays"] for step in steps)
            changed = max(step["changed"] for step in steps)
            print(
                f"  {name}: recompute / update {scene['recompute'] / seconds:.1f} (at most "
                f"{scene['rays'] / max(1, changed):.0f}), rays again {again / max(1, scene['rays']):.1%}, "
                f"of which {changed / max(1, again):.0%} change"
            )
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
