# SPDX-License-Identifier: Apache-2.0
"""Crack-free subdivision of triangles: edges longer than a limit are halved, by their end points alone."""

from __future__ import annotations

import numpy as np

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
    squared_limit = (limit * (1 + LENGTH_TOLERANCE)) ** 2
    active, source = triangles, np.arange(len(triangles))
    finished: list[tuple[np.ndarray, np.ndarray]] = []
    while len(active):
        vectors = points[active[:, (1, 2, 0)]] - points[active]
        marked = np.einsum("tkc,tkc->tk", vectors, vectors) > squared_limit
        # A triangle without a long edge is final: none of its edges is ever cut later.
        final = ~marked.any(axis=1)
        finished.append((active[final], source[final]))
        active, source, marked = active[~final], source[~final], marked[~final]
        points, middle = _halve(points, active, marked, max_points)
        active, source = split_marked(points, active, source, marked, middle)
    all_triangles = np.concatenate([t for t, _ in finished]) if finished else triangles
    all_sources = np.concatenate([s for _, s in finished]) if finished else source
    order = np.argsort(all_sources, kind="stable")
    return points, all_triangles[order], all_sources[order]


def _halve(
    points: np.ndarray, triangles: np.ndarray, marked: np.ndarray, max_points: int
) -> tuple[np.ndarray, np.ndarray]:
    """Append the midpoints of the marked edges; return their indices per triangle edge (-1 = unmarked)."""
    ends = np.stack([triangles, triangles[:, (1, 2, 0)]], axis=-1)[marked]
    ends.sort(axis=1)
    keys, position = np.unique(ends[:, 0] * len(points) + ends[:, 1], return_inverse=True)
    if len(points) + len(keys) > max_points:
        raise TooManyPoints
    low, high = np.divmod(keys, len(points))
    middle = np.full(triangles.shape, -1, dtype=np.int64)
    middle[marked] = len(points) + position
    return np.concatenate([points, 0.5 * (points[low] + points[high])]), middle


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
    count = marked.sum(axis=1)
    pieces: list[np.ndarray] = []
    sources: list[np.ndarray] = []

    def add(chosen: np.ndarray, *parts: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
        for part in parts:
            pieces.append(np.stack(part, axis=1))
            sources.append(chosen)

    # Turned so that the one marked edge is a-b.
    one = count == 1
    (a, b, c), (ab, _, _) = _turned(triangles[one], middle[one], np.argmax(marked[one], axis=1))
    add(source[one], (a, ab, c), (ab, b, c))

    # Turned so that the one unmarked edge is c-a; the shorter diagonal gives the better triangles. Of equal
    # ones both windings of a triangle take the same.
    two = count == 2
    (a, b, c), (ab, bc, _) = _turned(triangles[two], middle[two], (np.argmin(marked[two], axis=1) + 1) % 3)
    one_way, other_way = _squared(points[a] - points[bc]), _squared(points[ab] - points[c])
    from_a = (one_way < other_way) | ((one_way == other_way) & (a < c))
    add(
        source[two],
        (ab, b, bc),
        (a, ab, np.where(from_a, bc, c)),
        (np.where(from_a, a, ab), bc, c),
    )

    three = count == 3
    (a, b, c), (ab, bc, ca) = triangles[three].T, middle[three].T
    add(source[three], (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate(pieces), np.concatenate(sources)


def _turned(triangles: np.ndarray, middle: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners and edge midpoints, each (3, k), rotated so that edge `first` becomes edge 0."""
    index = (first[:, None] + np.arange(3)) % 3
    rows = np.arange(len(triangles))[:, None]
    return triangles[rows, index].T, middle[rows, index].T


def _squared(vectors: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", vectors, vectors)
