# SPDX-License-Identifier: Apache-2.0
"""Where the core's coordinates begin: near the geometry, since single precision has 24 bits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from deltalux.errors import SceneError
from deltalux.units import FARTHEST

FAR = 2.0  # radii from the origin: the scene gets an origin of its own
FAR_LOCAL = 256.0  # the same of a movable's own space
MOST_VERTICES = 100_000  # that tell where the middle is
SLACK = 2.0**-19  # by which rays stay off surfaces, of the distance from the origin; see the core
COARSE = 0.01  # of a mesh's size: more slack than this is told
TOO_COARSE = 0.5  # and this is refused, where the mesh is no
SPECK = 1e-3  # of the scene: how little light is blocked or lost by a speck does not matter


class SceneFrame(NamedTuple):
    """Where the core's coordinates of a scene begin, and how large the scene is.

    Parameters
    ----------
    origin : (3,) float64, metres
    radius : of half of what is static, metres
    followed : the meshes that it is a function of; edits leave them alone
    """

    origin: np.ndarray
    radius: float
    followed: tuple[Any, ...]


def scene_frame(meshes: Sequence[Any], before: SceneFrame | None = None) -> SceneFrame:
    """Origin: the middle of what has most vertices if far from zero, else zero.

    A function of the static meshes (of the first mesh where there are none). `before`, of another scene,
    serves again where that has the same ones.
    """
    static = tuple(m for m in meshes if not m.movable and len(m.vertices)) or tuple(meshes[:1])
    if before is not None and static == before.followed:  # meshes are equal where they are the same object
        return before
    points = [m.world_vertices for m in static if len(m.vertices)]
    origin, radius = _far_middle(np.concatenate(points), FAR) if points else (np.zeros(3), 0.0)
    origin.setflags(write=False)
    return SceneFrame(origin, radius, static)


def local_origin(mesh: Any) -> np.ndarray:
    """(3,) float64: the middle of a movable's vertices where that is far from its own zero, else zero."""
    if not mesh.movable or not len(mesh.vertices):
        return np.zeros(3)
    return _far_middle(mesh.vertices, FAR_LOCAL)[0]


def _far_middle(points: np.ndarray, far: float) -> tuple[np.ndarray, float]:
    some = points[:: max(1, len(points) // MOST_VERTICES)]
    middle = np.median(some, axis=0)
    half, radius = np.quantile(np.abs(some - middle).max(axis=1), (0.5, 0.9)).tolist()
    if not far * radius < np.abs(middle).max() <= FARTHEST:
        return np.zeros(3), half
    # Few digits: poses come back without rounding.
    return middle.astype(np.float32).astype(np.float64), half


def coarse_places(meshes: Sequence[Any], frame: SceneFrame, refuse: bool = False) -> list[str]:
    """Warnings about meshes that lie so far out that little is left of their shape.

    Raises
    ------
    SceneError
        With `refuse`, where nothing is left of it.
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
        if refuse and is_lost(slack, size, frame.radius) and slack / SLACK <= FARTHEST:  # else the core does
            raise SceneError(f"{text}; expected a scene whose parts lie closer together: split it")
        found.append(f"{text}; light beside it is coarse")
    return found


def is_lost(slack: float, size: float, radius: float) -> bool:
    """Whether nothing is left of the shape of a mesh that is no speck in a scene of that radius."""
    return slack > TOO_COARSE * size and size > SPECK * radius


def place_slack(mesh: Any, pose: np.ndarray, origin: np.ndarray) -> tuple[float, float]:
    """By how much rays miss `mesh` at `pose`, and its size, both in metres; without area, 0 and 0."""
    if not len(mesh.triangles) or not (size := float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))):
        return 0.0, 0.0
    centre = pose[:3, :3] @ (0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))) + pose[:3, 3]
    # Large meshes reach to the middle themselves.
    return SLACK * max(0.0, float(np.abs(centre - origin).max()) - size), size
