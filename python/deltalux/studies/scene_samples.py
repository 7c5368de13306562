# SPDX-License-Identifier: Apache-2.0
"""Samples of a scene as the cost model speaks of them: on its surfaces, or in the volume of its bounds."""

from __future__ import annotations

import numpy as np

from deltalux.samples import Samples
from deltalux.scene import Scene


def scene_sphere(scene: Scene) -> tuple[np.ndarray, float]:
    """Centre and radius, metres, of the sphere around the scene's bounding box (paper 2.3, S_0)."""
    low, high = scene.bounds
    return (low + high) / 2, float(np.linalg.norm(high - low)) / 2


def on_surfaces(scene: Scene, vertices: Samples, count: int, radius: float, seed: int) -> Samples:
    """Samples drawn from the vertices of a display mesh, movables as loaded.

    Parameters
    ----------
    scene : Scene
    vertices : of `Samples.on_vertices`
    count : number of samples; at most all vertices
    radius : of all discs, metres
    seed : of the draw
    """
    assert vertices.display is not None  # on_vertices makes one
    points, normals = vertices.display.world(scene, samples=True)
    drawn = np.random.default_rng(seed).choice(len(points), min(count, len(points)), replace=False)
    return Samples(points[drawn], normals[drawn], radius)


def in_bounds(scene: Scene, count: int, radius: float, seed: int) -> Samples:
    """Samples uniform in the scene's bounding box, normals uniform.

    Parameters
    ----------
    scene : Scene
    count : number of samples
    radius : of all discs, metres
    seed : of points and normals
    """
    random = np.random.default_rng(seed)
    low, high = scene.bounds
    return Samples(random.uniform(low, high, (count, 3)), random.normal(size=(count, 3)), radius)
