# SPDX-License-Identifier: Apache-2.0
"""Random samples for uniform lines: in the unit sphere, and in or on the cube of eq. 4 within it."""

from __future__ import annotations

from typing import Literal

import numpy as np

from deltalux import model
from deltalux.samples import Samples

UNIT_SPHERE = ((0.0, 0.0, 0.0), 1.0)  # centre, radius; holds `uniform_lines`
HALF_SIDE = 1 / np.sqrt(3)
Spread = Literal["volume", "surface"]
SPREADS: tuple[Spread, ...] = ("volume", "surface")
WHERE = {"volume": "in a volume", "surface": "on surfaces"}  # names in texts


def in_sphere(count: int, radius: float, seed: int) -> Samples:
    """Samples with uniform points in the unit sphere and uniform normals (paper 4.2).

    Parameters
    ----------
    count : number of samples
    radius : radius of all discs
    seed : seed of points and normals
    """
    random = np.random.default_rng(seed)
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = directions * np.cbrt(random.random((count, 1)))
    return Samples(points, random.normal(size=(count, 3)), radius)


def in_cube(count: int, spread: Spread, seed: int) -> Samples:
    """Uniform samples in the cube whose corners touch the unit sphere, or on its walls; normals uniform.

    The discs' radius equals the distance between samples (paper 3.1: eq. 5, or the square root of the
    area per sample).

    Parameters
    ----------
    count : number of samples
    spread : "volume" or "surface": where the samples lie
    seed : seed of points and normals
    """
    random = np.random.default_rng(seed)
    points = random.uniform(-HALF_SIDE, HALF_SIDE, (count, 3))
    radius = float(model.grid_spacing(count, 1.0))
    if spread == "surface":
        face = random.integers(0, 6, count)
        points[np.arange(count), face % 3] = np.where(face < 3, -HALF_SIDE, HALF_SIDE)
        radius = float(np.sqrt(model.surfaces.CUBE_WALLS / count))
    return Samples(points, random.normal(size=(count, 3)), radius)
