# SPDX-License-Identifier: Apache-2.0
"""Lit surfaces as one-sided triangles, and segments as hits, for the gather methods."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux import _core
from deltalux.errors import OptionError
from deltalux.mesh.display_mesh import BACK, COPLANAR_ANGLE, FRONT, weld
from deltalux.mesh.smoothing import shared_edges, smoothing_groups
from deltalux.mesh.surfaces import NOTHING
from deltalux.samples.lit_sides import lit_sides
from deltalux.scene import Scene
from deltalux.segments import Segments
from deltalux.vectors import normals_by_area


def core_surfaces(scene: Any) -> _core.SurfaceTree:
    """Lit sides of all triangles, with meshes in their initial poses.

    Triangles with smooth shading across their common edge form one surface. A sheet that is lit from both
    sides forms two.

    Raises
    ------
    OptionError
        If there is no scene, or none of its triangles has an area.
    """
    if not isinstance(scene, Scene):
        raise OptionError(f"scene: found {scene!r:.40}, expected the scene whose surfaces the segments hit")
    corners, welded, cosine = _triangles(scene)
    cross = normals_by_area(corners)
    size = np.linalg.norm(cross, axis=1)
    # Welding corners can make a triangle degenerate.
    solid = (size > 0) & (welded != welded[:, (1, 2, 0)]).all(axis=1)
    if not solid.any():
        raise OptionError("scene: found no triangle with an area, expected at least one")
    sides = lit_sides(scene)
    front, back = (np.flatnonzero(solid & (sides & side > 0)) for side in (FRONT, BACK))
    order = np.concatenate([front, back])
    turn = np.where(np.arange(len(order))[:, None] < len(front), (0, 1, 2), (0, 2, 1))
    seen = np.take_along_axis(welded[order], turn, axis=1)
    normal = (cross / np.maximum(size, 1e-300)[:, None])[order]
    normal[len(front) :] *= -1
    one, two = (edge // 3 for edge in shared_edges(seen, int(welded.max()) + 1))
    smooth = np.einsum("ij,ij->i", normal[one], normal[two]) >= cosine[order][one]
    surface = smoothing_groups((one[smooth], two[smooth]), len(order))
    placed = np.take_along_axis(corners[order], turn[:, :, None], axis=1)
    return _core.SurfaceTree(np.ascontiguousarray(placed.reshape(-1, 9)), surface.astype(np.uint32))


def _triangles(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners in the world (m, 3, 3), numbers of welded vertices (m, 3), cosines of smooth angles (m,)."""
    if not any(len(mesh.triangles) for mesh in scene.meshes):
        raise OptionError("scene: found no triangles, expected at least one")
    corners = np.concatenate([mesh.world_vertices[mesh.triangles] for mesh in scene.meshes])
    angle = [max(mesh.smooth_angle, COPLANAR_ANGLE) for mesh in scene.meshes]
    cosine = np.repeat(np.cos(np.radians(angle)), [len(mesh.triangles) for mesh in scene.meshes])
    return corners, weld(scene)[1], cosine


def core_hits(segments: Segments) -> _core.SegmentArrays:
    """The segments in the core; segments without a hit have infinite length."""
    length = segments.length
    if segments.primitive is not None:  # traced segments that leave the scene end at its bounds
        length = np.where(segments.primitive == NOTHING, np.float32(np.inf), length)
    return _core.SegmentArrays(
        np.ascontiguousarray(segments.origin, np.float32),
        segments.direction,
        length,
        segments.extended,
        segments.quanta,
    )
