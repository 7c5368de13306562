# SPDX-License-Identifier: Apache-2.0
"""Crack-free cutting of triangles along lines within them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux.vectors import normals_by_area, same_places, unit

from .contact_lines import ContactLines
from .subdivision import split_marked

ROUNDS = 24  # most cuts through one triangle


@dataclass(frozen=True, eq=False)
class CutMesh:
    """Triangles after cutting.

    Parameters
    ----------
    points : (n + k, 3), the given ones first
    triangles : (m', 3), in the order of the triangles that they come from, winding kept
    source : (m',) int64, the original triangle of each
    parted : (m', 3) bool, edge k (corner k to k + 1) lies on a line that is open on both sides
    beside : (m', 3) bool, edge k lies on a line that is open on this triangle's side only
    """

    points: np.ndarray
    triangles: np.ndarray
    source: np.ndarray
    parted: np.ndarray
    beside: np.ndarray


def split_along(
    points: np.ndarray,
    triangles: np.ndarray,
    body: np.ndarray,
    lines: ContactLines,
    sides: np.ndarray,
    tolerance: float,
    max_points: int,
) -> CutMesh:
    """Cut triangles along lines, so that edges run along them within `tolerance`.

    A line that ends inside a triangle cuts it to its border. Every edge is cut at the same places on
    both sides, even between different bodies with equal end points. At `max_points`, and where there are
    too many lines, the remaining triangles stay uncut.

    Parameters
    ----------
    points : (n, 3)
    triangles : (m, 3); each point belongs to one body
    body : (m,) int64
    lines : contact lines on some of the triangles
    sides : (k, 2) bool, whether a line is open to the left and to the right as seen from above
    tolerance : metres
    """
    no_edge = np.zeros(triangles.shape, dtype=bool)
    nothing = CutMesh(points, triangles, np.arange(len(triangles)), no_edge, no_edge.copy())
    if len(lines) == 0:
        return nothing
    work = _Work(points, triangles, body, lines, tolerance)
    for _ in range(ROUNDS):
        if not work.cut(max_points):
            break
    return work.finished(nothing, sides)


class _Work:
    """Cutting in progress, of the triangles with lines and of their neighbours."""

    def __init__(
        self,
        points: np.ndarray,
        triangles: np.ndarray,
        body: np.ndarray,
        lines: ContactLines,
        tolerance: float,
    ) -> None:
        self.points, self.tolerance = points, tolerance
        self.place = same_places(points)
        lined = np.zeros(len(points), dtype=bool)
        lined[self.place[triangles[lines.triangle]]] = True
        beside = lined[self.place[triangles]].sum(axis=1) >= 2
        self.root = np.flatnonzero(beside)
        self.triangles, self.root_body = triangles[beside], body
        corners = points[triangles[lines.triangle]]
        self.lines = lines
        self.aside = np.cross(unit(normals_by_area(corners)), lines.along)
        self.first_line = np.searchsorted(lines.triangle, np.arange(len(triangles) + 1))
        self.open = self.first_line[self.root + 1] > self.first_line[self.root]

    def _pairs(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Each of the triangles `rows` with each of its lines."""
        first = self.first_line[self.root[rows]]
        count = self.first_line[self.root[rows] + 1] - first
        before = np.cumsum(count) - count
        number = np.arange(int(count.sum())) + np.repeat(first - before, count)
        return np.repeat(rows, count), number

    def _seen_from(self, row: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances of the corners (k, 3) from the line, zero within the tolerance, and places along it."""
        way = self.points[self.triangles[row]] - self.lines.start[line][:, None]
        aside = np.einsum("kci,ki->kc", way, self.aside[line])
        aside[np.abs(aside) <= self.tolerance] = 0.0
        return aside, np.einsum("kci,ki->kc", way, self.lines.along[line])

    def cut(self, max_points: int) -> bool:
        """Cut each triangle that a line crosses once; False if there is none."""
        row, line = self._pairs(np.flatnonzero(self.open))
        aside, along = self._seen_from(row, line)
        following = (1, 2, 0)
        across = aside * aside[:, following] < 0
        share = np.divide(aside, aside - aside[:, following], out=np.zeros_like(aside), where=across)
        at = along + share * (along[:, following] - along)
        spots, valid = np.concatenate([at, along], axis=1), np.concatenate([across, aside == 0], axis=1)
        begin = np.where(valid, spots, np.inf).min(axis=1)
        end = np.where(valid, spots, -np.inf).max(axis=1)
        overlap = np.minimum(end, self.lines.length[line]) - np.maximum(begin, 0.0)
        crossed = across.any(axis=1) & (overlap > self.tolerance)
        self.open[:] = False
        if not crossed.any():
            return False
        row, line, across, share = row[crossed], line[crossed], across[crossed], share[crossed]
        self.open[row] = True
        _, chosen = np.unique(row, return_index=True)  # its first line
        return self._mark(row[chosen], across[chosen], share[chosen], max_points)

    def _mark(self, row: np.ndarray, across: np.ndarray, share: np.ndarray, max_points: int) -> bool:
        """Split these triangles at `share` of the edges in `across`, and all neighbours at those edges."""
        ends = self._edges()
        keys = ends[..., 0] * len(self.points) + ends[..., 1]
        # `share` counts from the edge's end with the smaller number.
        turned = self.place[self.triangles] != ends[..., 0]
        wanted, first = np.unique(keys[row][across], return_index=True)
        share = np.where(turned[row], 1 - share, share)[across][first]
        at = np.minimum(np.searchsorted(wanted, keys), len(wanted) - 1)
        marked = wanted[at] == keys
        # Each body gets one point per place.
        body = np.broadcast_to(self.root_body[self.root][:, None], keys.shape)[marked]
        spot = at[marked]
        pair, index = np.unique(np.stack([spot, body]), axis=1, return_inverse=True)
        count = len(self.points)
        if count + pair.shape[1] > max_points:
            return False
        middle = np.full(keys.shape, -1, dtype=np.int64)
        middle[marked] = count + index.reshape(-1)
        low, high = np.divmod(wanted, count)
        spots = self.points[low] + share[:, None] * (self.points[high] - self.points[low])
        self.points = np.concatenate([self.points, spots[pair[0]]])
        first_of = np.searchsorted(pair[0], np.arange(len(wanted)))
        self.place = np.concatenate([self.place, count + first_of[pair[0]]])

        touched = marked.any(axis=1)
        rows = np.flatnonzero(touched)
        parts, source = split_marked(self.points, self.triangles[rows], rows, marked[rows], middle[rows])
        whole = np.flatnonzero(~touched)
        origin = np.concatenate([whole, source])
        self.triangles = np.concatenate([self.triangles[whole], parts])
        self.root, self.open = self.root[origin], self.open[origin]
        return True

    def _edges(self) -> np.ndarray:
        """(m, 3, 2) places of the end points of all edges, the smaller number first."""
        place = self.place[self.triangles]
        return np.sort(np.stack([place, place[:, (1, 2, 0)]], axis=-1), axis=-1)

    def finished(self, given: CutMesh, sides: np.ndarray) -> CutMesh:
        """The mesh with all triangles, including the uncut ones."""
        row, line = self._pairs(np.arange(len(self.triangles)))
        aside, along = self._seen_from(row, line)
        near = aside == 0
        begin, end = along, along[:, (1, 2, 0)]
        low, high = np.minimum(begin, end), np.maximum(begin, end)
        shared = np.minimum(high, self.lines.length[line][:, None]) - np.maximum(low, 0.0)
        runs = near & near[:, (1, 2, 0)] & ~near[:, (2, 0, 1)] & (shared > 0.5 * (high - low))
        both = sides[line].all(axis=1)
        is_open = np.where(aside.sum(axis=1) > 0, sides[line, 0], sides[line, 1])
        parted = np.zeros(self.triangles.shape, dtype=bool)
        beside = parted.copy()
        np.logical_or.at(parted, row, runs & both[:, None])
        np.logical_or.at(beside, row, runs & (is_open & ~both)[:, None])

        untouched = np.ones(len(given.triangles), dtype=bool)
        untouched[self.root] = False
        others = np.flatnonzero(untouched)
        source = np.concatenate([others, self.root])
        order = np.argsort(source, kind="stable")
        return CutMesh(
            self.points,
            np.concatenate([given.triangles[others], self.triangles])[order],
            source[order],
            np.concatenate([given.parted[others], parted])[order],
            np.concatenate([given.beside[others], beside])[order],
        )
