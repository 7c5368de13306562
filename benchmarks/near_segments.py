# SPDX-License-Identifier: Apache-2.0
"""What a moving object brings to a disc method: segments near it, samples on it."""

from __future__ import annotations

import deltalux as dl
import numpy as np

BATCH = 1_000_000  # paths traced at a time
HITS = 0.75  # discs that a line through the object crosses on each side


class NearSegments:
    """Segments of a scene's paths that meet spheres of all sizes around its middle."""

    def __init__(self, scene: str) -> None:
        self._scene = None if scene == "lines" else getattr(dl.scenes, scene)()
        if self._scene is None:
            self.centre, self.radius = np.zeros(3), 1.0
        else:
            low, high = np.array(self._scene.info()["bounds"])
            self.centre, self.radius = (low + high) / 2, float(np.linalg.norm(high - low) / 2)
        self._batches: dict[int, dl.Segments] = {}

    def _batch(self, paths: int, seed: int) -> dl.Segments:
        if self._scene is None:
            return dl.uniform_lines(paths, seed=seed)
        return dl.trace(self._scene, paths, seed=seed)

    def __call__(self, paths: int, size: float, most: int) -> dl.Segments | None:
        """Segments of so many paths that meet a sphere of this share of the scene; None beyond `most`."""
        parts = []
        for k in range(max(1, paths // BATCH)):
            key = k if paths >= BATCH else -1
            if key not in self._batches:
                self._batches[key] = self._batch(min(paths, BATCH), k + 1)
            segments = self._batches[key]
            parts.append(segments.select(self._meets(segments, size * self.radius)))
            if sum(map(len, parts)) > most:
                return None
        columns = [np.concatenate([getattr(p, c) for p in parts]) for c in ("origin", "direction", "length")]
        return dl.Segments(*columns, 1.0)

    def _meets(self, segments: dl.Segments, radius: float) -> np.ndarray:
        to = self.centre - segments.origin
        along = np.clip((to * segments.direction).sum(axis=1), 0, segments.length)
        nearest = to - segments.direction * along[:, None]
        return (nearest**2).sum(axis=1) <= radius**2

    def samples(self, count: int, size: float) -> dl.Samples:
        """Samples on the object, along a spiral, so that neighbours lie near each other."""
        radius = size * self.radius
        z = 1 - (2 * np.arange(count) + 1) / count
        angle = np.sqrt(4 * np.pi * count) * np.arccos(z)
        flat = np.sqrt(1 - z**2)
        normals = np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
        return dl.Samples(self.centre + radius * normals, normals, radius=radius * np.sqrt(4 * HITS / count))
