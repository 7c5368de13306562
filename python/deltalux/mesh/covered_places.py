# SPDX-License-Identifier: Apache-2.0
"""Finds places that are covered by other surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from deltalux import _core

LIFT = 1e-3  # as a share of the spacing: height above the surface where rays start
CONTACT = 0.1  # as a share of the spacing: a gap this narrow counts as closed


class Cover:
    """Surfaces that may cover others.

    Parameters
    ----------
    layers : ray casters: one of triangles that are counter-clockwise on a side that light may reach, and, if
        needed, one of triangles in the same places with the opposite winding
    origin : (3,), of the casters' coordinates
    spacing : metres, of samples there
    """

    def __init__(self, layers: Sequence[Any], origin: np.ndarray, spacing: float) -> None:
        self._layers = layers
        self._origin = origin
        self._spacing = spacing

    @classmethod
    def of(cls, vertices: np.ndarray, triangles: np.ndarray, second: np.ndarray, spacing: float) -> Cover:
        """Cover by triangles (m, 3); `second` (m,) marks those of the second layer."""
        used = vertices[triangles.ravel()]
        origin = 0.5 * (used.min(axis=0) + used.max(axis=0)) if len(used) else np.zeros(3)
        local = (vertices - origin).astype(np.float32)
        layers = [triangles[chosen].astype(np.uint32) for chosen in (~second, second) if chosen.any()]
        return cls([_core.RayCaster(local, layer) for layer in layers], origin, spacing)

    def covers(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Find places under a bookcase, behind a frame, inside a column.

        Parameters
        ----------
        points, normals : (n, 3) of surfaces

        Returns
        -------
        (n,) bool: nearly every ray hits a surface nearby, or hits one from behind.
        """
        if not self._layers:
            return np.zeros(len(points), dtype=bool)
        lifted = points + LIFT * self._spacing * normals - self._origin
        front, *behind = self._layers
        covered = front.covered(
            lifted.astype(np.float32), normals.astype(np.float32), CONTACT * self._spacing, *behind
        )
        return np.asarray(covered).astype(bool)
