# SPDX-License-Identifier: Apache-2.0
"""Smoothing groups of a triangle mesh: creases, vertex normals, and sample points inside open fans."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from deltalux import _core

INSET_OF_SPACING = 0.15
INSET_OF_HEIGHT = 0.4


class SmoothVertices(NamedTuple):
    """Vertices of smooth shading.

    Parameters
    ----------
    triangles : (m, 3) int64, their numbers, in the order of their first corners
    corner : (n,) int64, number 3 t + k of one of each vertex's corners
    normals : (n, 3), unit: mean of the face normals around the vertex, weighted by their angles
    insets : (n, 3), from the vertex to the point where light is evaluated, into the faces around it; zero if
        the faces form a closed fan around the vertex
    """

    triangles: np.ndarray
    corner: np.ndarray
    normals: np.ndarray
    insets: np.ndarray


def smooth_vertices(
    points: np.ndarray,
    triangles: np.ndarray,
    cosine: np.ndarray,
    parted: np.ndarray,
    beside: np.ndarray,
    spacing: float,
    most: int,
) -> SmoothVertices | None:
    """Find the vertices of smooth shading; None if there are more than `most`.

    Parameters
    ----------
    points : (n, 3) float64
    triangles : (m, 3) int64
    cosine : (m,), cosine of the largest smooth angle
    parted : (m, 3) bool, edges (corner k to k + 1) that are creases at any angle; marked in one or both
        triangles
    beside : (m, 3) bool, edges with a covered surface on the other side: samples move to this side
    spacing : metres
    """
    found: Any = _core.smooth_vertices(
        points, triangles, cosine, parted, beside, INSET_OF_SPACING * spacing, INSET_OF_HEIGHT, most
    )
    return None if found is None else SmoothVertices(*found)


def shared_edges(triangles: np.ndarray, point_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Find edges between two triangles: an edge that they run along in opposite directions.

    Triangles that overlap or have opposite windings share no edge.

    Returns
    -------
    Two (e,) int64 arrays of edges 3 t + k (triangle t, from its corner k to the next); each pair is one edge.
    """
    one, two = _core.shared_edges(triangles, point_count)
    return one, two


def smoothing_groups(links: tuple[np.ndarray, np.ndarray], corners: int) -> np.ndarray:
    """Number the connected components of corners by their first corner."""
    return np.asarray(_core.connected_components(*links, corners))
