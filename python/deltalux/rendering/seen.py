# SPDX-License-Identifier: Apache-2.0
"""What a camera sees through each of many image positions: places, normals, materials."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from deltalux.mesh.surfaces import Surfaces
from deltalux.outputs.view import BATCH, camera_rays
from deltalux.scene import Camera

SAME_NORMAL = 0.9  # cosine between the normals of places that lend each other light
OFF_PLANE = 0.15  # of their distance, how far one may lie off the other's plane


@dataclass(frozen=True, eq=False)
class Seen:
    """First surfaces along k camera rays.

    Parameters
    ----------
    hit : (k,) bool; what follows means nothing where it is False
    point, normal : (k, 3), world; the normal as smoothed, on the camera's side
    width : (k,) metres, of a pixel there
    mesh, material : (k,) int, index into the scene's lists
    emission : (k, 3) radiance that it sends towards the camera
    """

    hit: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    width: np.ndarray
    mesh: np.ndarray
    material: np.ndarray
    emission: np.ndarray

    def __len__(self) -> int:
        return len(self.hit)

    def at(self, chosen: np.ndarray) -> Seen:
        """Those of an index or mask."""
        return Seen(*(getattr(self, f.name)[chosen] for f in fields(self)))

    @classmethod
    def joined(cls, parts: list[Seen]) -> Seen:
        """Return one after the other."""
        return cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))


def look(surfaces: Surfaces, camera: Camera, size: tuple[int, int], x: np.ndarray, y: np.ndarray) -> Seen:
    """What `camera` sees through image positions (k,) in pixels from the top left of `size`."""
    _, vertex_normals = surfaces.display.world(surfaces.scene, surfaces.poses)
    batches = [slice(i, i + BATCH) for i in range(0, max(len(x), 1), BATCH)]
    return Seen.joined([_look(surfaces, vertex_normals, camera, size, x[b], y[b]) for b in batches])


def _look(
    surfaces: Surfaces, vertex_normals: np.ndarray, camera: Camera, size: tuple[int, int],
    x: np.ndarray, y: np.ndarray,
) -> Seen:  # fmt: skip
    display = surfaces.display
    origins, directions = camera_rays(camera, size, x, y)
    hits = surfaces.intersect(origins, directions)
    triangle = np.maximum(hits.triangle, 0)
    corners = display.triangles[triangle]
    point = np.einsum("kc,kcx->kx", hits.weights, surfaces.points[corners])
    normal = np.einsum("kc,kcx->kx", hits.weights, vertex_normals[corners])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    flat = surfaces.normals[triangle]
    # Where normals of corners cancel each other out, that of the triangle is left.
    normal = np.where((np.einsum("kx,kx->k", normal, flat) > 0)[:, None], normal, flat)
    normal[~hits.facing] *= -1
    depth = np.where(hits.hit, hits.distance, np.inf)
    width = camera.pixel_width(size[1], depth)
    return Seen(
        hits.hit, point, normal, width, display.triangle_mesh[triangle], display.triangle_material[triangle],
        surfaces.emission(hits.triangle, hits.facing),
    )  # fmt: skip


def neighbours(size: tuple[int, int]) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Numbers of the pixels that lie side by side, (h, w - 1) each, and one below the other, (h - 1, w)."""
    width, height = size
    number = np.arange(width * height).reshape(height, width)
    return (number[:, :-1], number[:, 1:]), (number[:-1], number[1:])


def alike(one: Seen, two: Seen) -> np.ndarray:
    """(k,) bool: places on one smooth surface, pair by pair, so that light between them hardly jumps."""
    apart = two.point - one.point
    mean = one.normal + two.normal
    off = np.abs(np.einsum("kx,kx->k", apart, mean)) / 2
    distance = np.linalg.norm(apart, axis=1)
    near = off <= OFF_PLANE * distance + 0.25 * np.minimum(one.width, two.width)
    same = np.einsum("kx,kx->k", one.normal, two.normal) >= SAME_NORMAL
    return one.hit & two.hit & near & same
