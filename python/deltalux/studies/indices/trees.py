# SPDX-License-Identifier: Apache-2.0
"""Octree and kd-tree over discs: cells that are split until they hold few discs or are as small as one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from deltalux.samples import Samples
from deltalux.segments import Segments

from .counting import RayCosts, Tally, disc_boxes, expand

LEAF_DISCS = 4  # cells with at most so many are not split
PLANES = 15  # candidate planes per axis of the kd-tree
RAYS_AT_ONCE = 4096
STEP_COST = 1.0  # cost of a box test, in disc tests, for the kd-tree's surface-area heuristic

Cell = tuple[np.ndarray, np.ndarray]  # lower and upper corner
Split = Callable[[Cell, np.ndarray, np.ndarray], "Sequence[Cell] | None"]  # cell, low, high of its discs


@dataclass(frozen=True)
class DiscTree:
    """A tree of cells, with the discs of its leaves; the root is cell 0.

    Attributes
    ----------
    low, high : (cells, 3) corners
    first, count : (cells,) range of an inner cell's children, or of a leaf's entries in `discs`
    leaf : (cells,) bool
    discs : indices of discs; a disc that overlaps several leaves is listed in each
    """

    low: np.ndarray
    high: np.ndarray
    first: np.ndarray
    count: np.ndarray
    leaf: np.ndarray
    discs: np.ndarray

    def cast(self, segments: Segments, samples: Samples) -> RayCosts:
        """Traverse the tree with each ray; a visited cell tests the boxes of all its children.

        Parameters
        ----------
        segments : rays, which end at their first hit
        samples : the samples that the tree was built from
        """
        tally = Tally(segments, samples)
        for begin in range(0, len(segments), RAYS_AT_ONCE):
            self._cast(tally, segments, np.arange(begin, min(begin + RAYS_AT_ONCE, len(segments))))
        return tally.costs()

    def _cast(self, tally: Tally, segments: Segments, rays: np.ndarray) -> None:
        cells = np.zeros(len(rays), np.int64)
        while len(rays):
            tally.step(rays)
            met = _meets(segments, rays, self.low[cells], self.high[cells])
            rays, cells = rays[met], cells[met]
            own, entries = expand(
                *(a[self.leaf[cells]] for a in (rays, self.first[cells], self.count[cells]))
            )
            tally.test(own, self.discs[entries])
            inner = ~self.leaf[cells]
            rays, cells = expand(rays[inner], self.first[cells[inner]], self.count[cells[inner]])


def _meets(segments: Segments, rays: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Whether rays meet boxes before their end: slab test in double precision."""
    origin, direction = (a[rays].astype(np.float64) for a in (segments.origin, segments.direction))
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / direction
        one, other = (low - origin) * inverse, (high - origin) * inverse
    # A ray within a slab's plane gives NaN there, which fmin and fmax ignore.
    enter = np.fmax.reduce(np.fmin(one, other), axis=1)
    leave = np.fmin.reduce(np.fmax(one, other), axis=1)
    return (enter <= leave) & (leave >= 0) & (enter <= segments.length[rays])


def octree(samples: Samples) -> DiscTree:
    """Build an octree: cells are halved along all axes, down to the width of a disc (paper, eq. 9).

    Parameters
    ----------
    samples : Samples with radii
    """
    smallest = 2 * float(samples.radius.max())

    def split(cell: Cell, low: np.ndarray, high: np.ndarray) -> Sequence[Cell] | None:
        size = cell[1] - cell[0]
        if len(low) <= LEAF_DISCS or size.max() <= smallest:
            return None
        half = size / 2
        corners = [cell[0] + half * (np.arange(8)[k] >> np.arange(3) & 1) for k in range(8)]
        return [(corner, corner + half) for corner in corners]

    return _build(samples, split)


def kd_tree(samples: Samples) -> DiscTree:
    """Build a kd-tree: a cell is cut by the plane of least cost by the surface-area heuristic, if any pays.

    Parameters
    ----------
    samples : Samples with radii
    """

    def split(cell: Cell, low: np.ndarray, high: np.ndarray) -> Sequence[Cell] | None:
        if len(low) <= LEAF_DISCS:
            return None
        best, chosen = float(len(low)), None
        size = cell[1] - cell[0]
        for axis in range(3):
            share = np.arange(1, PLANES + 1) / (PLANES + 1)
            places = cell[0][axis] + share * size[axis]
            left = np.searchsorted(np.sort(low[:, axis]), places, side="right")
            right = len(low) - np.searchsorted(np.sort(high[:, axis]), places, side="left")
            cap = float(
                np.delete(size, axis).prod()
            )  # half area of the two faces across the axis; the cut divides the other four
            around = float(size[axis] * np.delete(size, axis).sum())
            costs = 2 * STEP_COST + ((cap + share * around) * left + (cap + (1 - share) * around) * right) / (
                cap + around
            )
            cheapest = int(costs.argmin())
            if costs[cheapest] < best:
                best, chosen = float(costs[cheapest]), _cut(cell, axis, places[cheapest])
        return chosen

    return _build(samples, split)


def _cut(cell: Cell, axis: int, place: float) -> list[Cell]:
    upper, lower = cell[1].copy(), cell[0].copy()
    upper[axis] = lower[axis] = place
    return [(cell[0], upper), (lower, cell[1])]


def _build(samples: Samples, split: Split) -> DiscTree:
    """Build the tree breadth first, so that the children of a cell are adjacent."""
    low, high = disc_boxes(samples)
    cells: list[Cell] = [(low.min(axis=0), high.max(axis=0))]
    members = [np.arange(len(samples))]
    first, count, leaf, entries = [], [], [], []
    filled = 0
    for number, cell in enumerate(cells):  # `cells` grows during the loop
        own = members[number]
        children = split(cell, low[own], high[own])
        leaf.append(children is None)
        if children is None:
            first.append(filled)
            count.append(len(own))
            entries.append(own)
            filled += len(own)
            continue
        full = [
            (child, own[((low[own] <= child[1]) & (high[own] >= child[0])).all(axis=1)]) for child in children
        ]
        full = [(child, inside) for child, inside in full if len(inside)]
        first.append(len(cells))
        count.append(len(full))
        cells += [child for child, _ in full]
        members += [inside for _, inside in full]
    corners: np.ndarray = np.array(cells)
    ranges = np.array(first), np.array(count)
    return DiscTree(corners[:, 0], corners[:, 1], *ranges, np.array(leaf), np.concatenate(entries))
