# SPDX-License-Identifier: Apache-2.0
"""Cameras and luminances of the demonstration scenes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deltalux.scene import Camera
from deltalux.units import photopic

WARM = (1.30, 0.95, 0.55)  # about 3000 K, linear RGB, scaled to photopic 1 in `luminance`
NEUTRAL = (1.08, 1.00, 0.82)  # about 4500 K
COOL = (0.86, 1.00, 1.22)  # overcast sky, about 7500 K


def luminance(cd_per_m2: float, colour: Sequence[float]) -> np.ndarray:
    """(3,) emission with the photopic luminance `cd_per_m2`."""
    rgb = np.array(colour, np.float64)
    return rgb * (cd_per_m2 / photopic(rgb))


def lamp_luminance(lumens: float, area: float, colour: Sequence[float]) -> np.ndarray:
    """(3,) emission of a diffuse lamp of `area` square metres that emits `lumens`."""
    return luminance(lumens / (np.pi * area), colour)


def look_at(name: str, eye: Sequence[float], target: Sequence[float], vertical_fov: float) -> Camera:
    """A camera at `eye` that looks at `target`, upright; `vertical_fov` in degrees."""
    back = np.subtract(eye, target).astype(np.float64)
    back /= np.linalg.norm(back)
    right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    pose[:3, 3] = eye
    return Camera(name, pose, float(np.radians(vertical_fov)))
