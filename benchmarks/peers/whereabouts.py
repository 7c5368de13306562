# SPDX-License-Identifier: Apache-2.0
"""Which surface a point lies on, and what is near it."""

from __future__ import annotations

import numpy as np
from deltalux.scene import Scene
from oracles import world

NEARBY = 3  # further meshes that are named


def what_lies_there(scene: Scene, point: np.ndarray) -> str:
    """The mesh and material that the point lies on, and the nearest others with their distances."""
    found: dict[str, tuple[float, str]] = {}
    for part in world.parts(scene):
        distance = float(_distances(part.corners, point).min())
        if distance < found.get(part.mesh, (np.inf, ""))[0]:
            found[part.mesh] = (distance, part.material.name)
    (own, (_, material)), *others = sorted(found.items(), key=lambda item: item[1])
    near = ", ".join(f"{name} {distance:.3g} m" for name, (distance, _) in others[:NEARBY])
    return f"{own} ({material}); {near}"


def _distances(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(n,) distances from triangles (n, 3, 3) to a point: within the triangle, or to its edges."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    height = ((point - corners[:, 0]) * normals).sum(axis=1)
    inside = np.full(len(corners), True)
    edges = np.full(len(corners), np.inf)
    for k in range(3):
        start, side = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        way = point - start
        inside &= (np.cross(side, way) * normals).sum(axis=1) >= 0
        along = np.clip((way * side).sum(axis=1) / (side**2).sum(axis=1), 0, 1)
        edges = np.minimum(edges, np.linalg.norm(way - along[:, None] * side, axis=1))
    return np.where(inside, np.abs(height), edges)
