# SPDX-License-Identifier: Apache-2.0
"""Sharing samples: dense vertices are interpolated from a few nearby samples on their own surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from deltalux import _core
from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.mesh.sharing import NEIGHBOURS, Sharing

MOST_SAMPLES = 60_000  # where vertices may share: what refinement adds to a plain room is less
FARTHEST = 0.5  # largest edge of the cubes whose vertices share a sample, as a share of the spacing
STEPS = 13  # number of edges to try, each smaller than the last by the square root of two
LARGEST_TURN = 0.7  # least cosine between the normals of a vertex and of a sample that it uses
REACH = 2.0  # how far from a sample its vertices may lie, in edges of a cube
LEAST_BOUND = 0.05  # of the error bound (Ward, Rubinstein & Clear 1988) of a sample at the vertex itself
# shifts the cubes by this share of their edge: walls at round coordinates would lie on their faces
OFFSET = 0.37


def shared(display: DisplayMesh, covered: np.ndarray, most: int = MOST_SAMPLES) -> DisplayMesh:
    """The display mesh with samples at only some of its vertices, if it has more vertices than `most`.

    Vertices of one connected smooth surface that lie in the same cube and have similar normals share the
    sample at the vertex nearest to their centroid. Cubes are as small as `most` allows, but no larger than
    half the spacing, so that plain surfaces, whose vertices come from refinement, keep a sample at each.

    Parameters
    ----------
    display : a mesh with a sample at every vertex
    covered : (n,) bool, samples covered by another surface; covered and other vertices never share
    most : number of samples to aim at; cubes of half the spacing may leave more
    """
    if len(display.points) <= most:
        return display
    # Connected smooth surfaces.
    piece = np.asarray(_core.connected_components(*_edges(display), len(display.points)))
    edge, group = _grouped(display, piece, covered, most)
    vertices = np.sort(np.asarray(_core.centroid_vertices(display.points, group)))
    sharing = _weighted(display, piece, covered, group, vertices, edge)
    for array in (sharing.vertices, sharing.samples, sharing.weights):
        array.setflags(write=False)
    return replace(display, sharing=sharing)


def _edges(display: DisplayMesh) -> tuple[np.ndarray, np.ndarray]:
    """First and second vertex of every triangle's edges."""
    triangles = display.triangles
    return triangles.ravel(), triangles[:, (1, 2, 0)].ravel()


def _grouped(
    display: DisplayMesh, piece: np.ndarray, covered: np.ndarray, most: int
) -> tuple[float, np.ndarray]:
    """Edge of the cubes and group of each vertex (n,).

    The edge is the smallest that gives at most `most` groups, else the largest.
    """
    edges = FARTHEST * display.spacing * 2.0 ** (-0.5 * np.arange(STEPS))
    axis = np.abs(display.normals).argmax(axis=1)
    side = 2 * axis + (display.normals[np.arange(len(axis)), axis] > 0)
    like = 12 * piece + 2 * side + covered

    def groups(step: int) -> tuple[int, np.ndarray]:
        # Groups are connected: vertices on the two sides of a partition's foot never share.
        number = np.asarray(
            _core.groups_in_cubes(display.points, display.triangles, like, edges[step], OFFSET)
        )
        return int(number.max()) + 1, number

    low, high = 0, STEPS - 1  # Bisection for the smallest edge that suffices: tries few edges.
    best = groups(low)[1]
    while low < high:
        middle = (low + high + 1) // 2
        count, found = groups(middle)
        if count <= most:
            low, best = middle, found
        else:
            high = middle - 1
    return float(edges[low]), best.astype(np.int64)


def _weighted(
    display: DisplayMesh,
    piece: np.ndarray,
    covered: np.ndarray,
    group: np.ndarray,
    vertices: np.ndarray,
    edge: float,
) -> Sharing:
    """Split-sphere weights (Ward, Rubinstein & Clear 1988) of the nearest samples of the same piece."""
    count = len(display.points)
    samples, weights = np.zeros((count, NEIGHBOURS), np.int32), np.zeros((count, NEIGHBOURS), np.float32)
    samples[vertices, 0], weights[vertices, 0] = np.arange(len(vertices)), 1.0
    others = np.setdiff1d(np.arange(count), vertices, assume_unique=True)
    # Vertices of another piece, or where only one is covered, count as far away.
    kind = 2 * piece.astype(np.int64) + covered
    place = np.column_stack([display.points / edge, display.normals, 16 * REACH * kind])
    width = min(NEIGHBOURS, len(vertices))
    _, near = cKDTree(place[vertices]).query(place[others], width, workers=-1)
    near = near.reshape(len(others), width)
    near = near[
        :, np.minimum(np.arange(NEIGHBOURS), width - 1)
    ]  # fewer samples than columns: repeat the last
    samples[others], weights[others] = _core.shared_weights(
        display.points,
        display.normals,
        display.triangles,
        kind,
        group,
        vertices,
        others,
        np.ascontiguousarray(near),
        edge=edge,
        reach=REACH,
        least_cosine=LARGEST_TURN,
        least_bound=LEAST_BOUND,
    )
    return Sharing(vertices, samples, weights)
