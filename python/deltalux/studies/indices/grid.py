# SPDX-License-Identifier: Apache-2.0
"""A uniform grid over discs, which rays traverse cell by cell (Amanatides & Woo 1987)."""

from __future__ import annotations

import numpy as np

from deltalux.samples import Samples
from deltalux.segments import Segments

from .counting import RayCosts, Tally, disc_boxes, expand

CELLS_PER_DISC = 2.0


class DiscGrid:
    """Cells of equal size, each with a list of the discs whose boxes overlap it.

    Parameters
    ----------
    samples : Samples with radii
    """

    def __init__(self, samples: Samples) -> None:
        low, high = disc_boxes(samples)
        self._low = low.min(axis=0)
        extent = np.maximum(high.max(axis=0) - self._low, 1e-9)
        side = np.cbrt(extent.prod() / (CELLS_PER_DISC * len(samples)))
        self.shape = np.maximum(1, np.ceil(extent / side)).astype(np.int64)
        self._side = extent / self.shape
        first, last = (self._cell(corner) for corner in (low, high))
        discs, cells = _covered(first, last, self.shape)
        order = np.argsort(cells, kind="stable")
        self._discs = discs[order]
        self._start = np.searchsorted(cells[order], np.arange(self.shape.prod() + 1))

    def _cell(self, points: np.ndarray) -> np.ndarray:
        return np.clip((points - self._low) // self._side, 0, self.shape - 1).astype(np.int64)

    def cast(self, segments: Segments, samples: Samples) -> RayCosts:
        """Traverse the grid with each ray; each visited cell counts as a step.

        Parameters
        ----------
        segments : rays, which end at their first hit
        samples : the samples that the grid was built from
        """
        tally = Tally(segments, samples)
        origin, direction = segments.origin.astype(np.float64), segments.direction.astype(np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / direction
            one, other = (
                (corner - origin) * inverse for corner in (self._low, self._low + self.shape * self._side)
            )
        enter = np.maximum(np.fmax.reduce(np.fmin(one, other), axis=1), 0)
        leave = np.minimum(np.fmin.reduce(np.fmax(one, other), axis=1), segments.length)
        rays = np.flatnonzero(enter <= leave)
        cell = self._cell(origin[rays] + enter[rays, None] * direction[rays])
        ahead = direction[rays] > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            border = (self._low + (cell + ahead) * self._side - origin[rays]) * inverse[rays]
            across = np.abs(self._side * inverse[rays])
        border = np.where(direction[rays] == 0, np.inf, border)
        while len(rays):
            tally.step(rays)
            number = np.ravel_multi_index(tuple(cell.T), tuple(self.shape))
            own, entries = expand(rays, self._start[number], self._start[number + 1] - self._start[number])
            tally.test(own, self._discs[entries])
            axis, row = border.argmin(axis=1), np.arange(len(rays))
            passed = border[row, axis]
            cell[row, axis] += np.where(ahead[row, axis], 1, -1)
            border[row, axis] += across[row, axis]
            inside = (cell[row, axis] >= 0) & (cell[row, axis] < self.shape[axis]) & (passed <= leave[rays])
            rays, cell, ahead, border, across = (a[inside] for a in (rays, cell, ahead, border, across))
        return tally.costs()


def _covered(first: np.ndarray, last: np.ndarray, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of disc and cell number, for all cells from each disc's first to its last."""
    spans = last - first + 1
    discs, place = expand(np.arange(len(first)), np.zeros(len(first), np.int64), spans.prod(axis=1))
    x, rest = np.divmod(place, spans[discs, 1] * spans[discs, 2])
    y, z = np.divmod(rest, spans[discs, 2])
    cells = first[discs] + np.stack([x, y, z], axis=1)
    return discs, np.ravel_multi_index(tuple(cells.T), tuple(shape))
