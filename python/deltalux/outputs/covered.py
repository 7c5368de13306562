# SPDX-License-Identifier: Apache-2.0
"""What pictures show where a sample lies under something else."""

from __future__ import annotations

import numpy as np

from deltalux.clearance import covered_samples
from deltalux.surfaces import Surfaces


def shown_values(surfaces: Surfaces, values: np.ndarray) -> np.ndarray:
    """Values (n, c) with those of covered samples at the rim replaced by the mean of their open neighbours.

    A triangle that is half under a bookcase would else fade to black before it reaches it.
    """
    covered = covered_samples(surfaces)
    triangles = surfaces.display.triangles
    start, end = triangles.ravel(), triangles[:, (1, 2, 0)].ravel()
    start, end = np.r_[start, end], np.r_[end, start]
    rim = covered[end] & ~covered[start]
    start, end = start[rim], end[rim]
    count = np.bincount(end, minlength=len(values))[:, None]
    total = np.stack([np.bincount(end, v[start], minlength=len(values)) for v in values.T], axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), values)
