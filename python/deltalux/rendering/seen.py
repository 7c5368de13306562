# SPDX-License-Identifier: Apache-2.0
"""Casts camera rays through image positions and returns the places, normals and materials that they hit."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from deltalux.mesh.surfaces import Surfaces
from deltalux.outputs.see_through import SeeThrough
from deltalux.outputs.textures import ShownTextures
from deltalux.outputs.view import BATCH, camera_rays, covered_width
from deltalux.scene import Camera

SAME_NORMAL = 0.9  # least cosine between the normals of places that may share light
OFF_PLANE = 0.15  # how far a place may lie off the other's plane, as a share of their distance


@dataclass(frozen=True, eq=False)
class Seen:
    """First hits of k camera rays.

    Parameters
    ----------
    hit : (k,) bool; the other fields are meaningless where it is False
    point, normal : (k, 3), world; the interpolated shading normal, on the camera's side
    width : (k,) metres, width of a pixel at the hit
    mesh, material : (k,) int, index into the scene's lists
    colour : (k, 3) factor of the texture there on the material's reflectance, 1 without one
    emission : (k, 3) radiance emitted towards the camera
    passed : (k,) share of the light from there that transparent surfaces before it let pass
    """

    hit: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    width: np.ndarray
    mesh: np.ndarray
    material: np.ndarray
    colour: np.ndarray
    emission: np.ndarray
    passed: np.ndarray

    def __len__(self) -> int:
        return len(self.hit)

    def at(self, chosen: np.ndarray) -> Seen:
        """Rows selected by an index or a mask."""
        return Seen(*(getattr(self, f.name)[chosen] for f in fields(self)))

    @classmethod
    def joined(cls, parts: list[Seen]) -> Seen:
        """The rows of all `parts`, one part after the other."""
        return cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))


def look(
    surfaces: Surfaces, textures: ShownTextures, camera: Camera, size: tuple[int, int],
    x: np.ndarray, y: np.ndarray,
) -> Seen:  # fmt: skip
    """Hits of the rays of `camera` through image positions (k,), in pixels from the top left of `size`."""
    _, vertex_normals = surfaces.display.world(surfaces.scene, surfaces.poses)
    batches = [slice(i, i + BATCH) for i in range(0, max(len(x), 1), BATCH)]
    return Seen.joined([_look(surfaces, textures, vertex_normals, camera, size, x[b], y[b]) for b in batches])


def _look(
    surfaces: Surfaces, textures: ShownTextures, vertex_normals: np.ndarray, camera: Camera,
    size: tuple[int, int], x: np.ndarray, y: np.ndarray,
) -> Seen:  # fmt: skip
    display = surfaces.display
    origins, directions = camera_rays(camera, size, x, y)
    hits, passed = SeeThrough(surfaces, textures)(origins, directions)
    triangle = np.maximum(hits.triangle, 0)
    corners = display.triangles[triangle]
    point = np.einsum("kc,kcx->kx", hits.weights, surfaces.points[corners])
    normal = np.einsum("kc,kcx->kx", hits.weights, vertex_normals[corners])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    flat = surfaces.normals[triangle]
    # If the vertex normals cancel out or point to the other side, use the triangle's normal.
    normal = np.where((np.einsum("kx,kx->k", normal, flat) > 0)[:, None], normal, flat)
    normal[~hits.facing] *= -1
    depth = np.where(hits.hit, hits.distance, np.inf)
    width = camera.pixel_width(size[1], depth)
    covered = covered_width(surfaces, width, hits, directions)
    colour, glow = textures.factors(hits.triangle, hits.weights, covered)
    return Seen(
        hits.hit, point, normal, width, display.triangle_mesh[triangle], display.triangle_material[triangle],
        colour, glow * surfaces.emission(hits.triangle, hits.facing), passed,
    )  # fmt: skip


def neighbours(size: tuple[int, int]) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Pixel numbers of pairs side by side, (h, w - 1) each, and of pairs one above the other, (h - 1, w)."""
    width, height = size
    number = np.arange(width * height).reshape(height, width)
    return (number[:, :-1], number[:, 1:]), (number[:-1], number[1:])


def alike(one: Seen, two: Seen) -> np.ndarray:
    """(k,) bool: whether the places of a pair lie on one smooth surface, so that they may share light."""
    apart = two.point - one.point
    mean = one.normal + two.normal
    off = np.abs(np.einsum("kx,kx->k", apart, mean)) / 2
    distance = np.linalg.norm(apart, axis=1)
    near = off <= OFF_PLANE * distance + 0.25 * np.minimum(one.width, two.width)
    same = np.einsum("kx,kx->k", one.normal, two.normal) >= SAME_NORMAL
    return one.hit & two.hit & near & same
