# SPDX-License-Identifier: Apache-2.0
"""The display mesh as pages draw it: vertices are repeated where texture coordinates differ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.outputs.texture_coordinates import TextureCoordinates, by_mesh, split_at_seams
from deltalux.scene import Scene

NONE = np.float32(-1e30)  # coordinates where no texture is shown
MOST = 1e9  # larger ones have no fraction that would say where in the image they are


@dataclass(frozen=True, eq=False)
class DrawnMesh:
    """Vertices and triangles in the numbering that pages have.

    Parameters
    ----------
    vertices : (n,) int64, ascending, or None
        Vertex of the display mesh of each; None = the display mesh's own.
    triangles : (m, 3) vertices of this mesh, in the order of the display mesh
    coordinates : (n, 2) float32, (0, 2) if no texture is shown
    """

    vertices: np.ndarray | None
    triangles: np.ndarray
    coordinates: np.ndarray

    def at(self, values: np.ndarray) -> np.ndarray:
        """Values of this mesh's vertices from those (v, …) of the display mesh."""
        return values if self.vertices is None else values[self.vertices]

    @property
    def copies(self) -> np.ndarray:
        """(c,) int64, ascending: vertices that repeat the one before them."""
        if self.vertices is None:
            return np.zeros(0, np.int64)
        return np.flatnonzero(np.diff(self.vertices) == 0) + 1

    def detail(self, display: DisplayMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The display mesh's `detail` (d,), and its `detail_in_plain`, as vertices of this mesh."""
        corners, weights = display.detail_in_plain()
        detail = np.zeros(0, np.int64) if display.detail is None else display.detail
        if self.vertices is None or not len(detail):
            return detail, corners, weights
        at = np.minimum(np.searchsorted(detail, self.vertices), len(detail) - 1)
        own = np.flatnonzero(detail[at] == self.vertices)
        return own, np.searchsorted(self.vertices, corners[at[own]]), weights[at[own]]


def drawn_mesh(scene: Scene, display: DisplayMesh) -> DrawnMesh:
    """The drawn mesh of a display mesh of `scene`."""
    textured = np.array([bool(m.look.textures) for m in scene.materials], bool)
    mapped = np.array([mesh.coordinates is not None for mesh in scene.meshes], bool)
    shown = np.flatnonzero(textured[display.triangle_material] & mapped[display.triangle_mesh])
    if not len(shown):
        return DrawnMesh(None, display.triangles, np.zeros((0, 2), np.float32))
    coordinates = np.full((len(display.triangles), 3, 2), NONE)
    source = TextureCoordinates(scene, display)
    for rows in by_mesh(shown, display.triangle_mesh[shown]):
        coordinates[rows] = source.of(rows)
    unknown = ~(np.abs(coordinates) <= MOST).all(axis=(1, 2))
    coordinates[unknown] = NONE
    vertices, own, triangles = split_at_seams(display.triangles, coordinates)
    same = np.array_equal(vertices, np.arange(len(display.points)))
    return DrawnMesh(None if same else vertices, triangles, own)
