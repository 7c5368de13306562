# SPDX-License-Identifier: Apache-2.0
"""Sharing of samples: the samples that vertices without their own sample are interpolated from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

NEIGHBOURS = 4  # samples that a vertex is interpolated from


@dataclass(frozen=True, eq=False)
class Sharing:
    """The samples that each of the n vertices of a display mesh is interpolated from.

    Parameters
    ----------
    vertices : (s,) int64, ascending: the vertex of each of the s samples
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
        """Values (n, c) or (n,) at the vertices, from values (s, c) or (s,) of the samples."""
        return self._matrix @ values

    def of_samples(self, values: np.ndarray) -> np.ndarray:
        """Distribute quantities (n,) of the vertices, such as areas, to the samples (s,); the sum is kept."""
        shares = (self.weights.astype(np.float64) * values[:, None]).ravel()
        return np.bincount(self.samples.ravel(), shares, minlength=len(self.vertices))
