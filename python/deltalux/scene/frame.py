# SPDX-License-Identifier: Apache-2.0
"""Origin of the core's coordinates: near the geometry, because single precision has only 24 bits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from deltalux.errors import SceneError
from deltalux.units import FARTHEST

FAR = 2.0  # in radii of nine tenths of the vertices: if their median is farther from zero, it is the origin
FAR_LOCAL = 256.0  # the same for a movable's local coordinates
MOST_VERTICES = 100_000  # number of vertices that suffice to find the median
SLACK = 2.0**-19  # offset of rays from surfaces, as a share of the distance from the origin; see the core
COARSE = 0.01  # as a share of a mesh's size: with more slack, the user is warned
TOO_COARSE = 0.5  # with more slack the mesh is refused, unless it is a speck
SPECK = 1e-3  # as a share of the scene: the light that a speck blocks or loses is negligible


class SceneFrame(NamedTuple):
    """The origin of the core's coordinates for a scene, and the size of the scene.

    Parameters
    ----------
    origin : (3,) float64, metres
    radius : half edge of the cube around the centre that contains half of the static vertices, metres
    followed : the meshes that determine the frame; edits do not change them
    """

    origin: np.ndarray
    radius: float
    followed: tuple[Any, ...]


def scene_frame(meshes: Sequence[Any], before: SceneFrame | None = None) -> SceneFrame:
    """Origin: the median of the static vertices if it is far from zero, else zero.

    It depends on the static meshes only (on the first mesh if there are none). If `before`, the frame of
    another scene, has the same ones, it is reused.
    """
    static = tuple(m for m in meshes if not m.movable and len(m.vertices)) or tuple(meshes[:1])
    if before is not None and static == before.followed:  # meshes are equal if they are the same object
        return before
    points = [m.world_vertices for m in static if len(m.vertices)]
    origin, radius = _far_middle(np.concatenate(points), FAR) if points else (np.zeros(3), 0.0)
    origin.setflags(write=False)
    return SceneFrame(origin, radius, static)


def local_origin(mesh: Any) -> np.ndarray:
    """(3,) float64: the median of a movable's vertices if it is far from local zero, else zero."""
    if not mesh.movable or not len(mesh.vertices):
        return np.zeros(3)
    return _far_middle(mesh.vertices, FAR_LOCAL)[0]


def _far_middle(points: np.ndarray, far: float) -> tuple[np.ndarray, float]:
    some = points[:: max(1, len(points) // MOST_VERTICES)]
    middle = np.median(some, axis=0)
    half, radius = np.quantile(np.abs(some - middle).max(axis=1), (0.5, 0.9)).tolist()
    if not far * radius < np.abs(middle).max() <= FARTHEST:
        return np.zeros(3), half
    # Few digits, so that poses can be converted back without rounding.
    return middle.astype(np.float32).astype(np.float64), half


def coarse_places(meshes: Sequence[Any], frame: SceneFrame, refuse: bool = False) -> list[str]:
    """Warnings about meshes so far from the origin that little of their shape is left.

    Raises
    ------
    SceneError
        With `refuse`, if nothing of the shape is left.
    """
    found: list[str] = []
    for mesh in meshes:
        slack, size = place_slack(mesh, mesh.pose, frame.origin)
        if slack <= COARSE * size:
            continue
        text = (
            f'mesh "{mesh.name}": it lies {slack / SLACK:.3g} m from the middle of the scene, where single '
            f"precision holds places to {slack:.2g} m, and is {size:.2g} m large"
        )
        # beyond FARTHEST, the core raises the error
        if refuse and is_lost(slack, size, frame.radius) and slack / SLACK <= FARTHEST:
            raise SceneError(f"{text}; expected a scene whose parts lie closer together: split it")
        found.append(f"{text}; light beside it is coarse")
    return found


def is_lost(slack: float, size: float, radius: float) -> bool:
    """Whether nothing is left of the shape of a mesh, and the mesh is no speck in a scene of that radius."""
    return slack > TOO_COARSE * size and size > SPECK * radius


def place_slack(mesh: Any, pose: np.ndarray, origin: np.ndarray) -> tuple[float, float]:
    """The offset of rays from `mesh` at `pose`, and the mesh's size, in metres; 0 and 0 without area."""
    if not len(mesh.triangles) or not (size := float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))):
        return 0.0, 0.0
    centre = pose[:3, :3] @ (0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))) + pose[:3, 3]
    # Large meshes extend to the centre themselves.
    return SLACK * max(0.0, float(np.abs(centre - origin).max()) - size), size
