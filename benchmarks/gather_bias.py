# SPDX-License-Identifier: Apache-2.0
"""Measures the bias of gather methods where the irradiance is known.

Prints the table of docs/explanation/gather-methods.md: a furnace, a closed cube of 2 m in which the
irradiance is the same everywhere, with a plate of 4 cm in its middle.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import deltalux as dl
import numpy as np

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "python")]
from scenes_for_tests import box, quad, wall_places  # noqa: E402

RUNS, PATHS = 32, 20_000
EXACT = np.pi / (1 - 0.5)
WALLS, PLATE, LIFT = box((-1, -1, -1), (1, 1, 1)), 0.04, 1e-3
Estimator = Callable[[dl.Segments, dl.Samples], np.ndarray]


def furnace() -> dl.Scene:
    glowing = dl.Material("glowing", (0.5,) * 3, (1.0,) * 3, "walls", two_sided=True)
    plate = quad((-PLATE / 2, 0, -PLATE / 2), (0, 0, PLATE), (PLATE, 0, 0))
    return dl.Scene([WALLS.mesh("walls", "glowing"), plate.mesh("plate", "glowing")], [glowing])


def places() -> dict[str, dl.Samples]:
    found = {name: dl.Samples(*place, radius=0.1) for name, place in wall_places(WALLS).items()}
    found["plate"] = dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=0.1)
    return found


def methods(scene: dl.Scene) -> dict[str, Estimator]:
    def mapped(**options: object) -> Estimator:
        return lambda segments, samples: dl.estimate.photon_map(segments, samples, **options).irradiance

    def fitted(segments: dl.Segments, samples: dl.Samples) -> np.ndarray:
        return dl.estimate.local_linear(segments, samples, scene).irradiance

    def discs(segments: dl.Segments, samples: dl.Samples) -> np.ndarray:
        lifted = dl.Samples(samples.points + LIFT * samples.normals, samples.normals, samples.radius)
        return dl.estimate.disc_index(segments, lifted, segment_end="first").irradiance

    real = {"area": "surface", "scene": scene}
    return {
        "photon map": mapped(),
        "photon map, plain form": mapped(unbiased=False),
        "photon map, plain form, k = 10": mapped(unbiased=False, k=10),
        "photon map, cone": mapped(kernel="cone"),
        "photon map, Epanechnikov": mapped(kernel="epanechnikov"),
        "photon map, compression 20": mapped(compression=20),
        "photon map, surface area": mapped(**real),
        "photon map, surface area, cone": mapped(**real, kernel="cone"),
        "photon map, surface area, Epanechnikov": mapped(**real, kernel="epanechnikov"),
        "local linear": fitted,
        "whole discs of 10 cm, first hit": discs,
    }


def main() -> None:
    scene, at = furnace(), places()
    traced = [dl.trace(scene, paths=PATHS, seed=seed) for seed in range(RUNS)]
    print("| method | " + " | ".join(at) + " |\n| --- |" + " ---: |" * len(at))
    for name, method in methods(scene).items():
        cells = []
        for samples in at.values():
            values = np.stack([method(segments, samples)[:, 0] for segments in traced]) / EXACT - 1
            means = 100 * values.mean(axis=1)
            cells.append(f"{means.mean():+.1f} ± {means.std(ddof=1) / np.sqrt(RUNS):.1f}")
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
