# SPDX-License-Identifier: Apache-2.0
"""What a camera ray shows: the first surface that is not mainly transparent, dimmed by those before it."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from deltalux.mesh.surfaces import Hits, Surfaces
from deltalux.scene import Material, PaneSurface

from .textures import ShownTextures

MOST_PASSED = 32  # surfaces along a ray
BEHIND = 1e-5  # of the scene's size and of the distance: how far behind a surface a ray goes on


def lets_see(material: Material) -> bool:
    """Whether light may pass the material straight somewhere."""
    cut_out = material.look.alpha_mode == "MASK" and material.look.colour is not None
    return cut_out or isinstance(material.surface, PaneSurface)


class SeeThrough:
    """Casts camera rays; those that meet holes, or panes that pass more than they scatter, go on behind.

    Panes show neither what they mirror nor, where rays go on, what they scatter.
    """

    def __init__(self, surfaces: Surfaces, textures: ShownTextures) -> None:
        self._surfaces, self._textures = surfaces, textures
        self._transparent = [lets_see(material) for material in surfaces.scene.materials]
        low, high = surfaces.bounds
        self._size = float(np.linalg.norm(high - low))

    @property
    def any(self) -> bool:
        """Whether rays may go on at all."""
        return any(self._transparent)

    def __call__(self, origins: np.ndarray, directions: np.ndarray) -> tuple[Hits, np.ndarray]:
        """Hits of rays, (k, 3) each, and the share (k,) of the light from there that arrives."""
        hits = self._surfaces.intersect(origins, directions)
        passed = np.ones(len(origins))
        rows = np.arange(len(origins)) if self.any else np.zeros(0, np.int64)
        for _ in range(MOST_PASSED):
            own = _rows_of(hits, rows)
            share, goes_on = self._passing(own, directions[rows])
            passed[rows] *= share
            rows, own = rows[goes_on], _rows_of(own, goes_on)
            if not len(rows):
                break
            begin = own.distance + BEHIND * (self._size + own.distance)
            start = origins[rows] + begin[:, None] * directions[rows]
            behind = self._surfaces.intersect(start, directions[rows])
            behind.distance[:] += begin
            for field in fields(Hits):
                getattr(hits, field.name)[rows] = getattr(behind, field.name)
        return hits, passed

    def _passing(self, hits: Hits, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Whether rays go on where they hit (k,); the share (k,) that passes then, else that is scattered."""
        display = self._surfaces.display
        material = np.where(hits.hit, display.triangle_material[hits.triangle], -1)
        share, scattered = np.zeros(len(material)), np.ones(len(material))
        for number in np.flatnonzero(self._transparent):
            own = np.flatnonzero(material == number)
            if not len(own):
                continue
            surface = self._surfaces.scene.materials[number].surface
            opacity = self._textures.opacity(int(number), hits.triangle[own], hits.weights[own])
            if isinstance(surface, PaneSurface):
                normal = self._surfaces.normals[hits.triangle[own]]
                cosine = np.abs(np.einsum("kx,kx->k", directions[own], normal))
                share[own], scattered[own] = surface.shares(cosine, opacity)
            else:
                share[own], scattered[own] = 1 - opacity, opacity
        goes_on = (share >= scattered) & hits.hit
        return np.where(goes_on, share, scattered), goes_on


def _rows_of(hits: Hits, rows: np.ndarray) -> Hits:
    return Hits(*(getattr(hits, field.name)[rows] for field in fields(Hits)))
