# SPDX-License-Identifier: Apache-2.0
"""Vectors of any length that float64 can represent, angles down to the smallest, and triangles."""

from __future__ import annotations

import numpy as np

from . import _core

# as a share of half the largest extent: differences that count as rounding; numbers then have 21 bits
PLACE = 1.05 * 2.0**-20
# squares of lengths between 1 / SAFE and SAFE are within the range of float64
SAFE = 1e150


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors along the last axis, scaled to length 1; zero vectors stay zero.

    Applying it again changes no bit.
    """
    largest = np.abs(vectors).max(axis=-1, keepdims=True, initial=0.0)
    odd = (largest > SAFE) | (largest < 1 / SAFE)
    scaled = np.divide(vectors, largest, out=vectors.copy(), where=odd & (largest > 0))
    lengths = np.linalg.norm(scaled, axis=-1, keepdims=True)
    rough = (lengths > 0) & (np.abs(lengths - 1) > 4 * np.finfo(np.float64).eps)
    return np.divide(scaled, lengths, out=scaled, where=rough)


def same_places(points: np.ndarray) -> np.ndarray:
    """(n,) for each point (n, 3) the number of the first point in the same place, apart from rounding."""
    return np.asarray(_core.same_places(points, PLACE))


def normals_by_area(corners: np.ndarray) -> np.ndarray:
    """(m, 3) normals of triangles (m, 3 corners, 3); their length is twice the triangle's area."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def triangle_areas(corners: np.ndarray) -> np.ndarray:
    """(m,) areas of triangles (m, 3 corners, 3)."""
    return 0.5 * np.linalg.norm(normals_by_area(corners), axis=1)


def barycentric(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(m, 3) weights, their sum 1, by which corners (m, 3, 3) of triangles make up points (m, 3) in them."""
    normals = normals_by_area(corners)
    parts = [corners.copy() for _ in range(3)]
    for corner, part in enumerate(parts):
        part[:, corner] = points
    shares = np.stack([np.einsum("ij,ij->i", normals_by_area(part), normals) for part in parts], axis=1)
    shares = np.maximum(shares, 0.0)  # rounding may put a point on an edge outside
    return shares / shares.sum(axis=1, keepdims=True)


def versine(angle: float) -> float:
    """1 - cos(angle), accurate for narrow cones, too."""
    return float(2 * np.sin(angle / 2) ** 2)
