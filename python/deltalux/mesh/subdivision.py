# SPDX-License-Identifier: Apache-2.0
"""Crack-free subdivision of triangles: halves edges longer than a limit, judging by their end points only."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux import _core

# An edge whose length is the limit but for rounding must not be split on one side only,
# where two meshes reach the same end points through different poses.
LENGTH_TOLERANCE = 1e-6


class TooManyPoints(Exception):
    """The subdivision would exceed the given number of points."""


def split_long_edges(
    points: np.ndarray, triangles: np.ndarray, limit: float, max_points: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Halve edges until none is longer than `limit`.

    Whether and where an edge is cut depends only on its two end points, so that the triangles on
    both sides agree, even if they belong to different meshes with equal end points.

    Parameters
    ----------
    points : (n, 3) float64, shared by the triangles that meet there
    triangles : (m, 3) int64
    limit : float, metres
    max_points : int

    Returns
    -------
    points : (n + k, 3), the given ones first
    triangles : (m', 3), in the order of the triangles that they come from, winding kept
    source : (m',) int64, the original triangle of each

    Raises
    ------
    TooManyPoints
    """
    split: Any = _core.split_long_edges(points, triangles, _squared_limit(limit), max_points)
    if split is None:
        raise TooManyPoints
    added, parts, source = split
    return np.concatenate([points, added]), parts, source


def count_halved_edges(points: np.ndarray, triangles: np.ndarray, limit: float, max_points: int) -> int:
    """Number of points that `split_long_edges` would add.

    Raises
    ------
    TooManyPoints
    """
    count = _core.count_halved_edges(points, triangles, _squared_limit(limit), max_points)
    if count is None:
        raise TooManyPoints
    return count


def _squared_limit(limit: float) -> float:
    return (limit * (1 + LENGTH_TOLERANCE)) ** 2


def split_marked(
    points: np.ndarray, triangles: np.ndarray, source: np.ndarray, marked: np.ndarray, middle: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Replace each triangle by two, three or four, depending on its number of marked edges.

    Parameters
    ----------
    points : (n, 3)
    triangles : (m, 3)
    source : (m,) numbers that the parts inherit
    marked : (m, 3) bool, edges (corner k to k + 1) to split; at least one of each triangle
    middle : (m, 3), the point on each marked edge

    Returns
    -------
    Triangles and their `source`, in no particular order.
    """
    parts, of = _core.split_marked(points, triangles, source, marked, middle)
    return parts, of
