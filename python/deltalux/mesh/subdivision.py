# SPDX-License-Identifier: Apache-2.0
"""Crack-free subdivision of triangles: edges longer than a limit are halved, by their end points alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux import _core

# An edge whose length is the limit but for rounding must not be split on one side only,
# where two meshes reach the same end points through different poses.
LENGTH_TOLERANCE = 1e-6


class TooManyPoints(Exception):
    """The subdivision would pass the given number of points."""


def split_long_edges(
    points: np.ndarray, triangles: np.ndarray, limit: float, max_points: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Halve edges until none is longer than `limit`.

    Whether and where an edge is cut depends on its two end points only, so that triangles on
    both sides of it agree, also when they belong to different meshes with equal end points.

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
    source : (m',) int64, the given triangle that each comes from

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
    """How many points `split_long_edges` would add to the given ones.

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
    """Replace each triangle by two, three or four, by the number of its marked edges.

    Parameters
    ----------
    points : (n, 3)
    triangles : (m, 3)
    source : (m,) numbers that the parts keep
    marked : (m, 3) bool, at least one edge (corner k to k + 1) of each triangle
    middle : (m, 3), the point on each marked edge

    Returns
    -------
    Triangles and their `source`, in no particular order.
    """
    parts, of = _core.split_marked(points, triangles, source, marked, middle)
    return parts, of
