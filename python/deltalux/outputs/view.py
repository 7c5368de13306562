# SPDX-License-Identifier: Apache-2.0
"""What a camera sees of a display mesh: rays cast once, values shaded onto them as often as needed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux.display_mesh import DisplayMesh, Poses
from deltalux.scene import Camera, Scene

NOTHING = 0xFFFFFFFF
# Front and back of one sheet are two triangles in one place; their distances differ by rounding.
SAME_PLACE = 1e-4
BATCH = 1 << 18  # rays at a time, so that memory stays flat

CasterType = Callable[[np.ndarray, np.ndarray, int], Any]


def core_caster(vertices: np.ndarray, triangles: np.ndarray, threads: int) -> Any:
    """The engine's own ray caster."""
    from deltalux._core import RayCaster

    return RayCaster(vertices, triangles, threads)


@dataclass(frozen=True, eq=False)
class Hits:
    """First hits of k rays.

    Parameters
    ----------
    triangle : (k,) int64, index into the display mesh's triangles, -1 = none
    weights : (k, 3), barycentric
    distance : (k,)
    facing : (k,) bool, the ray meets the sampled side
    """

    triangle: np.ndarray
    weights: np.ndarray
    distance: np.ndarray
    facing: np.ndarray

    @property
    def hit(self) -> np.ndarray:
        """(k,) bool: the ray met something."""
        return self.triangle >= 0


class Surfaces:
    """A display mesh in world space, ready for ray casting.

    Parameters
    ----------
    scene : Scene
    display : DisplayMesh
    poses : poses of movables, see `DisplayMesh.world`
    threads : int, 0 = all
    caster : how to make a ray caster; the engine's own unless a test brings another
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
        a, b, c = (self.points[display.triangles[:, i]] for i in range(3))
        cross = np.cross(b - a, c - a)
        self.area = 0.5 * np.linalg.norm(cross, axis=1) * present
        self.normals = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-300)
        used = self.points[display.triangles[present].ravel()]
        self.bounds = (used.min(axis=0), used.max(axis=0)) if len(used) else (np.zeros(3), np.ones(3))
        vertices = self.points.astype(np.float32)
        self._casters = []
        for chosen in (present & ~display.reversed, present & display.reversed):
            numbers = np.flatnonzero(chosen)
            if len(numbers):
                faces = display.triangles[numbers].astype(np.uint32)
                self._casters.append((numbers, caster(vertices, faces, threads)))

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

    def _hits(self, numbers: np.ndarray, caster: Any, origins: np.ndarray, directions: np.ndarray) -> Hits:
        t, primitive, u, v = caster.intersect(
            np.ascontiguousarray(origins, dtype=np.float32),
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


def camera_rays(
    camera: Camera, size: tuple[int, int], x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions, each (k, 3), through image positions x, y in pixels from the top left."""
    width, height = size
    pose = np.asarray(camera.pose, dtype=np.float64)
    scale = np.tan(camera.vertical_fov / 2) * 2 / height
    local = np.stack([(x - width / 2) * scale, (height / 2 - y) * scale, np.full(len(x), -1.0)], axis=1)
    directions = local @ pose[:3, :3].T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.broadcast_to(pose[:3, 3], directions.shape), directions


class View:
    """The surfaces as a camera sees them, several rays per pixel.

    Parameters
    ----------
    surfaces : Surfaces
    camera : Camera
    size : (width, height) in pixels
    rays_per_pixel : int
    """

    def __init__(self, surfaces: Surfaces, camera: Camera, size: tuple[int, int], rays_per_pixel: int = 4):
        self.surfaces, self.camera, self.size = surfaces, camera, size
        self.rays_per_pixel = rays_per_pixel
        batches = [surfaces.intersect(*rays) for rays in self._rays()]
        self.triangle = np.concatenate([h.triangle for h in batches])
        self.weights = np.concatenate([h.weights.astype(np.float32) for h in batches])
        self.facing = np.concatenate([h.facing for h in batches])

    def values(self, per_vertex: np.ndarray) -> np.ndarray:
        """Interpolate (n,) or (n, c) vertex values: one per ray, NaN where unsampled."""
        corners = self.surfaces.display.triangles[self.triangle[self.facing]]
        weights = self.weights[self.facing]
        result = np.full((len(self.triangle), *per_vertex.shape[1:]), np.nan)
        trailing = (-1,) + (1,) * (per_vertex.ndim - 1)
        result[self.facing] = sum(
            weights[:, i].reshape(trailing) * per_vertex[corners[:, i]] for i in range(3)
        )
        return result

    def pixels(self, colours: np.ndarray) -> np.ndarray:
        """Mean of the rays (rays, c) of each pixel: (height, width, c)."""
        width, height = self.size
        return colours.reshape(height, width, self.rays_per_pixel, -1).mean(axis=2)

    def seams(self) -> tuple[np.ndarray, np.ndarray]:
        """Pixels whose right or lower neighbour shows another surface: (h, w - 1) and (h - 1, w) bool."""
        width, height = self.size
        first = self.triangle.reshape(height, width, self.rays_per_pixel)[:, :, 0]
        normals = self.surfaces.normals[first]
        mesh = np.where(first >= 0, self.surfaces.display.triangle_mesh[first], -1)
        right = np.einsum("hwc,hwc->hw", normals[:, 1:], normals[:, :-1]) < 0.9
        below = np.einsum("hwc,hwc->hw", normals[1:], normals[:-1]) < 0.9
        return right | (mesh[:, 1:] != mesh[:, :-1]), below | (mesh[1:] != mesh[:-1])

    def _rays(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        width, height = self.size
        offsets = _pixel_offsets(self.rays_per_pixel)
        rows = max(1, BATCH // (width * self.rays_per_pixel))
        for first in range(0, height, rows):
            y, x, ray = np.meshgrid(
                np.arange(first, min(first + rows, height)), np.arange(width), np.arange(len(offsets)),
                indexing="ij",
            )  # fmt: skip
            x, y = (x + offsets[ray, 0]).ravel(), (y + offsets[ray, 1]).ravel()
            yield camera_rays(self.camera, self.size, x, y)


def _pixel_offsets(count: int) -> np.ndarray:
    """Well spread places in a pixel: Hammersley points, (count, 2)."""
    index = np.arange(count)
    inverse = sum(((index >> bit) & 1) * 0.5 ** (bit + 1) for bit in range(8))
    rank = np.argsort(np.argsort(inverse))
    return np.stack([(index + 0.5) / count, (rank + 0.5) / count], axis=1)
