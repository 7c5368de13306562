# SPDX-License-Identifier: Apache-2.0
"""Which samples the vertices of a display mesh take their light from, where they do not have their own."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

NEIGHBOURS = 4  # samples that a vertex takes its light from


@dataclass(frozen=True, eq=False)
class Sharing:
    """Which samples the n vertices of a display mesh take their light from.

    Parameters
    ----------
    vertices : (s,) int64, ascending: those at which the s samples are
    samples : (n, 4) int32, numbers of samples
    weights : (n, 4) float32, at least 0; each row adds up to 1
    """

    vertices: np.ndarray
    samples: np.ndarray
    weights: np.ndarray

    @cached_property
    def _matrix(self) -> csr_matrix:
        count = len(self.samples)
        rows = np.arange(0, count * NEIGHBOURS + 1, NEIGHBOURS)
        shape = (count, len(self.vertices))
        return csr_matrix((self.weights.ravel(), self.samples.ravel(), rows), shape=shape)

    def at_vertices(self, values: np.ndarray) -> np.ndarray:
        """Values (s, c) or (s,) of the samples as the vertices get them: (n, c) or (n,)."""
        return self._matrix @ values

    def of_samples(self, values: np.ndarray) -> np.ndarray:
        """Shares (s,) of quantities (n,) of the vertices, as their areas, so that all of them add up."""
        shares = (self.weights.astype(np.float64) * values[:, None]).ravel()
        return np.bincount(self.samples.ravel(), shares, minlength=len(self.vertices))
