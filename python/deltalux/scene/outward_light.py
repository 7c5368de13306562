# SPDX-License-Identifier: Apache-2.0
"""How much of the light of a two-sided luminous surface leaves the body that it belongs to."""

from __future__ import annotations

import numpy as np

from deltalux import _core
from deltalux.vectors import same_places, triangle_areas


def inner_shares(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(m,) share of the light of each triangle's other side that leaves the body, 0 to 1.

    Connected triangles are a body. A closed one keeps all, a flat one nothing. What leaves a body with holes
    is what falls through these, radiance being the same everywhere inside: the area that the holes' edges
    span, as a share of the body's.

    Parameters
    ----------
    vertices : (n, 3)
    triangles : (m, 3)
    """
    areas = triangle_areas(vertices[triangles])
    place = same_places(vertices)[triangles]
    body = _connected(place, len(vertices))
    edges = np.stack([place, place[:, (1, 2, 0)]], axis=-1).reshape(-1, 2)
    low, high = edges.min(axis=1), edges.max(axis=1)
    _, which, count = np.unique(low * len(vertices) + high, return_inverse=True, return_counts=True)
    border = np.flatnonzero((count[which.reshape(-1)] == 1) & (low != high))
    spanned = np.bincount(*_spans(vertices, edges[border], np.repeat(body, 3)[border]), minlength=len(areas))
    whole = np.bincount(body, areas, minlength=len(areas))
    share = np.divide(spanned, whole, out=np.zeros(len(areas)), where=whole > 0)
    return np.minimum(share, 1.0)[body]


def _connected(place: np.ndarray, count: int) -> np.ndarray:
    """(m,) number of the body of each triangle, by shared places."""
    corners = np.arange(place.size)
    first = np.zeros(count, np.int64)
    first[place.ravel()[::-1]] = corners[::-1]
    one = np.concatenate([corners, corners[0::3], corners[0::3]])
    two = np.concatenate([first[place.ravel()], corners[1::3], corners[2::3]])
    return np.asarray(_core.connected_components(one, two, place.size))[0::3]


def _spans(vertices: np.ndarray, edges: np.ndarray, body: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each loop of border edges (k, 2) the body it belongs to, and the area that it spans."""
    if not len(edges):
        return np.zeros(0, np.int64), np.zeros(0)
    _, ends = np.unique(edges, return_inverse=True)
    ends = ends.reshape(edges.shape)
    loop = np.asarray(_core.connected_components(ends[:, 0], ends[:, 1], int(ends.max()) + 1))[ends[:, 0]]
    count = int(loop.max()) + 1
    corners = vertices[edges]
    # Its vector area, about a corner of its own: far from zero, products would lose digits.
    origin = np.zeros((count, 3))
    origin[loop] = corners[:, 0]
    corners = corners - origin[loop][:, None]
    cross = 0.5 * np.cross(corners[:, 0], corners[:, 1])
    areas = np.stack([np.bincount(loop, column, count) for column in cross.T], axis=1)
    of = np.zeros(count, np.int64)
    of[loop] = body
    return of, np.linalg.norm(areas, axis=1)
