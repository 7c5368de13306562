# SPDX-License-Identifier: Apache-2.0
"""Pictures per pixel: error and CPU time, against Mitsuba 3 converged, and given as much time as Deltalux.

    PYTHONPATH=tests python benchmarks/peers/pictures.py office expo room.glb

Deltalux draws the whole picture on all processors. Mitsuba answers for the pixels of some tiles of it,
from half a millimetre before the surface: from the very point its rays may start behind the facets of
smooth things. "Equal time" is Mitsuba with as many paths at each pixel as it could cast at all pixels of
the picture in the CPU time of Deltalux's paths and picture. Materials are diffuse for both.

What Mitsuba's own noise hides is seen against Deltalux's light by many more rays and paths, unbiased as
far as Mitsuba can tell ("itself", at pixels of the whole picture).

OUT/NAME.jpg shows the picture, and its tiles side by side: Deltalux, Mitsuba in equal time, Mitsuba
converged.
References are kept (OUT/NAME.npz) and used again where scene, places and number of paths are the same.
Needs the PyPI package flip-evaluator (FLIP: Andersson et al. 2020, by its authors).
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import deltalux as dl
import flip_evaluator
import numpy as np
from deltalux.outputs.tone import automatic_exposure, encode_srgb, tone_map
from deltalux.rendering import MOST_RAYS, PATHS, Rendering, lit_picture, render_session
from deltalux.texels import LINEAR_OF_BYTE
from deltalux.units import photopic
from numpy.typing import NDArray
from oracles import mitsuba_reference, world
from pictured_rooms import ROOMS, named_scene
from sheets import write_sheet

FLOOR = 0.05  # of the mean: darker pixels count as that
BEFORE = 5e-4  # metres
PASSES = 16
THREADS = 2
OWN_PATHS, OWN_RAYS = 3_000_000, 2048
MOSTLY = 0.9  # of a tile's pixels show something


@dataclass(frozen=True)
class Tiles:
    """Numbers of pixels (tiles, side, side) of a picture, row by row."""

    pixels: NDArray

    @classmethod
    def chosen(cls, rendering: Rendering, count: int, side: int) -> Tiles:
        """Random ones, apart from each other, that show mostly surfaces that are no lamps."""
        width, height = rendering.size
        shown = rendering.middles(rendering.seen.hit & ~(rendering.seen.emission > 0).any(axis=1))
        rng, found = np.random.default_rng(1), list[NDArray]()
        taken = np.zeros((height, width), dtype=bool)
        for _ in range(10_000):
            y, x = rng.integers(height - side), rng.integers(width - side)
            part = np.s_[y : y + side, x : x + side]
            if len(found) == count:
                break
            if taken[part].any() or shown[part].mean() < MOSTLY:
                continue
            taken[part] = True
            found.append(np.arange(width * height).reshape(height, width)[part])
        return cls(np.array(found))


def draw(scene: dl.Scene, options: argparse.Namespace, picture: Path) -> tuple[Rendering, float]:
    """Bake paths, draw, save; the rendering and CPU seconds of both."""
    start = time.process_time()
    nowhere = dl.Samples(np.zeros((0, 3)), np.zeros((0, 3)))
    with dl.Session(scene, nowhere, paths=options.paths, gather=options.gather) as session:
        session.bake()
        rendering = render_session(session)
    seconds = time.process_time() - start
    lit_picture(rendering).save(picture)
    return rendering, seconds


def reference(scene: dl.Scene, places: tuple[NDArray, NDArray], paths: int, kept: Path) -> world.Estimate:
    """Mitsuba's irradiance at these places; from a file where it was asked before."""
    asked = {"scene": world.scene_hash(scene), "paths": paths}
    if kept.exists():
        with np.load(kept) as file:
            same = all(file[name].item() == value for name, value in asked.items())
            # Camera rays of another build may end an ulp apart.
            if same and all(
                a.shape == b.shape and np.allclose(a, b, rtol=0, atol=1e-5)
                for a, b in zip(places, (file["points"], file["normals"]), strict=True)
            ):
                return world.Estimate(file["mean"], file["standard_error"], file["seconds"].item())
    renderer = mitsuba_reference.Renderer(scene, threads=THREADS, sampler="multijitter")
    true = renderer.irradiance(*places, max(1, paths // PASSES), passes=PASSES, seed=3)
    np.savez_compressed(
        kept, **asked, points=places[0], normals=places[1],
        mean=true.mean, standard_error=true.standard_error, seconds=true.cpu_seconds,
    )  # fmt: skip
    return true


def in_equal_time(scene: dl.Scene, places: tuple[NDArray, NDArray], seconds: float) -> NDArray:
    """Mitsuba's irradiance by as many paths at each place as fit into `seconds` for each place."""
    renderer = mitsuba_reference.Renderer(scene, threads=THREADS, sampler="multijitter")
    few = 16
    renderer.passes(*places, few, passes=1, seed=1)  # what is compiled once
    start = time.process_time()
    renderer.passes(*places, few, passes=1, seed=2)
    own = (time.process_time() - start) / few
    paths = max(1, round(seconds * len(places[0]) / own))
    return renderer.passes(*places, paths, passes=1, seed=5)[0]


def by_itself(scene: dl.Scene, rendering: Rendering, count: int) -> dict[str, float]:
    """Errors at `count` pixels that show no lamp, against what many rays and paths find there."""
    width, height = rendering.size
    seen = rendering.seen
    shown = np.flatnonzero((seen.hit & ~(seen.emission > 0).any(axis=1))[: width * height])
    chosen = np.random.default_rng(1).choice(shown, count, replace=False)
    places = seen.point[chosen], seen.normal[chosen]
    nowhere = dl.Samples(np.zeros((0, 3)), np.zeros((0, 3)))
    with dl.Session(scene, nowhere, paths=OWN_PATHS, gather=OWN_RAYS // 2, seed=77) as session:
        session.bake()
        light = session.at(*places, part="indirect", rays=OWN_RAYS) + session.at(*places, part="direct")
    return errors(rendering.irradiance[chosen], world.Estimate(light, np.zeros_like(light), 0.0))


def errors(found: NDArray, true: world.Estimate) -> dict[str, float]:
    """Of irradiance: relative, quantiles of all channels together; relMSE by channels, the reference's
    own noise taken out."""
    expected = true.mean.sum(axis=1)
    floor = np.maximum(expected, FLOOR * expected.mean())
    error = np.abs(found.sum(axis=1) - expected) / floor
    least = np.maximum(true.mean, FLOOR * true.mean.mean(axis=0))
    square = ((found - true.mean) ** 2 - true.standard_error**2) / least**2
    return {
        "median": float(np.median(error)),
        "p90": float(np.quantile(error, 0.9)),
        "bias": float(found.sum() / true.mean.sum() - 1),
        "relmse": float(square.mean()),
    }


def shown(rendering: Rendering, tiles: Tiles, irradiance: NDArray, exposure: float) -> NDArray:
    """Tiles as a screen shows them: (tiles, side, side, 3) 8-bit sRGB."""
    flat = tiles.pixels.ravel()
    radiance = rendering.albedo[flat] * irradiance / np.pi + rendering.seen.emission[flat]
    colour = tone_map(radiance, exposure) * rendering.seen.hit[flat][:, None]
    return encode_srgb(colour.reshape(*tiles.pixels.shape, 3))


def flip(true: NDArray, found: NDArray) -> float:
    """Mean FLIP error of tiles."""
    pairs = (
        (LINEAR_OF_BYTE[a].astype(np.float32), LINEAR_OF_BYTE[b].astype(np.float32))
        for a, b in zip(true, found, strict=True)
    )
    return float(np.mean([flip_evaluator.evaluate(a, b, "LDR", inputsRGB=False)[1] for a, b in pairs]))


def compare(scene: dl.Scene, name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Draw, ask Mitsuba, write tiles side by side."""
    rendering, seconds = draw(scene, options, options.out / f"{name}.png")
    seen = rendering.seen
    tiles = Tiles.chosen(rendering, options.tiles, options.side)
    flat = tiles.pixels.ravel()
    hit = seen.hit[flat]
    places = seen.point[flat][hit] + BEFORE * seen.normal[flat][hit], seen.normal[flat][hit]
    true = reference(scene, places, options.reference_paths, options.out / f"{name}.npz")
    whole = int(seen.hit[: np.prod(rendering.size)].sum())
    rival = in_equal_time(scene, places, seconds / whole)

    radiance = photopic(rendering.radiance[seen.hit & ~(seen.emission > 0).any(axis=1)])
    exposure = automatic_exposure(radiance)
    pictures = []
    for values in (rendering.irradiance[flat][hit], rival, true.mean):
        everywhere = np.zeros((len(flat), 3))
        everywhere[hit] = values
        pictures.append(shown(rendering, tiles, everywhere, exposure))
    titles = ("Deltalux", "Mitsuba, equal time", "Mitsuba converged")
    drawn = dict(zip(titles, pictures, strict=True))
    write_sheet(options.out / f"{name}.jpg", options.out / f"{name}.png", tiles.pixels, drawn)
    noise = np.linalg.norm(true.standard_error, axis=1)
    floor = np.maximum(true.mean.sum(axis=1), FLOOR * true.mean.sum(axis=1).mean())
    return {
        "scene": name,
        "seconds": seconds,
        "gathered": rendering.gathered,
        "reference_noise": float(np.median(noise / floor)),
        "itself": by_itself(scene, rendering, options.pixels),
        "deltalux": errors(rendering.irradiance[flat][hit], true) | {"flip": flip(pictures[2], pictures[0])},
        "equal_time": errors(rival, true) | {"flip": flip(pictures[2], pictures[1])},
    }


def main() -> None:
    """Draw each scene and compare."""
    parser = argparse.ArgumentParser(description="Pictures per pixel against Mitsuba 3")
    parser.add_argument("scenes", nargs="+", help=f"bundled scenes, {', '.join(ROOMS)}, or files")
    parser.add_argument("--pixels", type=int, default=1000, help="that are compared with itself")
    parser.add_argument("--tiles", type=int, default=6)
    parser.add_argument("--side", type=int, default=48, help="of a tile, pixels")
    parser.add_argument("--reference-paths", type=int, default=4096, help="at each pixel of a tile")
    parser.add_argument("--paths", type=int, default=PATHS)
    parser.add_argument("--gather", type=int, default=MOST_RAYS)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/out/pictures"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for source in options.scenes:
        name = Path(source).stem
        scene = named_scene(source)
        rows.append(row := compare(scene, name, options))
        print(
            f"{name}: {row['seconds']:.0f} s of CPU, {row['gathered']:,} places gathered; "
            f"noise of the reference {row['reference_noise']:.1%}"
        )
        for who in ("itself", "deltalux", "equal_time"):
            flipped = f"  FLIP {row[who]['flip']:.4f}" if "flip" in row[who] else ""
            print(
                "  {who:10}  median {median:6.2%}  p90 {p90:6.2%}  bias {bias:+6.2%}  "
                "relMSE {relmse:.5f}{flipped}".format(who=who, flipped=flipped, **row[who]),
                flush=True,
            )
    (options.out / "pictures.json").write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
