# SPDX-License-Identifier: Apache-2.0
"""Radiosity of a convex room by exact form factors: a reference without random numbers, discs or rays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from oracles.closed_forms import polygon_factor

Array = NDArray[np.float64]
Direct = Callable[[Array, Array], Array]


class ConvexRoom:
    """Rectangles that see each other wholly, cut into patches of constant radiosity.

    Parameters
    ----------
    rectangles : list of (corner, u, v), each (3,); the front shows u x v
    reflectance : of all of them
    direct : (points, normals) -> (n,) direct irradiance
    cells : patches along each side
    """

    def __init__(
        self,
        rectangles: list[tuple[Array, Array, Array]],
        reflectance: float,
        direct: Direct,
        cells: int,
    ) -> None:
        self._direct = direct
        self._patches = np.concatenate([_cut(*r, cells) for r in rectangles])
        centres = self._patches.mean(axis=1)
        normals = np.cross(
            self._patches[:, 1] - self._patches[:, 0], self._patches[:, 3] - self._patches[:, 0]
        )
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        factors = self._factors(centres, normals)
        system = np.eye(len(centres)) - reflectance * factors
        self._radiosity = np.linalg.solve(system, reflectance * direct(centres, normals))

    def _factors(self, points: Array, normals: Array) -> Array:
        return np.stack([polygon_factor(points, normals, patch) for patch in self._patches], axis=1)

    def irradiance(self, points: Array, normals: Array) -> Array:
        """(n,) direct and reflected irradiance."""
        return self._direct(points, normals) + self._factors(points, normals) @ self._radiosity


def _cut(corner: Array, u: Array, v: Array, cells: int) -> Array:
    """(cells^2, 4, 3) equal parts of a parallelogram."""
    a, b = (grid.ravel()[:, None] for grid in np.meshgrid(np.arange(cells), np.arange(cells)))
    along_u, along_v = (a + np.array([0, 1, 1, 0])) / cells, (b + np.array([0, 0, 1, 1])) / cells
    return corner + along_u[..., None] * u + along_v[..., None] * v
