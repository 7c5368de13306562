# SPDX-License-Identifier: Apache-2.0
"""What textures cost: a scene with one on every surface, against the same scene without.

    PYTHONPATH=python python benchmarks/textures.py atrium
    PYTHONPATH=python python benchmarks/textures.py office --bake

Every material gets an image of its own, of its mean reflectance. Rates of tracing are differences of two path
counts, the best of several turns, with one thread; with --bake, processor seconds and memory of a bake by
default options follow. Writes benchmarks/out/textures.json.
"""

from __future__ import annotations

import argparse
import io
import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux.scene import replace_scene
from deltalux.scene.look import Look, Texture
from deltalux.texels import LINEAR_OF_BYTE
from edited_rooms import room_named
from PIL import Image

OUT = Path(__file__).resolve().parent / "out" / "textures.json"
PER_METRE = 0.5  # repetitions of an image
TURNS = 7


def image(rng: np.random.Generator, size: int) -> Texture:
    """Clouds of grain in three channels, compressed as photographs are."""
    clouds = Image.fromarray(rng.integers(0, 256, (size // 16, size // 16, 3), dtype=np.uint8))
    smooth = np.asarray(clouds.resize((size, size), Image.Resampling.BICUBIC)).astype(int)
    texels = np.clip(64 + smooth // 2 + rng.integers(-20, 20, smooth.shape), 0, 255).astype(np.uint8)
    stream = io.BytesIO()
    Image.fromarray(texels).save(stream, "JPEG", quality=95)
    texels = np.asarray(Image.open(stream))
    return Texture(stream.getvalue(), LINEAR_OF_BYTE[texels].reshape(-1, 3).mean(axis=0))


def coordinates(mesh: dl.Mesh) -> np.ndarray:
    """Texture coordinates of a mesh's corners: the two axes along which a triangle extends most."""
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axes = np.argsort(np.abs(normals), axis=1, kind="stable")[:, None, :2]
    return (PER_METRE * np.take_along_axis(corners, axes, axis=2)).astype(np.float32)


def textured(scene: dl.Scene, size: int) -> dl.Scene:
    """The scene with an image of `size` x `size` texels on every material."""
    rng = np.random.default_rng(0)
    materials = [replace(m, look=Look(image(rng, size))) for m in scene.materials]
    meshes = [replace(mesh, coordinates=coordinates(mesh)) for mesh in scene.meshes]
    return replace_scene(scene, materials=materials, meshes=meshes)


def traced(scene: dl.Scene, paths: int) -> tuple[float, int]:
    """Processor seconds of tracing, and the number of segments."""
    start = time.process_time()
    segments = dl.trace(scene, paths, threads=1)
    return time.process_time() - start, len(segments.length)


def rates(scenes: list[dl.Scene], paths: int) -> list[float]:
    """Segments per second of each, without what a scene costs once."""
    best = {(i, count): (np.inf, 0) for i in range(len(scenes)) for count in (paths // 4, paths)}
    for _ in range(TURNS):
        for i, count in best:
            best[i, count] = min(best[i, count], traced(scenes[i], count))
    found = []
    for i in range(len(scenes)):
        few, many = best[i, paths // 4], best[i, paths]
        found.append((many[1] - few[1]) / (many[0] - few[0]))
    return found


def baked(source: str, size: int) -> dict[str, float]:
    """Processor seconds and peak memory (MiB) of a bake in its own process; `size` 0: without textures."""
    here = str(Path(__file__).resolve().parent)
    code = (
        f"import sys; sys.path.insert(0, {here!r}); import textures; print(textures.bake({source!r}, {size}))"
    )
    line = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    seconds, mebibytes = line.split()
    return {"seconds": float(seconds), "mebibytes": float(mebibytes)}


def bake(source: str, size: int) -> str:
    """The same in this process, as text."""
    scene = room_named(source)
    if size:
        scene = textured(scene, size)
    start = time.process_time()
    with dl.Session(scene) as session:
        session.bake()
        seconds = time.process_time() - start
        peak = int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0])  # KiB
    return f"{seconds} {peak / 1024}"


def main() -> int:
    """Measure the scenes named on the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sources", nargs="+", help="scenes: files, or names of bundled ones")
    parser.add_argument("--size", type=int, default=1024, help="texels along a side of each image")
    parser.add_argument("--paths", type=int, default=1_600_000, help="light paths")
    parser.add_argument("--bake", action="store_true", help="bake, too")
    given = parser.parse_args()
    found: dict[str, Any] = {}
    for source in given.sources:
        plain = room_named(source)
        speeds = rates([plain, textured(plain, given.size)], given.paths)
        found[source] = {"segments per second": speeds, "share": speeds[1] / speeds[0]}
        print(f"{source}: tracing at {speeds[1] / speeds[0]:.2f} of the rate without textures", flush=True)
        if given.bake:
            bakes = [baked(source, size) for size in (0, given.size)]
            found[source]["bakes"] = bakes
            share = {key: bakes[1][key] / bakes[0][key] for key in bakes[0]}
            print(
                f"{source}: bake {share['seconds']:.2f} of the time, {share['mebibytes']:.2f} of the memory"
            )
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps(found, indent=2))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
