# SPDX-License-Identifier: Apache-2.0
"""Smoothing groups of a triangle mesh: creases, vertex normals, and sample points inside open fans."""

from __future__ import annotations

import numpy as np

INSET_OF_SPACING = 0.15
INSET_OF_HEIGHT = 0.4


class Faces:
    """Normals, heights and corner directions of triangles."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray) -> None:
        corners = points[triangles]
        edges = corners[:, (1, 2, 0)] - corners
        length = np.linalg.norm(edges, axis=2)
        cross = np.cross(edges[:, 0], edges[:, 1])
        doubled_area = np.linalg.norm(cross, axis=1)
        self.triangles = triangles
        self.normal = cross / doubled_area[:, None]
        self.height = doubled_area / length.max(axis=1)  # the smallest of the three
        ahead = edges / length[..., None]
        behind = -ahead[:, (2, 0, 1)]
        self.angle = np.arccos(np.clip(np.einsum("tkc,tkc->tk", ahead, behind), -1, 1))
        middle = ahead + behind
        self.bisector = middle / np.maximum(np.linalg.norm(middle, axis=2, keepdims=True), 1e-12)


def shared_edges(triangles: np.ndarray, point_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Find where two triangles continue each other: an edge that they run along in opposite directions.

    Triangles that overlap or are wound against each other share none.

    Returns
    -------
    Two (e,) int64 arrays of edges 3 t + k (triangle t, from its corner k to the next), pairwise one edge.
    """
    start, end = triangles.ravel(), triangles[:, (1, 2, 0)].ravel()
    key = np.minimum(start, end) * point_count + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    sorted_key = key[order]
    pairs: list[tuple[np.ndarray, np.ndarray]] = []
    offset = 1
    # Usually two triangles share an edge; where sheets meet, every pair of them is looked at.
    while (same := sorted_key[offset:] == sorted_key[:-offset]).any():
        one, two = order[:-offset][same], order[offset:][same]
        opposite = start[one] == end[two]
        pairs.append((one[opposite], two[opposite]))
        offset += 1
    none = np.zeros(0, dtype=np.int64)
    return np.concatenate([none, *(p[0] for p in pairs)]), np.concatenate([none, *(p[1] for p in pairs)])


def smooth_edges(
    faces: Faces, cosine: np.ndarray, point_count: int, parted: np.ndarray
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Find edges over which shading is smooth.

    Parameters
    ----------
    cosine : (m,), of the largest angle that is smooth
    parted : (m, 3) bool, edges over which it is not, whatever the angle; of one of both triangles

    Returns
    -------
    joined : (m, 3) bool, edge k (corner k to k + 1) continues smoothly in another triangle
    links : two arrays of corner numbers (3 t + k), pairwise in one smoothing group
    """
    one, two = shared_edges(faces.triangles, point_count)
    normals = faces.normal
    smooth = np.einsum("ij,ij->i", normals[one // 3], normals[two // 3]) >= cosine[one // 3]
    smooth &= ~(parted.ravel()[one] | parted.ravel()[two])
    one, two = one[smooth], two[smooth]
    joined = np.zeros(faces.triangles.size, dtype=bool)
    joined[one] = joined[two] = True
    links = np.concatenate([one, _next_corner(one)]), np.concatenate([_next_corner(two), two])
    return joined.reshape(-1, 3), links


def _next_corner(corner: np.ndarray) -> np.ndarray:
    return corner - corner % 3 + (corner + 1) % 3


def smoothing_groups(links: tuple[np.ndarray, np.ndarray], corners: int) -> tuple[np.ndarray, int]:
    """Number the connected components of corners by their first corner."""
    root = np.arange(corners)
    a, b = links
    while True:
        root_a, root_b = root[a], root[b]
        apart = root_a != root_b
        if not apart.any():
            break
        a, b, root_a, root_b = a[apart], b[apart], root_a[apart], root_b[apart]
        np.minimum.at(root, np.maximum(root_a, root_b), np.minimum(root_a, root_b))
        while not np.array_equal(deeper := root[root], root):
            root = deeper
    first, group = np.unique(root, return_inverse=True)
    return group, len(first)


def _sum_per_vertex(vectors: np.ndarray, vertex_of_corner: np.ndarray, count: int) -> np.ndarray:
    flat = vectors.reshape(-1, 3)
    return np.stack([np.bincount(vertex_of_corner, flat[:, i], count) for i in range(3)], axis=1)


def vertex_normals(faces: Faces, vertex_of_corner: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """Angle-weighted mean of the face normals of each smoothing group; `corner` names one of its corners."""
    weighted = faces.normal[:, None, :] * faces.angle[..., None]
    total = _sum_per_vertex(weighted, vertex_of_corner, len(corner))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 1e-9, total / np.maximum(length, 1e-9), faces.normal[corner // 3])


def insets(
    faces: Faces,
    joined: np.ndarray,
    beside: np.ndarray,
    vertex_of_corner: np.ndarray,
    count: int,
    spacing: float,
) -> np.ndarray:
    """Move of each sample from its vertex into the faces around it; zero where they close around it.

    `beside` : (m, 3) bool, edges on whose other side the surface is covered: samples move to this one.
    """
    open_corner = ~(joined & joined[:, (2, 0, 1)]).ravel()
    incomplete = np.zeros(count, dtype=bool)
    incomplete[vertex_of_corner[open_corner]] = True
    led = (beside | beside[:, (2, 0, 1)]).ravel()
    leads = np.zeros(count, dtype=bool)
    leads[vertex_of_corner[led]] = True
    incomplete |= leads
    counts = led | ~leads[vertex_of_corner]
    # The integral of directions over a corner's sector: its bisector times 2 sin(angle / 2).
    # Summed over a plane fan, it bisects the whole fan, also a reflex one.
    sector = faces.bisector * (2 * np.sin(faces.angle / 2) * counts.reshape(-1, 3))[..., None]
    inward = _sum_per_vertex(sector, vertex_of_corner, count)

    # Stay on the surface: walk inside one face, the one that looks most along that way.
    bisector = faces.bisector.reshape(-1, 3)
    along = np.einsum("ij,ij->i", bisector, inward[vertex_of_corner])
    order = np.lexsort((np.where(counts, along, -np.inf), vertex_of_corner))
    chosen = np.zeros(count, dtype=np.int64)
    chosen[vertex_of_corner[order]] = order
    normal = faces.normal[chosen // 3]
    inward -= np.einsum("ij,ij->i", inward, normal)[:, None] * normal
    length = np.linalg.norm(inward, axis=1)
    inward /= np.maximum(length, 1e-12)[:, None]
    inside = np.einsum("ij,ij->i", inward, bisector[chosen]) >= np.cos(faces.angle.ravel()[chosen] / 2)
    use_own = (length < 1e-6) | ~inside
    inward[use_own] = bisector[chosen[use_own]]

    height = np.full(count, np.inf)
    np.minimum.at(height, vertex_of_corner, np.repeat(faces.height, 3))
    step = np.minimum(INSET_OF_SPACING * spacing, INSET_OF_HEIGHT * height)
    return np.where(incomplete[:, None], inward * step[:, None], 0.0)
