# SPDX-License-Identifier: Apache-2.0
"""A display mesh in world space, ready for ray casting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux import _core
from deltalux.scene import Scene

from .covered_places import Cover
from .display_mesh import DisplayMesh, Poses

NOTHING = 0xFFFFFFFF
# The two sides of a sheet are two triangles in the same place; their distances differ by rounding.
SAME_PLACE = 1e-4

CasterType = Callable[[np.ndarray, np.ndarray, int], Any]


def core_caster(vertices: np.ndarray, triangles: np.ndarray, threads: int) -> Any:
    """The core's ray caster."""
    return _core.RayCaster(vertices, triangles, threads)


@dataclass(frozen=True, eq=False)
class Hits:
    """First hits of k rays.

    Parameters
    ----------
    triangle : (k,) int64, index into the display mesh's triangles, -1 = none
    weights : (k, 3), barycentric
    distance : (k,)
    facing : (k,) bool, whether the ray hits the sampled side
    """

    triangle: np.ndarray
    weights: np.ndarray
    distance: np.ndarray
    facing: np.ndarray

    @property
    def hit(self) -> np.ndarray:
        """(k,) bool: whether the ray hit a surface."""
        return self.triangle >= 0


class Surfaces:
    """A display mesh in world space, ready for ray casting.

    Parameters
    ----------
    scene : Scene
    display : DisplayMesh
    poses : poses of movables, see `DisplayMesh.world`
    threads : int, 0 = all
    caster : function that makes a ray caster; the core's unless a test replaces it
    """

    def __init__(
        self,
        scene: Scene,
        display: DisplayMesh,
        poses: Poses | None = None,
        threads: int = 0,
        caster: CasterType = core_caster,
    ) -> None:
        self.scene, self.display, self.poses = scene, display, poses
        self.points, _ = display.world(scene, poses)
        present = display.present(scene, poses)
        cross = np.asarray(_core.normals_by_area(self.points, display.triangles))
        size = np.linalg.norm(cross, axis=1)
        self.area = 0.5 * size * present
        self.normals = cross / np.maximum(size, 1e-300)[:, None]
        used = self.points[display.triangles[present].ravel()]
        self.bounds = (used.min(axis=0), used.max(axis=0)) if len(used) else (np.zeros(3), np.ones(3))
        self._origin = scene.frame.origin
        vertices = (self.points - self._origin).astype(np.float32)
        self._casters = []
        for chosen in (present & ~display.reversed, present & display.reversed):
            numbers = np.flatnonzero(chosen)
            if len(numbers):
                faces = display.triangles[numbers].astype(np.uint32)
                self._casters.append((numbers, caster(vertices, faces, threads)))

    @property
    def cover(self) -> Cover:
        """These surfaces as a `Cover`, to find covered places."""
        return Cover([caster for _, caster in self._casters], self._origin, self.display.spacing)

    def intersect(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """First hits of rays, each (k, 3)."""
        nearest: Hits | None = None
        for numbers, caster in self._casters:
            hits = self._hits(numbers, caster, origins, directions)
            nearest = hits if nearest is None else _nearer(nearest, hits)
        if nearest is None:
            count = len(origins)
            nothing = np.full(count, -1), np.zeros((count, 3)), np.full(count, np.inf)
            return Hits(*nothing, np.zeros(count, dtype=bool))
        return nearest

    def emission(self, triangle: np.ndarray, facing: np.ndarray) -> np.ndarray:
        """Radiance (k, 3) that surfaces emit towards the ray origins.

        Parameters
        ----------
        triangle, facing : as of `Hits`
        """
        materials = self.scene.materials
        material = self.display.triangle_material[triangle]
        front = facing != self.display.reversed[triangle]
        glows = (triangle >= 0) & (front | np.array([m.two_sided for m in materials])[material])
        return np.array([m.emission for m in materials])[material] * glows[:, None]

    def _hits(self, numbers: np.ndarray, caster: Any, origins: np.ndarray, directions: np.ndarray) -> Hits:
        t, primitive, u, v = caster.intersect(
            np.ascontiguousarray(origins - self._origin, dtype=np.float32),
            np.ascontiguousarray(directions, dtype=np.float32),
        )
        hit = primitive != NOTHING
        triangle = np.where(hit, numbers[np.where(hit, primitive, 0)], -1)
        u, v = u.astype(np.float64), v.astype(np.float64)
        facing = hit & (np.einsum("ij,ij->i", directions, self.normals[triangle]) < 0)
        distance = np.where(hit, t.astype(np.float64), np.inf)
        return Hits(triangle, np.stack([1 - u - v, u, v], axis=1), distance, facing)


def _nearer(one: Hits, two: Hits) -> Hits:
    with np.errstate(invalid="ignore"):
        together = np.abs(one.distance - two.distance) <= SAME_PLACE * one.distance
    take_two = np.where(together & (one.facing != two.facing), two.facing, two.distance < one.distance)
    return Hits(
        *(
            np.where(take_two if a.ndim == 1 else take_two[:, None], b, a)
            for a, b in (
                (one.triangle, two.triangle),
                (one.weights, two.weights),
                (one.distance, two.distance),
                (one.facing, two.facing),
            )
        )
    )
