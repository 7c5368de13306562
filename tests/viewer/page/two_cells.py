# SPDX-License-Identifier: Apache-2.0
"""Two cells side by side, open to the front: light of one never reaches the other."""

from __future__ import annotations

import deltalux as dl
import numpy as np
from rooms import box, translation

SPACING = 0.2  # some 4,000 samples
PATHS = 400_000


def two_cells() -> dl.Scene:
    """Each cell with a lamp and something movable; the camera looks in from the front."""
    meshes = []
    for side, name, movable in ((-1, "left", "crate"), (1, "right", "post")):
        vertices, triangles = box((2.0, 2.0, 2.0), (1.05 * side, 1.0, 0.0), inward=True)
        is_front = (vertices[triangles][:, :, 2] > 0.99).all(axis=1)
        meshes.append(dl.Mesh(f"{name} cell", vertices, triangles[~is_front], "plaster"))
        lamp = box((0.6, 0.02, 0.6), (1.05 * side, 1.97, 0.0))
        meshes.append(dl.Mesh(f"{name} lamp", *lamp, f"{name} glow"))
        size = (0.5, 0.5, 0.5) if movable == "crate" else (0.2, 1.0, 0.2)
        pose = translation(1.05 * side, 0.001, 0.1)
        standing = box(size, (0.0, size[1] / 2, 0.0))
        meshes.append(dl.Mesh(movable, *standing, "oak", pose=pose, movable=True))
    materials = [dl.Material("plaster", (0.7, 0.68, 0.65)), dl.Material("oak", (0.5, 0.35, 0.2))]
    for name in ("left", "right"):
        materials.append(dl.Material(f"{name} glow", (0, 0, 0), emission=(900, 800, 700), group=name))
    camera = dl.scene.Camera("front", translation(0.0, 1.1, 4.3), np.radians(35))
    return dl.Scene(meshes, materials, unit="lux", cameras=[camera])


def make_session(paths: int = PATHS, detail: float | None = None) -> dl.Session:
    """A session of the cells without light."""
    scene = two_cells()
    samples = dl.Samples.on_vertices(scene, spacing=SPACING, detail=detail)
    return dl.Session(scene, samples, paths=paths, gather=256, threads=2)
