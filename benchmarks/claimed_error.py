# SPDX-License-Identifier: Apache-2.0
"""Whether the error that a bake claims is true: its median and 90th percentile against the spread over seeds.

    PYTHONPATH=python python benchmarks/claimed_error.py office expo room.glb

Some of the default samples of each scene, 33 side by side each time, as many as pool their errors, are
baked with many seeds, with the rays and paths that all of them would have. What a summary
claims is computed for each seed; the truth is each sample's root mean square deviation from the mean over
the seeds, relative to the same floor. Writes
benchmarks/out/claimed_error.json.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux import session_options
from deltalux.report.claimed_error import claimed_error
from numpy.typing import NDArray
from peers.pictured_rooms import ROOMS, named_scene
from scipy.spatial import cKDTree

TOGETHER = 33  # samples: a window of pool_errors.cpp


def drawn(samples: dl.Samples, count: int) -> tuple[dl.Samples, NDArray]:
    """`count` of the static samples in groups of neighbours, each group as likely as its area is large."""
    still = np.flatnonzero(samples.attached == None)  # noqa: E711, elementwise
    share = samples.areas[still] / samples.areas[still].sum()
    first = np.random.default_rng(4).choice(len(still), count // TOGETHER, p=share)
    places = np.hstack([samples.points, samples.normals])[still]
    taken = still[cKDTree(places).query(places[first], TOGETHER)[1].ravel()]
    return dl.Samples(samples.points[taken], samples.normals[taken], radius=0.1), np.ones(len(taken))


def measure(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Claims and truth of one scene."""
    scene = named_scene(name)
    whole = dl.Samples.on_vertices(scene)
    rays = session_options.resolved_gather("auto", len(whole), "first", "reachable")
    samples, areas = drawn(whole, options.samples)
    start = time.process_time()
    found, errors, claims = [], [], []
    for seed in range(options.seeds):
        with dl.Session(scene, samples, gather=rays, seed=100 + seed) as session:
            session.bake()
            found.append(session.irradiance)
            errors.append(session.standard_error)
            claims.append(claimed_error(found[-1], errors[-1], areas))
    light = np.array(found)
    spread = light.std(axis=0, ddof=1)
    true = claimed_error(light.mean(axis=0), spread, areas)
    median, p90 = (np.median([getattr(c, part) for c in claims]) for part in ("median", "p90"))
    row = {
        "scene": Path(name).stem,
        "samples": len(whole),
        "gather": rays,
        "claimed": {"median": float(median), "p90": float(p90)},
        "true": {"median": true.median, "p90": true.p90},
        "seconds": time.process_time() - start,
    }
    print(
        f"{row['scene']}: {rays} rays; median {median:.2%} claimed, {true.median:.2%} true; 90 % below "
        f"{p90:.2%} claimed, {true.p90:.2%} true: {p90 / true.p90:.2f}",
        flush=True,
    )
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scenes", nargs="+", help=f"bundled scenes, {', '.join(ROOMS)}, or files")
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--samples", type=int, default=200 * TOGETHER, help="of each scene")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/out/claimed_error.json"))
    options = parser.parse_args()
    rows = [measure(name, options) for name in options.scenes]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
