# SPDX-License-Identifier: Apache-2.0
"""Tests whether points lie inside or behind walls and furniture, or close to them at their own height."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .mesh.display_mesh import BACK, BOTH, FRONT
from .mesh.surfaces import NOTHING, core_caster
from .samples.lit_sides import lit_sides
from .scene import Scene
from .vectors import normals_by_area

DIRECTIONS = 64
HEADINGS = 48  # directions around a point, every 7.5 degrees
# least share of lit sides among the surfaces visible from a point outside; inside a box on a lit floor it is
# a sixth
OUTSIDE = 0.5
_BATCH = 1 << 16  # points whose rays are held in memory at a time: 4 million rays


def inside_solids(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Whether points lie inside or behind something: most surfaces visible from there show unlit sides.

    Meshes need not be closed, nor need their fronts face outwards: a pilot of light paths finds the sides
    that light reaches (`deltalux.samples.lit_sides`). In a scene without light no point is inside.

    Parameters
    ----------
    scene : Scene, movables as loaded
    points : (n, 3), metres

    Returns
    -------
    (n,) bool
    """
    look = _caster(scene)
    if look is None or not scene.groups:
        return np.zeros(len(points), bool)
    sides = lit_sides(scene)
    corners = np.concatenate([m.world_vertices[m.triangles] for m in scene.meshes])
    normals = normals_by_area(corners)
    directions = _around_sphere(DIRECTIONS)

    def is_inside(batch: np.ndarray) -> np.ndarray:
        rays = np.tile(directions, (len(batch), 1))
        triangle, _ = look(np.repeat(batch, DIRECTIONS, axis=0), rays)
        hit = triangle != NOTHING
        met = np.where(hit, triangle, 0).astype(np.int64)
        front = np.einsum("ij,ij->i", rays, normals[met]) < 0
        lit = hit & ((sides[met] == BOTH) | (sides[met] == np.where(front, FRONT, BACK)))
        hits, lit_hits = (some.reshape(-1, DIRECTIONS).sum(axis=1) for some in (hit, lit))
        return lit_hits < OUTSIDE * hits

    return _in_batches(points, is_inside)


def near_walls(scene: Scene, points: np.ndarray, margin: float) -> np.ndarray:
    """Whether a surface lies within `margin` of points, horizontally at their height.

    Parameters
    ----------
    scene : Scene, movables as loaded; Y is up
    points : (n, 3), metres
    margin : metres

    Returns
    -------
    (n,) bool
    """
    look = _caster(scene)
    if look is None:
        return np.zeros(len(points), bool)
    angle = 2 * np.pi * np.arange(HEADINGS) / HEADINGS
    directions = np.stack([np.cos(angle), np.zeros(HEADINGS), np.sin(angle)], axis=1)

    def is_near(batch: np.ndarray) -> np.ndarray:
        triangle, distance = look(np.repeat(batch, HEADINGS, axis=0), np.tile(directions, (len(batch), 1)))
        near = (triangle != NOTHING) & (distance < margin)
        return near.reshape(-1, HEADINGS).any(axis=1)

    return _in_batches(points, is_near)


def _caster(scene: Scene) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None:
    """First hits of rays: triangle among those of all meshes, and distance; None without triangles."""
    if not any(len(m.triangles) for m in scene.meshes):
        return None
    origin = scene.frame.origin
    starts = np.cumsum([0, *(len(m.vertices) for m in scene.meshes)])
    vertices = np.concatenate([m.world_vertices for m in scene.meshes]) - origin
    triangles = np.concatenate([m.triangles + s for m, s in zip(scene.meshes, starts[:-1], strict=True)])
    caster = core_caster(vertices.astype(np.float32), triangles.astype(np.uint32), 0)

    def look(origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        distance, triangle, _, _ = caster.intersect(
            (origins - origin).astype(np.float32), directions.astype(np.float32)
        )
        return triangle, distance

    return look


def _in_batches(points: np.ndarray, judge: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    batches = [judge(points[i : i + _BATCH]) for i in range(0, len(points), _BATCH)]
    return np.concatenate([np.zeros(0, bool), *batches])


def _around_sphere(count: int) -> np.ndarray:
    """(count, 3) unit vectors, evenly distributed (a Fibonacci spiral)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)
