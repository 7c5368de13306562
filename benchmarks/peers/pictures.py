# SPDX-License-Identifier: Apache-2.0
"""Pictures per pixel: CPU time and error of irradiance at pixels, against Mitsuba 3.

    PYTHONPATH=tests python benchmarks/peers/pictures.py office expo room.glb

Deltalux draws the whole picture on all processors; Mitsuba answers at some of its pixels, from half a
millimetre before the surface: from the very point its rays may start behind the facets of smooth things.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux.rendering import lit_picture, render_session
from numpy.typing import NDArray
from oracles import mitsuba_reference, world

FLOOR = 0.05  # of the mean: darker pixels count as that
BEFORE = 5e-4  # metres
PASSES = 16


def draw(scene: dl.Scene, options: argparse.Namespace, picture: Path) -> tuple[Any, float]:
    """Bake paths, draw, save; the rendering and CPU seconds of both."""
    start = time.process_time()
    nowhere = dl.Samples(np.zeros((0, 3)), np.zeros((0, 3)))
    with dl.Session(scene, nowhere, paths=options.paths, gather=options.gather) as session:
        session.bake()
        rendering = render_session(session)
    seconds = time.process_time() - start
    lit_picture(rendering).save(picture)
    return rendering, seconds


def reference(scene: dl.Scene, seen: Any, paths: int) -> world.Estimate:
    """Mitsuba's irradiance at these places."""
    renderer = mitsuba_reference.Renderer(scene, sampler="multijitter")
    points = seen.point + BEFORE * seen.normal
    return renderer.irradiance(points, seen.normal, max(1, paths // PASSES), passes=PASSES, seed=3)


def row(name: str, found: NDArray, true: world.Estimate, seconds: float) -> dict[str, Any]:
    """Quantiles of the relative error, all channels together."""
    expected = true.mean.sum(axis=1)
    floor = np.maximum(expected, FLOOR * expected.mean())
    error = np.abs(found.sum(axis=1) - expected) / floor
    noise = np.linalg.norm(true.standard_error, axis=1) / floor
    return {
        "scene": name,
        "seconds": seconds,
        "median": float(np.median(error)),
        "p90": float(np.quantile(error, 0.9)),
        "bias": float(found.sum() / true.mean.sum() - 1),
        "reference_noise": float(np.median(noise)),
        "reference_seconds": true.cpu_seconds,
    }


def main() -> None:
    """Draw each scene and compare."""
    parser = argparse.ArgumentParser(description="Pictures per pixel against Mitsuba 3")
    parser.add_argument("scenes", nargs="+", help="bundled scenes or files")
    parser.add_argument("--pixels", type=int, default=2000)
    parser.add_argument("--reference-paths", type=int, default=16384)
    parser.add_argument("--paths", type=int, default=200_000)
    parser.add_argument("--gather", type=int, default=128)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/out/pictures"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for source in options.scenes:
        name = Path(source).stem
        scene = dl.load(source) if "." in source else getattr(dl.scenes, source)()
        rendering, seconds = draw(scene, options, options.out / f"{name}.png")
        middles = np.flatnonzero(rendering.seen.hit[: rendering.size[0] * rendering.size[1]])
        chosen = np.random.default_rng(1).choice(middles, min(options.pixels, len(middles)), replace=False)
        true = reference(scene, rendering.seen.at(chosen), options.reference_paths)
        rows.append(row(name, rendering.irradiance[chosen], true, seconds))
        print(
            "{scene}: {seconds:.1f} s of CPU, median {median:.2%}, p90 {p90:.2%}, bias {bias:+.2%}; "
            "noise of the reference {reference_noise:.2%}".format(**rows[-1]),
            flush=True,
        )
    (options.out / "pictures.json").write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
