# SPDX-License-Identifier: Apache-2.0
"""Cameras: views for pictures, perspective or orthographic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Camera:
    """A view: perspective or, with `height`, orthographic.

    Parameters
    ----------
    name : str
    pose : 4x4 rigid matrix, camera to world; the camera looks along -Z, Y is up
    vertical_fov : radians; ignored in an orthographic view
    height : metres from the lower to the upper edge of an orthographic view, None = perspective
    aspect : width / height of the view in its file, None = the picture's
    near, far : metres, where viewers clip; None = no clipping. Deltalux's own pictures do not clip.
    """

    name: str
    pose: Any
    vertical_fov: float = 0.9
    height: float | None = None
    aspect: float | None = None
    near: float = 0.01
    far: float | None = None

    def pixel_width(self, rows: int, depth: np.ndarray) -> np.ndarray:
        """(k,) metres, width of a pixel of a picture with so many rows, at distances (k,) from the camera."""
        if self.height is not None:
            return np.full(np.shape(depth), self.height / rows)
        return 2 * np.tan(self.vertical_fov / 2) / rows * depth
