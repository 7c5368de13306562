# SPDX-License-Identifier: Apache-2.0
"""Finds the meshes of which only one side can be seen from either side: solids, and rooms around the eye."""

from __future__ import annotations

import numpy as np

from .display_mesh import DisplayMesh


def closed_meshes(display: DisplayMesh, count: int) -> np.ndarray:
    """Which of `count` meshes have no border: each edge is passed as often one way as the other, by position.

    Edges are told apart by hashes of 64 bits, whose signed sum is 0 for such a mesh, and for any other
    one by chance only.

    Returns
    -------
    (count,) bool
    """
    place = np.zeros(len(display.points), np.uint64)
    for column in (display.points.astype(np.float32) + 0.0).T:  # 0.0 and -0.0 are one
        place = _mixed(place + column.view(np.uint32))
    start, end = place[display.triangles], place[display.triangles[:, (1, 2, 0)]]
    edge = _mixed(_mixed(np.minimum(start, end)) + np.maximum(start, end))
    edge[start == end] = 0
    signed = np.where(start < end, edge, ~edge + np.uint64(1)).sum(axis=1, dtype=np.uint64)
    first = np.searchsorted(display.triangle_mesh, np.arange(count + 1))
    sums = np.r_[np.uint64(0), np.cumsum(signed, dtype=np.uint64)]
    return sums[first[1:]] == sums[first[:-1]]


def _mixed(values: np.ndarray) -> np.ndarray:
    """The finaliser of SplitMix64 (Steele et al. 2014)."""
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return values ^ (values >> np.uint64(31))
