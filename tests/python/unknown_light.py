# SPDX-License-Identifier: Apache-2.0
"""Closed rooms in which an edit brings light to places that the bake did not know."""

from __future__ import annotations

from collections.abc import Callable

import deltalux as dl
import numpy as np
from rooms import box, translation

MATERIALS = [
    dl.Material("wall", (0.75, 0.7, 0.65)),
    dl.Material("floor", (0.25, 0.25, 0.2)),
    dl.Material("wood", (0.45, 0.3, 0.2)),
    dl.Material("dim", (0, 0, 0), (1.5,) * 3),
    dl.Material("strong", (0, 0, 0), (500,) * 3),
]
Case = tuple[dl.Scene, dl.Samples, Callable[[dl.Session], object]]


def places(size: np.ndarray, count: int, seed: int) -> dl.Samples:
    """Points on the inner sides of a box that stands on y = 0."""
    rng = np.random.default_rng(seed)
    low, high = np.array([-size[0] / 2, 0, -size[2] / 2]), np.array([size[0] / 2, size[1], size[2] / 2])
    points, normals = rng.uniform(low, high, (count, 3)), np.zeros((count, 3))
    axis, upper = rng.integers(0, 3, count), rng.integers(0, 2, count)
    every = np.arange(count)
    points[every, axis] = np.where(upper, high[axis], low[axis])
    normals[every, axis] = 1 - 2 * upper
    return dl.Samples(points, normals)


def shell(size: np.ndarray) -> list[dl.Mesh]:
    """A closed room with a dim panel under its ceiling."""
    vertices, triangles = box(size, (0, size[1] / 2, 0), inward=True)
    on_floor = vertices[triangles][:, :, 1].max(axis=1) < 1e-9
    y = size[1] - 0.01
    panel = np.array([(-0.3, y, -0.3), (0.3, y, -0.3), (0.3, y, 0.3), (-0.3, y, 0.3)])
    return [
        dl.Mesh("walls", vertices, triangles, ("wall", "floor"), material_index=on_floor.astype(int)),
        dl.Mesh("panel", panel, [(0, 1, 2), (0, 2, 3)], "dim"),
    ]


def sconce_moves(size: np.ndarray) -> Case:
    """A strong lamp at one wall goes to another: its pool on the wall was not known."""
    lamp = box((0.2, 0.1, 0.08))
    before = translation(0.3 * size[0], 0.6 * size[1], -size[2] / 2 + 0.05)
    after = translation(-0.25 * size[0], 0.5 * size[1], size[2] / 2 - 0.05)
    scene = dl.Scene([*shell(size), dl.Mesh("sconce", *lamp, "strong", pose=before, movable=True)], MATERIALS)
    return scene, places(size, 400, 3), lambda session: session.move("sconce", after)
