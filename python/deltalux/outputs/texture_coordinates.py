# SPDX-License-Identifier: Apache-2.0
"""Texture coordinates of the refined triangles, interpolated from the scene's triangles."""

from __future__ import annotations

import numpy as np

from deltalux.mesh.display_mesh import DisplayMesh, weld
from deltalux.scene import Scene

BATCH = 1 << 17  # triangles at a time, to bound memory
# Refinement halves edges, so that weights are multiples of this, and neighbours agree to the last bit.
WEIGHT_STEP = 2.0**-20


class TextureCoordinates:
    """Computes texture coordinates at the corners of display triangles.

    Parameters
    ----------
    scene : Scene
    display : display mesh of the scene
    """

    def __init__(self, scene: Scene, display: DisplayMesh) -> None:
        self._scene, self._display = scene, display
        self._has = np.array([mesh.coordinates is not None for mesh in scene.meshes], bool)
        if self._has.any():
            representative, self._corners = weld(scene)
            points = [m.vertices if m.movable else m.world_vertices for m in scene.meshes]
            self._points = np.concatenate(points)[representative]
            self._first = np.cumsum([0, *(len(mesh.triangles) for mesh in scene.meshes[:-1])])

    def of(self, triangles: np.ndarray) -> np.ndarray:
        """(k, 3, 2) float32 for the corners of the display's `triangles` (k,), of one mesh; NaN = none."""
        mesh = self._display.triangle_mesh[triangles[:1]]
        if not self._has[mesh].any():
            return np.full((len(triangles), 3, 2), np.nan, np.float32)
        batches = [triangles[i : i + BATCH] for i in range(0, len(triangles), BATCH)]
        return np.concatenate([self._interpolated(batch, int(mesh[0])) for batch in batches])

    def _interpolated(self, triangles: np.ndarray, mesh: int) -> np.ndarray:
        source = self._display.source_triangle[triangles]
        a, b, c = np.moveaxis(self._points[self._corners[self._first[mesh] + source]], 1, 0)
        at = self._display.points[self._display.triangles[triangles]] - a[:, None]
        ab, ac = b - a, c - a
        normal = np.cross(ab, ac)
        squared = np.einsum("kx,kx->k", normal, normal)[:, None]
        # A degenerate triangle has the coordinates of its first corner.
        normal = np.divide(normal, squared, out=np.zeros_like(normal), where=squared > 0)
        weight_b = np.einsum("kix,kx->ki", np.cross(at, ac[:, None]), normal)
        weight_c = np.einsum("kix,kx->ki", np.cross(ab[:, None], at), normal)
        weights = np.stack([1 - weight_b - weight_c, weight_b, weight_c], axis=-1)
        weights = np.rint(weights / WEIGHT_STEP) * WEIGHT_STEP
        corners = self._scene.meshes[mesh].coordinates[source].astype(np.float64)
        return np.einsum("kiw,kwx->kix", weights, corners).astype(np.float32)


def by_mesh(triangles: np.ndarray, mesh: np.ndarray) -> list[np.ndarray]:
    """The `triangles` (k,), divided by their `mesh` (k,)."""
    order = np.argsort(mesh, kind="stable")
    ends = np.flatnonzero(np.diff(mesh[order])) + 1
    return np.split(triangles[order], ends) if len(triangles) else []


def split_at_seams(
    vertices: np.ndarray, coordinates: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Duplicate vertices so that each has only one texture coordinate.

    Parameters
    ----------
    vertices : (k, 3) numbers of the corners' vertices
    coordinates : (k, 3, 2) float32, finite

    Returns
    -------
    used : (n,) numbers of the original vertices, each repeated for every different coordinate
    texels : (n, 2) float32, texture coordinates of these
    corners : (k, 3) index into both
    """
    texels = np.ascontiguousarray(coordinates.reshape(-1, 2) + np.float32(0))  # -0 becomes 0
    values, number = np.unique(texels.view(np.int64)[:, 0], return_inverse=True)
    keys, first, corners = np.unique(
        vertices.ravel() * len(values) + number, return_index=True, return_inverse=True
    )
    return keys // len(values), texels[first], corners.reshape(-1, 3)
