# SPDX-License-Identifier: Apache-2.0
"""Cuts polygons of any shape into triangles. This is the only file that uses mapbox_earcut."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import mapbox_earcut
import numpy as np

Point = tuple[float, float, float]

# Largest relative difference of the areas of polygon and triangles; rounding alone gives 1e-12.
_OVERLAP = 1e-6


def fan(count: int) -> list[int]:
    """Corners of the triangles in a fan about the first corner of a polygon of `count` corners."""
    return [corner for i in range(1, count - 1) for corner in (0, i, i + 1)]


def cut(points: Sequence[Point]) -> tuple[list[int], bool]:
    """Triangles that cover a polygon once, with its winding.

    Parameters
    ----------
    points : corners in order, three or more; approximately in one plane

    Returns
    -------
    positions in `points`, three for each triangle; corners within a straight edge may be left out
    whether they cover it exactly once; False if it crosses itself
    """
    if len(points) == 3 or _is_fan(points):
        return fan(len(points)), True
    flat = _projected(np.array(points))
    if flat is None:
        return fan(len(points)), False
    ends = np.array([len(flat)], np.uint32)
    triangles = mapbox_earcut.triangulate_float64(flat, ends).reshape(-1, 3).astype(np.int64)
    if not len(triangles):  # the polygon is thinner than rounding errors
        return fan(len(points)), True
    x, y = flat.T
    whole = (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    covered = float(np.abs(_areas(flat[triangles])).sum())
    return triangles.ravel().tolist(), abs(covered - whole) <= _OVERLAP * whole


def _is_fan(points: Sequence[Point]) -> bool:
    """Whether all triangles of the fan about the first corner, except empty ones, face as the polygon does.

    In plain Python, which is faster than NumPy for the usual four corners.
    """
    ox, oy, oz = points[0]
    edges = [(x - ox, y - oy, z - oz) for x, y, z in points[1:]]
    normals = [
        (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
        for (ax, ay, az), (bx, by, bz) in pairwise(edges)
    ]
    nx, ny, nz = (sum(axis) for axis in zip(*normals, strict=True))
    return all(x * nx + y * ny + z * nz > 0 or (x, y, z) == (0, 0, 0) for x, y, z in normals)


def _projected(points: np.ndarray) -> np.ndarray | None:
    """(n, 2) coordinates in the plane of the polygon, counter-clockwise, of magnitude up to about 1.

    None if the areas of its parts cancel out, so that it has no front.
    """
    edges = points[1:] - points[0]
    edges = np.concatenate([np.zeros((1, 3)), edges / np.abs(edges).max()])
    normal = np.cross(edges[:-1], edges[1:]).sum(axis=0)
    length = np.linalg.norm(normal)
    if length == 0:
        return None
    normal = normal / length
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    return np.ascontiguousarray(np.stack([edges @ across, edges @ np.cross(normal, across)], axis=1))


def _areas(corners: np.ndarray) -> np.ndarray:
    """Signed areas of (m, 3, 2) triangles."""
    (ax, ay), (bx, by) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    return (ax * by - ay * bx) / 2
