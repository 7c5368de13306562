# SPDX-License-Identifier: Apache-2.0
"""Samples of a scene as the cost model assumes them: on its surfaces, or in its bounding box."""

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
    vertices : result of `Samples.on_vertices`
    count : number of samples; at most all vertices
    radius : radius of all discs, metres
    seed : seed of the random choice
    """
    assert vertices.display is not None  # on_vertices makes one
    points, normals = vertices.display.world(scene, samples=True)
    drawn = np.random.default_rng(seed).choice(len(points), min(count, len(points)), replace=False)
    return Samples(points[drawn], normals[drawn], radius)


def in_bounds(scene: Scene, count: int, radius: float, seed: int) -> Samples:
    """Uniformly distributed samples in the scene's bounding box, with uniform normals.

    Parameters
    ----------
    scene : Scene
    count : number of samples
    radius : radius of all discs, metres
    seed : seed of points and normals
    """
    random = np.random.default_rng(seed)
    low, high = scene.bounds
    return Samples(random.uniform(low, high, (count, 3)), random.normal(size=(count, 3)), radius)


def uniform_on_surfaces(
    scene: Scene, count: int, seed: int, radius: float | None, *, movables: bool = True
) -> Samples:
    """Area-uniform samples on the front sides; those on movables move with them.

    Parameters
    ----------
    scene : Scene
    count : number of samples
    seed : seed of the points
    radius : radius of all discs, metres; None = automatic
    movables : whether to include their surfaces
    """
    rng = np.random.default_rng(seed)
    meshes = [m for m in scene.meshes if len(m.triangles) and (movables or not m.movable)]
    areas = np.concatenate([m.triangle_areas() for m in meshes])
    owner = np.repeat(np.arange(len(meshes)), [len(m.triangles) for m in meshes])
    local = np.concatenate([np.arange(len(m.triangles)) for m in meshes])
    chosen = rng.choice(len(areas), size=count, p=areas / areas.sum())
    chosen.sort()
    u, v = rng.random((2, count))
    flip = u + v > 1
    u[flip], v[flip] = 1 - u[flip], 1 - v[flip]
    points, normals = np.zeros((count, 3)), np.zeros((count, 3))
    names = np.full(count, None, dtype=object)
    for i, mesh in enumerate(meshes):
        own = np.flatnonzero(owner[chosen] == i)
        corners = mesh.triangles[local[chosen[own]]]
        frame = mesh.vertices if mesh.movable else mesh.world_vertices
        a, b, c = (frame[corners[:, k]] for k in range(3))
        points[own] = a + (b - a) * u[own, None] + (c - a) * v[own, None]
        normals[own] = np.cross(b - a, c - a)
        names[own] = mesh.name if mesh.movable else None
    return Samples(points, normals, radius, names)


def static_distance(scene: Scene, count: int) -> float:
    """Distance between `count` samples on the static surfaces, metres: square root of the area per sample."""
    area = sum(float(m.triangle_areas().sum()) for m in scene.meshes if not m.movable)
    return float(np.sqrt(area / count))
