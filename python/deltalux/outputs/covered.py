# SPDX-License-Identifier: Apache-2.0
"""Samples that nobody can see, because something stands on them; what a picture shows in their place."""

from __future__ import annotations

import numpy as np

from .view import Surfaces

DIRECTIONS = 12
LIFT = 1e-3  # of the spacing; where a ray leaves the surface
CONTACT = 0.1  # of the spacing; a gap this narrow counts as closed


def covered_samples(surfaces: Surfaces) -> np.ndarray:
    """Find samples under a bookcase, behind a frame, inside a column.

    Returns
    -------
    (n,) bool: every ray from the sample soon meets something, or meets it from behind.
    """
    display = surfaces.display
    points, normals = display.world(surfaces.scene, surfaces.poses, samples=True)
    tangent = np.cross(normals, np.where(np.abs(normals[:, :1]) < 0.7, [1.0, 0, 0], [0, 1.0, 0]))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    bitangent = np.cross(normals, tangent)
    origins = points + LIFT * display.spacing * normals
    open_to_view = np.zeros(len(points), dtype=bool)
    for index in range(DIRECTIONS):
        left = np.flatnonzero(~open_to_view)
        share, turn = (index + 0.5) / DIRECTIONS, 2.399963 * index  # the golden angle
        across, up = np.sqrt(share), np.sqrt(1 - share)
        direction = (
            across * (np.cos(turn) * tangent[left] + np.sin(turn) * bitangent[left]) + up * normals[left]
        )
        hits = surfaces.intersect(origins[left], direction)
        open_to_view[left] = ~hits.hit | (hits.facing & (hits.distance > CONTACT * display.spacing))
    return ~open_to_view


def shown_values(surfaces: Surfaces, values: np.ndarray) -> np.ndarray:
    """Values (n, c) with those of covered samples at the rim replaced by the mean of their open neighbours.

    A triangle that is half under a bookcase would else fade to black before it reaches it.
    """
    covered = covered_samples(surfaces)
    triangles = surfaces.display.triangles
    start, end = triangles.ravel(), triangles[:, (1, 2, 0)].ravel()
    start, end = np.r_[start, end], np.r_[end, start]
    rim = covered[end] & ~covered[start]
    start, end = start[rim], end[rim]
    count = np.bincount(end, minlength=len(values))[:, None]
    total = np.stack([np.bincount(end, v[start], minlength=len(values)) for v in values.T], axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), values)
