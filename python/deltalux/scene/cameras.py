# SPDX-License-Identifier: Apache-2.0
"""Cameras: where a picture is taken from, by perspective or parallel rays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Camera:
    """A view, in perspective or, with `height`, orthographic.

    Parameters
    ----------
    name : str
    pose : 4x4 rigid matrix, camera to world; it looks along -Z, Y is up
    vertical_fov : radians; means nothing in an orthographic view
    height : metres from the lower edge of an orthographic view to the upper one, None = perspective
    aspect : width / height of the view as its file has it, None = that of the picture
    near, far : metres, where viewers clip; None = nowhere. Pictures of Deltalux show everything.
    """

    name: str
    pose: Any
    vertical_fov: float = 0.9
    height: float | None = None
    aspect: float | None = None
    near: float = 0.01
    far: float | None = None

    def pixel_width(self, rows: int, depth: np.ndarray) -> np.ndarray:
        """(k,) metres across a pixel of a picture of so many rows, at distances (k,) from the camera."""
        if self.height is not None:
            return np.full(np.shape(depth), self.height / rows)
        return 2 * np.tan(self.vertical_fov / 2) / rows * depth
