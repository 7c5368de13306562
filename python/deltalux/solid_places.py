# SPDX-License-Identifier: Apache-2.0
"""Tests whether points lie inside or close to walls and furniture, and finds an open place for a lamp."""

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
# Places that open_place() tries: shares of the scene's height, and how many along each side.
HEIGHTS, ACROSS = (0.55, 0.7, 0.82, 0.9), 9
CLEAR = 0.02  # least distance to the nearest surface, as a share of the scene's diagonal
ENCLOSED = 0.4  # least share of rays that meet a surface
FURNISHED = 0.03  # least share of fronts among what is visible within walls that show their backs
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


def open_place(scene: Scene) -> np.ndarray:
    """A place for a lamp: high in the widest space that surfaces enclose, else above the scene.

    Parameters
    ----------
    scene : Scene, movables as loaded; Y is up

    Returns
    -------
    (3,) metres
    """
    low, high = scene.bounds
    diagonal = float(np.linalg.norm(high - low))
    outside = low + (high - low) * (0.7, 1.0, 0.7) + (0, 0.5 * diagonal, 0)
    look = _caster(scene)
    if look is None:
        return outside
    normals = normals_by_area(np.concatenate([m.world_vertices[m.triangles] for m in scene.meshes]))
    shares = (np.arange(ACROSS) + 0.5) / ACROSS
    x, y, z = np.meshgrid(shares, HEIGHTS, shares, indexing="ij")
    places = low + (high - low) * np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    rays = np.tile(_around_sphere(DIRECTIONS), (len(places), 1))
    triangle, distance = (
        found.reshape(-1, DIRECTIONS) for found in look(np.repeat(places, DIRECTIONS, axis=0), rays)
    )
    hit = triangle != NOTHING
    facing = -np.einsum("ij,ij->i", rays, normals[np.where(hit, triangle, 0).ravel()]).reshape(hit.shape)
    clear = np.where(hit, distance, np.inf).min(axis=1) >= CLEAR * diagonal
    hits = np.maximum(hit.sum(axis=1), 1)
    enclosed, front = hit.mean(axis=1), (hit & (facing > 0)).sum(axis=1) / hits
    inside = clear & (enclosed >= ENCLOSED)
    # The walls of some rooms show their backs; then things in the room show that it is no hollow statue.
    fits = next((fit for least in (OUTSIDE, FURNISHED) if (fit := inside & (front >= least)).any()), None)
    if fits is None:
        return outside
    away = np.log(np.where(hit, np.maximum(distance, 1e-30), 1.0)).sum(axis=1) / hits
    spacious = np.exp(away) * enclosed * (0.7 + 0.3 * y.ravel())
    return places[np.argmax(np.where(fits, spacious, -1.0))]


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
