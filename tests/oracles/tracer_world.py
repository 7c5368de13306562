# SPDX-License-Identifier: Apache-2.0
"""Parallelograms and triangles that rays are tested against: the geometry of the path tracer beside it.

All in NumPy and double precision. Many rays go down a tree of boxes together, so that a few hundred
primitives cost little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

LEAF = 14  # primitives that are tested without boxes in between
TOGETHER = 1 << 14  # rays: intermediate arrays stay in the processor's caches
EDGE = 1e-9  # of an edge, by which primitives overlap, so that no ray slips through where two meet
MARGIN = 1e-9  # of coordinates, by which boxes are larger than what is in them


@dataclass(frozen=True, eq=False)
class Primitives:
    """`corner`, `u`, `v` (n, 3): corner + a u + b v; the front shows u x v.

    Parameters
    ----------
    triangle : (n,) bool; a + b <= 1, else a <= 1 and b <= 1
    reflectance, radiance : (n,), the same on both sides; radiance of the front
    both : (n,) bool; the back is as luminous
    """

    corner: Array
    u: Array
    v: Array
    triangle: NDArray[np.bool_]
    reflectance: Array
    radiance: Array
    both: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.corner)

    @property
    def normals(self) -> Array:
        cross = np.cross(self.u, self.v)
        return cross / np.linalg.norm(cross, axis=1, keepdims=True)

    @property
    def areas(self) -> Array:
        return np.linalg.norm(np.cross(self.u, self.v), axis=1) * np.where(self.triangle, 0.5, 1.0)


def primitives(
    corner: ArrayLike,
    u: ArrayLike,
    v: ArrayLike,
    triangle: ArrayLike = False,
    reflectance: ArrayLike = 0.0,
    radiance: ArrayLike = 0.0,
    both: ArrayLike = False,
) -> Primitives:
    """`Primitives` of arrays, or of single values for all of them."""
    corner = np.atleast_2d(np.asarray(corner, np.float64))
    count = len(corner)

    def each(values: ArrayLike, kind: type) -> NDArray:
        return np.broadcast_to(np.asarray(values, kind), (count,)).copy()

    u, v = (np.broadcast_to(np.asarray(x, np.float64), (count, 3)) for x in (u, v))
    return Primitives(
        corner, u, v, each(triangle, bool), each(reflectance, np.float64), each(radiance, np.float64),
        each(both, bool),
    )  # fmt: skip


class Frames:
    """Coordinates (a, b, height) of points and directions over each of some primitives."""

    def __init__(self, own: Primitives) -> None:
        basis = np.stack([own.u, own.v, own.normals], axis=2)
        inverse = np.linalg.inv(basis)
        self._count = len(own)
        self._matrix = np.ascontiguousarray(inverse.transpose(1, 0, 2).reshape(3 * self._count, 3).T)
        self._shift = np.einsum("nij,nj->in", inverse, own.corner).ravel()
        self._sloping = own.triangle.astype(np.float64)

    def crossings(self, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Distances (rays, n) along the rays, infinite where they miss, and the heights of directions."""
        shape = (len(origins), 3, self._count)
        place = (origins @ self._matrix - self._shift).reshape(shape)
        way = (directions @ self._matrix).reshape(shape)
        with np.errstate(all="ignore"):
            t = -place[:, 2] / way[:, 2]
            a = place[:, 0] + t * way[:, 0]
            b = place[:, 1] + t * way[:, 1]
            inside = (t > 0) & (a >= -EDGE) & (b >= -EDGE) & (a <= 1 + EDGE)
            inside &= b + self._sloping * a <= 1 + EDGE
        return np.where(inside, t, np.inf), way[:, 2]


@dataclass(frozen=True, eq=False)
class _Node:
    low: Array
    high: Array
    members: NDArray[np.int64]
    frames: Frames | None
    children: tuple[_Node, ...] = ()


class Geometry:
    """Nearest hits and visibility."""

    def __init__(self, own: Primitives) -> None:
        self.primitives = own
        far = np.where(own.triangle[:, None], 0.0, 1.0) * (own.u + own.v)
        corners = own.corner[:, None] + np.stack([0 * own.u, own.u, own.v, far], axis=1)
        corners[own.triangle, 3] = own.corner[own.triangle]
        self._low, self._high = corners.min(axis=1), corners.max(axis=1)
        self._root = self._node(np.arange(len(own)))

    def _node(self, members: NDArray[np.int64]) -> _Node:
        low, high = self._low[members].min(axis=0), self._high[members].max(axis=0)
        slack = MARGIN * (1 + np.maximum(abs(low), abs(high)))
        if len(members) <= LEAF:
            p = self.primitives
            columns = (p.corner, p.u, p.v, p.triangle, p.reflectance, p.radiance, p.both)
            return _Node(
                low - slack, high + slack, members, Frames(Primitives(*(c[members] for c in columns)))
            )
        size = np.linalg.norm(self._high[members] - self._low[members], axis=1)
        large = size > 4 * np.median(size)  # land beside a house: kept apart, or every box would be large
        if 0 < large.sum() <= len(members) // 2:
            halves = [members[large], members[~large]]
        else:
            centres = (self._low + self._high)[members]
            order = np.argsort(centres[:, np.ptp(centres, axis=0).argmax()], kind="stable")
            halves = list(np.array_split(members[order], 2))
        return _Node(low - slack, high + slack, members, None, tuple(self._node(half) for half in halves))

    def nearest(self, origins: Array, directions: Array) -> tuple[Array, NDArray[np.int64]]:
        """Distance to the first hit, infinite for none, and its primitive, -1 for none."""
        distance, index = np.full(len(origins), np.inf), np.full(len(origins), -1)
        for first in range(0, len(origins), TOGETHER):
            own = slice(first, first + TOGETHER)
            search = _Search(origins[own], directions[own], distance[own], index[own], False)
            search.visit(self._root, np.arange(len(distance[own])))
        return distance, index

    def free(self, origins: Array, directions: Array, reach: Array) -> NDArray[np.bool_]:
        """Whether nothing lies on the rays before `reach`, in lengths of the directions."""
        limit, index = np.array(reach, np.float64), np.full(len(origins), -1)
        for first in range(0, len(origins), TOGETHER):
            own = slice(first, first + TOGETHER)
            search = _Search(origins[own], directions[own], limit[own], index[own], True)
            search.visit(self._root, np.arange(len(limit[own])))
        return index < 0


class _Search:
    """One descent of rays through the tree; writes into `distance` and `index`."""

    def __init__(self, origins: Array, directions: Array, distance: Array, index: NDArray, any_hit: bool):
        self._origins, self._directions = origins, directions
        self._distance, self._index, self._any = distance, index, any_hit
        with np.errstate(divide="ignore"):
            self._inverse = 1 / directions

    def visit(self, node: _Node, rays: NDArray[np.int64]) -> None:
        """Test `rays` against what is in the node."""
        rays = rays[self._enters(node, rays)]
        if not len(rays):
            return
        if node.frames is None:
            for child in node.children:
                self.visit(child, rays)
            return
        t, _ = node.frames.crossings(self._origins[rays], self._directions[rays])
        best = t.argmin(axis=1)
        t = t[np.arange(len(rays)), best]
        closer = t < self._distance[rays]
        hit = rays[closer]
        self._distance[hit], self._index[hit] = t[closer], node.members[best[closer]]

    def _enters(self, node: _Node, rays: NDArray[np.int64]) -> NDArray[np.bool_]:
        near, far = np.zeros(len(rays)), self._distance[rays].copy()
        with np.errstate(invalid="ignore"):
            for axis in range(3):
                place, inverse = self._origins[rays, axis], self._inverse[rays, axis]
                one, other = (node.low[axis] - place) * inverse, (node.high[axis] - place) * inverse
                # A ray along a face of the box gives NaN, which fmin and fmax leave out.
                near = np.fmax(near, np.fmin(one, other))
                far = np.fmin(far, np.fmax(one, other))
        enters = near <= far
        return enters & (self._index[rays] < 0) if self._any else enters
