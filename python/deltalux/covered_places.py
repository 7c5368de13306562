# SPDX-License-Identifier: Apache-2.0
"""Places that nothing can reach, because something stands on them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

DIRECTIONS = 12
NEEDED = 3  # rays that must be free; where two boxes touch, one may seem so
LIFT = 1e-3  # of the spacing; where a ray leaves the surface
CONTACT = 0.1  # of the spacing; a gap this narrow counts as closed

IsOpen = Callable[[np.ndarray, np.ndarray, float], np.ndarray]


def covered_places(points: np.ndarray, normals: np.ndarray, spacing: float, is_open: IsOpen) -> np.ndarray:
    """Find places under a bookcase, behind a frame, inside a column.

    Parameters
    ----------
    points, normals : (n, 3) of surfaces
    spacing : metres, of samples there
    is_open : for rays (origins (k, 3), directions (k, 3)) whether each (k,) meets nothing, or a side that
        light may reach, farther than a distance

    Returns
    -------
    (n,) bool: nearly every ray soon meets something, or meets it from behind.
    """
    tangent = np.cross(normals, np.where(np.abs(normals[:, :1]) < 0.7, [1.0, 0, 0], [0, 1.0, 0]))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    bitangent = np.cross(normals, tangent)
    origins = points + LIFT * spacing * normals
    open_rays = np.zeros(len(points), dtype=np.int64)
    for index in range(DIRECTIONS):
        left = np.flatnonzero(open_rays < NEEDED)
        share, turn = (index + 0.5) / DIRECTIONS, 2.399963 * index  # the golden angle
        across, up = np.sqrt(share), np.sqrt(1 - share)
        direction = (
            across * (np.cos(turn) * tangent[left] + np.sin(turn) * bitangent[left]) + up * normals[left]
        )
        open_rays[left] += is_open(origins[left], direction, CONTACT * spacing)
    return open_rays < NEEDED
