# SPDX-License-Identifier: Apache-2.0
"""A camera's view of a display mesh: rays are cast once, and values shaded as often as needed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from deltalux.mesh.surfaces import Hits, Surfaces
from deltalux.scene import Camera

from .see_through import SeeThrough
from .textures import ShownTextures

BATCH = 1 << 18  # rays at a time, to bound memory


def camera_rays(
    camera: Camera, size: tuple[int, int], x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions, each (k, 3), through image positions x, y in pixels from the top left."""
    width, height = size
    pose = np.asarray(camera.pose, dtype=np.float64)
    if camera.height is not None:
        scale = camera.height / height
        across = np.stack([(x - width / 2) * scale, (height / 2 - y) * scale], axis=1)
        return across @ pose[:3, :2].T + pose[:3, 3], np.broadcast_to(-pose[:3, 2], (len(x), 3))
    scale = np.tan(camera.vertical_fov / 2) * 2 / height
    local = np.stack([(x - width / 2) * scale, (height / 2 - y) * scale, np.full(len(x), -1.0)], axis=1)
    directions = local @ pose[:3, :3].T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.broadcast_to(pose[:3, 3], directions.shape), directions


def covered_width(surfaces: Surfaces, width: np.ndarray, hits: Hits, directions: np.ndarray) -> np.ndarray:
    """(k,) metres that a pixel covers along a side where a ray hits; `width` is that of what faces it.

    A pixel covers more of what it sees aslant: as much as if it were wider on all sides.
    """
    normal = surfaces.normals[np.maximum(hits.triangle, 0)]
    aslant = np.abs(np.einsum("kx,kx->k", directions, normal))
    return width / np.sqrt(np.maximum(aslant, 0.01))


class View:
    """The surfaces that a camera sees, with several rays per pixel.

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
        textured = any(material.look.textures for material in surfaces.scene.materials)
        self.textures = ShownTextures(surfaces)
        see_through = SeeThrough(surfaces, self.textures)
        batches, widths, shares = [], [], []
        for origins, directions in self._rays():
            hits, passed = see_through(origins, directions)
            batches.append(hits)
            shares.append(passed)
            if textured:
                width = camera.pixel_width(size[1], np.where(hits.hit, hits.distance, np.inf))
                widths.append(covered_width(surfaces, width, hits, directions).astype(np.float32))
        self.triangle = np.concatenate([h.triangle for h in batches])
        self.weights = np.concatenate([h.weights.astype(np.float32) for h in batches])
        self.facing = np.concatenate([h.facing for h in batches])
        self.passed = np.concatenate(shares)  # share of the light from there that surfaces let pass
        # see `covered_width`; None: there are no textures, which alone need it
        self.width = np.concatenate(widths) if textured else None

    def values(self, per_vertex: np.ndarray) -> np.ndarray:
        """Interpolate vertex values (n,) or (n, c): one per ray, NaN on sides without samples."""
        corners = self.surfaces.display.triangles[self.triangle[self.facing]]
        weights = self.weights[self.facing]
        result = np.full((len(self.triangle), *per_vertex.shape[1:]), np.nan)
        trailing = (-1,) + (1,) * (per_vertex.ndim - 1)
        result[self.facing] = sum(
            weights[:, i].reshape(trailing) * per_vertex[corners[:, i]] for i in range(3)
        )
        return result

    def pixels(self, colours: np.ndarray) -> np.ndarray:
        """Mean colour (rays, c) of each pixel's rays: (height, width, c)."""
        width, height = self.size
        return colours.reshape(height, width, self.rays_per_pixel, -1).mean(axis=2)

    def seams(self) -> tuple[np.ndarray, np.ndarray]:
        """Whether a pixel's right or lower neighbour shows another surface: (h, w - 1), (h - 1, w) bool."""
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
    """Well distributed places in a pixel: Hammersley points, (count, 2)."""
    index = np.arange(count)
    inverse = sum(((index >> bit) & 1) * 0.5 ** (bit + 1) for bit in range(8))
    rank = np.argsort(np.argsort(inverse))
    return np.stack([(index + 0.5) / count, (rank + 0.5) / count], axis=1)
