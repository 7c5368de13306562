# SPDX-License-Identifier: Apache-2.0
"""Light at vertices of a display mesh that refine shadows: direct light of their own."""

from __future__ import annotations

import numpy as np

from .display_mesh import DisplayMesh


def add_detail(values: np.ndarray, display: DisplayMesh, beyond: np.ndarray | None) -> np.ndarray:
    """Values (n, c) of the vertices, the first three columns changed in place.

    Parameters
    ----------
    beyond : (d, 3) or None, what is added at `display.detail`: see `Session.direct_beyond_samples`
    """
    if beyond is not None and display.detail is not None:
        values[display.detail, :3] = np.maximum(0.0, values[display.detail, :3] + beyond)
    return values
