# SPDX-License-Identifier: Apache-2.0
"""Decimation of a lit mesh: fewer vertices, irradiance within a tolerance, the same shape."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from deltalux.errors import Cancelled, OptionError
from deltalux.segments import Progress

# cosine between normals around a vertex; float32 positions alone make the normals of flat surfaces differ by
# this much
FLAT = np.cos(np.radians(0.5))
THINNEST = 1e-9  # least ratio of twice a new triangle's area to its longest edge squared
VERTICES_A_REPORT = 256


def decimate(
    points: Any,
    triangles: Any,
    irradiance: Any,
    tolerance: float,
    *,
    progress: Progress | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Remove vertices whose irradiance is interpolated well enough from the others.

    The third phase of Walter, Hubbard, Shirley & Greenberg 1997, by vertex removal: a vertex is merged into
    a neighbour, in passes until none can be removed. Only vertices inside flat parts are removed, so that the
    shape and all borders and creases stay, and no cracks open; a vertex also stays if merging it would make a
    triangle degenerate. Takes about 0.1 ms per vertex and pass.

    Parameters
    ----------
    points : (n, 3) array, metres
    triangles : (m, 3) int array; vertices on creases are one per side, as in `DisplayMesh`
    irradiance : (n,) or (n, c) array
    tolerance : float
        The irradiance of every input vertex differs from the interpolated irradiance of the result by at
        most this, in each channel; in the unit of `irradiance`.
    progress : called with ("decimate", share of the pass); returning False cancels

    Returns
    -------
    kept : (k,) int64, the vertices that stay, ascending
    triangles : (j, 3) int64, into `kept`

    Raises
    ------
    OptionError
        For arrays that do not fit together, or a tolerance that is negative or not finite.
    Cancelled
        If `progress` returned False.
    """
    corners, faces, values = _checked(points, triangles, irradiance)
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise OptionError(f"tolerance: found {tolerance}, expected a number that is not negative")
    mesh = _Mesh(corners, faces, values, float(tolerance))
    while mesh.one_pass(progress):
        pass
    left = np.array([t for t in mesh.triangles if t is not None], np.int64).reshape(-1, 3)
    unused = np.setdiff1d(np.arange(len(corners)), faces)
    kept = np.union1d(left, unused).astype(np.int64)
    return kept, np.searchsorted(kept, left)


def _checked(points: Any, triangles: Any, irradiance: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    corners, values = np.asarray(points, np.float64), np.asarray(irradiance, np.float64)
    faces = np.asarray(triangles)
    values = values[:, None] if values.ndim == 1 else values
    if corners.ndim != 2 or corners.shape[1] != 3 or values.ndim != 2 or len(values) != len(corners):
        raise OptionError(
            f"decimate: found points of shape {corners.shape} and irradiance of shape {values.shape}, "
            "expected (n, 3) and one row for each point"
        )
    if faces.ndim != 2 or faces.shape[1] != 3 or not np.issubdtype(faces.dtype, np.integer):
        raise OptionError(f"decimate: found triangles of shape {faces.shape}, expected (m, 3) integers")
    if faces.size and not (faces.min() >= 0 and faces.max() < len(corners)):
        raise OptionError(
            f"decimate: found vertex {int(faces.max())}, expected indices from 0 to {len(corners) - 1}"
        )
    if not (np.isfinite(corners).all() and np.isfinite(values).all()):
        raise OptionError("decimate: found a value that is not finite in points or irradiance")
    return corners, faces.astype(np.int64), values


class _Mesh:
    """Triangles and, for each, the removed vertices that it covers."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray, values: np.ndarray, tolerance: float):
        a, b, c = (points[triangles[:, k]] for k in range(3))
        cross = np.cross(b - a, c - a)
        size = np.linalg.norm(cross, axis=1, keepdims=True)
        # A degenerate triangle has no normal: its surroundings never count as flat.
        self.normals = np.where(size > 0, cross / np.where(size > 0, size, 1), 0).tolist()
        self.points, self.values, self.tolerance = points.tolist(), values.tolist(), tolerance
        self.triangles: list[tuple[int, int, int] | None] = [(p, q, r) for p, q, r in triangles.tolist()]
        self.covered: list[list[int]] = [[] for _ in self.triangles]
        self.around: list[set[int]] = [set() for _ in self.points]
        for number, corners in enumerate(triangles.tolist()):
            for vertex in corners:
                self.around[vertex].add(number)

    def one_pass(self, progress: Progress | None) -> int:
        """Try every vertex once; return how many were removed."""
        gone = 0
        for vertex in range(len(self.points)):
            if vertex % VERTICES_A_REPORT == 0 and _stopped(progress, vertex / len(self.points)):
                raise Cancelled("cancelled")
            gone += self._remove(vertex)
        return gone

    def _remove(self, vertex: int) -> bool:
        ring = self._flat_ring(vertex)
        if not ring:
            return False
        star = sorted(self.around[vertex])
        axis = _flattest(self.normals[star[0]])
        mine = self.values[vertex]
        likest = sorted(
            ring, key=lambda n: max(abs(x - y) for x, y in zip(self.values[n], mine, strict=True))
        )
        return any(self._merge(vertex, into, star, ring, axis) for into in likest)

    def _flat_ring(self, vertex: int) -> list[int]:
        """The ring of neighbours of a vertex if flat triangles close around it, else an empty list."""
        star = self.around[vertex]
        after = {}
        for number in star:
            a, b, c = self._corners(number)
            p, q = (b, c) if a == vertex else (c, a) if b == vertex else (a, b)
            after[p] = q
        if len(after) != len(star) or len(star) < 3:
            return []
        first = self.normals[next(iter(star))]
        if any(_dot(first, self.normals[number]) < FLAT for number in star):
            return []
        ring = [min(after)]
        while len(ring) < len(star):
            following = after.get(ring[-1])
            if following is None or following == ring[0]:
                return []
            ring.append(following)
        return ring if after.get(ring[-1]) == ring[0] else []

    def _corners(self, number: int) -> tuple[int, int, int]:
        corners = self.triangles[number]
        assert corners is not None  # `around` names living triangles only
        return corners

    def _merge(self, vertex: int, into: int, star: list[int], ring: list[int], axis: tuple[int, int]) -> bool:
        beyond = {n for number in self.around[into] for n in self._corners(number)}
        if len(beyond.intersection(ring)) != 3:  # `into` itself and its two neighbours in the ring
            return False
        new: dict[int, tuple[int, int, int]] = {}
        for number in star:
            a, b, c = self._corners(number)
            if into not in (a, b, c):
                new[number] = tuple(into if n == vertex else n for n in (a, b, c))  # type: ignore[assignment]
        frames = {}
        for number, corners in new.items():
            frame = _Frame([[self.points[n][k] for k in axis] for n in corners])
            old = _Frame([[self.points[n][k] for k in axis] for n in self._corners(number)])
            if not (frame.solid and frame.area * old.area > 0):
                return False
            frames[number] = frame
        covers: dict[int, list[int]] = {number: [] for number in new}
        for point in (vertex, *(p for number in star for p in self.covered[number])):
            at = [self.points[point][k] for k in axis]
            number, weights = max(
                ((n, frame.weights(at)) for n, frame in frames.items()), key=lambda pair: min(pair[1])
            )
            if not self._within(point, new[number], weights):
                return False
            covers[number].append(point)
        for number in star:
            for n in self._corners(number):
                self.around[n].discard(number)
            self.triangles[number], self.covered[number] = new.get(number), covers.get(number, [])
        for number, corners in new.items():
            for n in corners:
                self.around[n].add(number)
        return True

    def _within(self, point: int, corners: Iterable[int], weights: tuple[float, float, float]) -> bool:
        channels = zip(self.values[point], *(self.values[n] for n in corners), strict=True)
        u, v, w = weights
        return all(abs(u * a + v * b + w * c - own) <= self.tolerance for own, a, b, c in channels)


class _Frame:
    """Barycentric coordinates in a triangle, projected to two axes."""

    def __init__(self, corners: list[list[float]]) -> None:
        (self.x, self.y), (bx, by), (cx, cy) = corners
        self.bx, self.by, self.cx, self.cy = bx - self.x, by - self.y, cx - self.x, cy - self.y
        self.area = self.bx * self.cy - self.by * self.cx
        longest = max(
            self.bx**2 + self.by**2,
            self.cx**2 + self.cy**2,
            (self.bx - self.cx) ** 2 + (self.by - self.cy) ** 2,
        )
        self.solid = abs(self.area) > THINNEST * longest

    def weights(self, at: list[float]) -> tuple[float, float, float]:
        x, y = at[0] - self.x, at[1] - self.y
        v = (x * self.cy - y * self.cx) / self.area
        w = (self.bx * y - self.by * x) / self.area
        return 1 - v - w, v, w


def _stopped(progress: Progress | None, share: float) -> bool:
    return progress is not None and progress("decimate", share) is False


def _dot(a: list[float], b: list[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _flattest(normal: list[float]) -> tuple[int, int]:
    """The two axes on which a plane's projection has the largest area."""
    most = max(range(3), key=lambda k: abs(normal[k]))
    return ((1, 2), (2, 0), (0, 1))[most]
