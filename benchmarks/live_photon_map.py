# SPDX-License-Identifier: Apache-2.0
"""How far a photon map that keeps its valid photons drifts from a recompute: the office's chair moves.

python benchmarks/live_photon_map.py [paths]
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace

import deltalux as dl
import numpy as np
from deltalux.scene import Scene, replace_scene

STEPS = 8  # of 10 cm each along x
K = 50
KEYS = ("path", "bounce", "length", "origin", "direction", "quanta")


def with_chair_at(scene: Scene, x: float) -> Scene:
    pose = scene.mesh("chair").pose.copy()
    pose[0, 3] += x
    return replace_scene(
        scene, meshes=[replace(m, pose=pose) if m.name == "chair" else m for m in scene.meshes]
    )


def rows(segments: dl.Segments) -> np.ndarray:
    """One value per segment that is equal only for equal segments, but for some 1e-7 of chance."""
    columns = [np.ascontiguousarray(getattr(segments, key)).reshape(len(segments), -1) for key in KEYS]
    code = np.zeros(len(segments), np.uint64)
    for column in columns:
        bits = column.view(np.uint32) if column.itemsize == 4 else column.astype(np.uint32)
        for k in range(bits.shape[1]):
            code = (code ^ bits[:, k]) * np.uint64(0x9E3779B97F4A7C15)
            code ^= code >> np.uint64(29)
    return code


def compare(found: np.ndarray, expected: np.ndarray) -> dict[str, float]:
    difference = found - expected
    changed = difference != 0
    mean = expected.mean()
    return {
        "samples_that_differ_percent": 100 * changed.mean(),
        "mean_difference_percent": 100 * difference.mean() / mean,
        "rms_difference_percent": 100 * np.sqrt((difference**2).mean()) / mean,
        "rms_where_different_percent": 100
        * float(np.sqrt(((difference / expected)[changed & (expected > 0)] ** 2).mean())),
    }


def main(paths: int) -> None:
    office = dl.scenes.office()
    grid = dl.Samples.on_grid((-3.9, 0.012, -2.9), (7.8, 0, 0), (0, 0, 5.8), 0.1)
    samples = dl.Samples(grid.points, (0, 1, 0))
    before = dl.trace(office, paths=paths, seed=1)
    modes = {mode: dl.estimate.PhotonMap(before, samples, k=K) for mode in (True, False)}
    steps = []
    for step in range(1, STEPS + 1):
        after = dl.trace(with_chair_at(office, 0.1 * step), paths=paths, seed=1)
        new = rows(after)
        start = time.process_time()
        whole = dl.estimate.photon_map(after, samples, k=K).irradiance.mean(axis=1)
        recompute = time.process_time() - start
        for requery, live in modes.items():
            old = rows(live.segments)
            gone, fresh = ~np.isin(old, new), ~np.isin(new, old)
            start = time.process_time()
            report = live.update(gone, after.select(fresh), requery=requery)
            update = time.process_time() - start
            steps.append(
                {
                    "step": step,
                    "requery": requery,
                    "segments_changed_percent": 100 * gone.mean(),
                    "requeried": report.requeried,
                    "changed": report.changed,
                    "kept": report.kept,
                    "update_in_recomputes": update / recompute,
                    **compare(live.estimate.irradiance.mean(axis=1), whole),
                }
            )
    print(json.dumps({"paths": paths, "samples": len(samples), "k": K, "steps": steps}, indent=1))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200_000)
