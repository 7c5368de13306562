# SPDX-License-Identifier: Apache-2.0
"""Adds direct light at vertices that refine shadows to interpolated values of a display mesh."""

from __future__ import annotations

import numpy as np

from .display_mesh import DisplayMesh


def add_detail(values: np.ndarray, display: DisplayMesh, beyond: np.ndarray | None) -> np.ndarray:
    """Values (n, c) at the vertices; changes the first three columns in place.

    Parameters
    ----------
    beyond : (d, 3) or None, values to add at `display.detail`: see `Session.direct_beyond_samples`
    """
    if beyond is not None and display.detail is not None:
        values[display.detail, :3] = np.maximum(0.0, values[display.detail, :3] + beyond)
    return values
