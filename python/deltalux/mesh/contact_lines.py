# SPDX-License-Identifier: Apache-2.0
"""Contact lines: lines on the triangles of a mesh along which other surfaces cross or touch them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux import _core
from deltalux.vectors import normals_by_area, unit

MOST_PER_TRIANGLE = 12  # lines; the longest are kept
# a direction that is parallel to no likely line
IRRATIONAL = np.array([np.sqrt(0.2), np.sqrt(0.3), np.sqrt(0.5)])
BEARING_STEP = 0.02  # radians; overlapping lines whose directions differ by less are merged


@dataclass(frozen=True, eq=False)
class ContactLines:
    """Lines within triangles, ordered by triangle.

    Parameters
    ----------
    triangle : (k,) int64
    start : (k, 3), in the triangle's plane
    along : (k, 3), unit, in that plane
    length : (k,)
    """

    triangle: np.ndarray
    start: np.ndarray
    along: np.ndarray
    length: np.ndarray

    def __len__(self) -> int:
        return len(self.triangle)

    def those(self, which: np.ndarray) -> ContactLines:
        """The lines with these numbers."""
        return ContactLines(self.triangle[which], self.start[which], self.along[which], self.length[which])


def contact_lines(
    points: np.ndarray,
    triangles: np.ndarray,
    face: np.ndarray,
    faces: np.ndarray,
    places: np.ndarray,
    gap: float,
    tolerance: float,
) -> ContactLines:
    """Find lines where faces cross triangles of other faces, or end on them.

    Parameters
    ----------
    points : (n, 3)
    triangles : (m, 3) int64
    face : (m,) int64, the face that each triangle is a part of; neighbours of that face, which share an
        edge with it, do not count as crossing it
    faces : (f, 3) int64
    places : (f, 3) int64, numbers of the corners' places; neighbours have two in common
    gap : metres; a face that ends this close to a triangle's plane touches it
    tolerance : metres; lines within it are merged, shorter lines are dropped
    """
    found = _core.contact_lines(points, triangles, face, faces, places, gap, tolerance)
    return _merged(points, triangles, ContactLines(*found), tolerance)


def _merged(points: np.ndarray, triangles: np.ndarray, lines: ContactLines, tolerance: float) -> ContactLines:
    """Merge overlapping lines, and keep the longest ones of each triangle."""
    if len(lines) == 0:
        return lines
    base = points[triangles[lines.triangle]]
    right = unit(base[:, 1] - base[:, 0])
    up = np.cross(unit(normals_by_area(base)), right)
    x, y = (np.einsum("ki,ki->k", lines.along, axis) for axis in (right, up))
    turned = (y < -1e-9) | ((np.abs(y) <= 1e-9) & (x < 0))
    sign = np.where(turned, -1.0, 1.0)
    bearing = np.arctan2(sign * y, sign * x)
    along = lines.along * sign[:, None]
    start = np.where(turned[:, None], lines.start + lines.length[:, None] * lines.along, lines.start)
    from_corner = start - base[:, 0]
    aside = np.cross(np.cross(right, up), along)
    offset = np.einsum("ki,ki->k", from_corner, aside)
    begin = np.einsum("ki,ki->k", from_corner, along)

    key = np.stack([lines.triangle, np.rint(bearing / BEARING_STEP), np.rint(offset / tolerance)])
    order = np.lexsort((begin, key[2], key[1], key[0]))
    key, begin, length = key[:, order], begin[order], lines.length[order]
    line = np.cumsum(np.r_[0, (key[:, 1:] != key[:, :-1]).any(axis=0)])
    end = begin + length
    # Running maximum of the ends on the same line: offsets keep each line's values above the previous ones'.
    step = 2 * (np.abs(begin).max() + length.max() + 1.0)
    farthest = np.maximum.accumulate(end + line * step) - line * step
    new = np.r_[True, (line[1:] != line[:-1]) | (begin[1:] > farthest[:-1] + tolerance)]
    number = np.cumsum(new) - 1
    last = np.r_[np.flatnonzero(new)[1:] - 1, len(new) - 1]
    whole = farthest[last] - begin[new]
    longest = np.lexsort((-length, number))[np.flatnonzero(new)]
    triangle, chosen = lines.triangle[order][longest], order[longest]
    start = start[chosen] + (begin[new] - begin[longest])[:, None] * along[chosen]

    ranked = np.lexsort((-whole, triangle))
    first = np.searchsorted(triangle[ranked], triangle[ranked])
    kept = ranked[np.arange(len(ranked)) - first < MOST_PER_TRIANGLE]
    kept = kept[np.lexsort((_rank(start[kept], along[chosen[kept]]), triangle[kept]))]
    return ContactLines(triangle[kept], start[kept], along[chosen[kept]], whole[kept])


def _rank(start: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Ranks that are equal for one line on two triangles, so that both are cut along it first."""
    one_way = along * np.where(along @ IRRATIONAL < 0, -1.0, 1.0)[:, None]
    return (np.cross(start, one_way) + one_way) @ IRRATIONAL
