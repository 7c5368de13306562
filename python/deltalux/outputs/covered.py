# SPDX-License-Identifier: Apache-2.0
"""Values that pictures show where a sample is covered by another surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux.mesh.surfaces import Surfaces
from deltalux.samples.clearance import covered_samples


@dataclass(frozen=True, eq=False)
class RimFill:
    """Replaces values of covered samples by the mean of their open neighbours; computed once, applied often.

    Parameters
    ----------
    filled : (k,) ascending, samples that get a value
    neighbours : (j,) samples that give their values; those of one filled sample are adjacent
    first : (k,) where the neighbours of each filled sample begin
    """

    filled: np.ndarray
    neighbours: np.ndarray
    first: np.ndarray

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """A copy of `values` (n, c) in which the filled samples have the mean of their neighbours."""
        result = values.copy()
        if len(self.filled):
            counts = np.diff(np.r_[self.first, len(self.neighbours)])
            result[self.filled] = np.add.reduceat(values[self.neighbours], self.first) / counts[:, None]
        return result


def rim_fill(covered: np.ndarray, triangles: np.ndarray) -> RimFill:
    """A fill for covered samples (n,) bool that share an edge of the triangles (m, 3) with open ones."""
    start, end = triangles.ravel(), triangles[:, (1, 2, 0)].ravel()
    start, end = np.r_[start, end], np.r_[end, start]
    rim = covered[end] & ~covered[start]
    start, end = start[rim], end[rim]
    order = np.argsort(end, kind="stable")
    filled, first = np.unique(end[order], return_index=True)
    return RimFill(filled, start[order], first)


def shown_values(surfaces: Surfaces, values: np.ndarray) -> np.ndarray:
    """Values (n, c) in which covered samples at the rim have the mean of their open neighbours.

    Otherwise a triangle that lies half under a bookcase would fade to black before reaching it.
    """
    return rim_fill(covered_samples(surfaces), surfaces.display.triangles)(values)
