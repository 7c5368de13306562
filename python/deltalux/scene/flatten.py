# SPDX-License-Identifier: Apache-2.0
"""From a user's Scene to the core's: static objects first, groups numbered, float32 near the middle."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from deltalux import _core
from deltalux.errors import SceneError
from deltalux.units import FARTHEST

from .frame import coarse_places, local_origin
from .lights import Light
from .scene import Mesh, Scene

_STRONGEST = 1e30  # of what the scene's unit measures: room for what lies close by, and for what adds up


@dataclass
class FlatScene:
    """The core's scene, the names that its numbers stand for, and where its coordinates begin."""

    scene: Scene
    core: _core.Scene
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))  # of the core's world
    radius: float = 0.0  # of half of what is static
    local: dict[str, np.ndarray] = field(default_factory=dict)  # of movables' own spaces in the core
    objects: dict[str, int] = field(default_factory=dict)
    groups: dict[str, int] = field(default_factory=dict)
    materials: dict[str, int] = field(default_factory=dict)

    def points(self, world: np.ndarray) -> np.ndarray:
        """(n, 3) float32: places in the core's world."""
        return np.ascontiguousarray(world - self.origin, np.float32)

    def pose(self, name: str, pose: np.ndarray) -> np.ndarray:
        """4x4: a movable's pose, from its own space in the core to the core's world."""
        return self._shifted(pose, self.local[name], -1.0)

    def user_pose(self, name: str, pose: np.ndarray) -> np.ndarray:
        """4x4: the pose that `pose` made the core's of."""
        return self._shifted(pose, -self.local[name], 1.0)

    def _shifted(self, pose: np.ndarray, local: np.ndarray, sign: float) -> np.ndarray:
        out = np.array(pose, np.float64)
        if local.any() or self.origin.any():
            out[:3, 3] += out[:3, :3] @ local + sign * self.origin
        return out

    def object(self, mesh: Mesh) -> _core.Object:
        """The core's form of `mesh`; its emission's groups must be known already."""
        if mesh.movable:
            self.local[mesh.name] = local_origin(mesh)
            vertices, pose = mesh.vertices - self.local[mesh.name], self.pose(mesh.name, mesh.pose)
        else:
            vertices, pose = mesh.world_vertices - self.origin, np.eye(4)
            if np.abs(vertices).max(initial=0.0) > FARTHEST:
                raise SceneError(
                    f'mesh "{mesh.name}": its pose leads beyond 1e15 m, expected a scene in metres'
                )
        names = [self.materials[name] for name in mesh.material]
        groups = [self.groups.get(self.scene.material(name).group or mesh.name, 0) for name in mesh.material]
        return _core.Object(
            mesh.name,
            np.ascontiguousarray(vertices, np.float32),
            np.ascontiguousarray(mesh.triangles, np.uint32),
            np.asarray(names, np.uint32)[mesh.material_index],
            np.asarray(groups, np.uint32)[mesh.material_index],
            mesh.movable,
            np.ascontiguousarray(pose),
        )


def flatten(scene: Scene) -> FlatScene:
    """Build the core's scene.

    Raises
    ------
    SceneError
        Where there is nothing to light.
    """
    if not any(len(m.triangles) for m in scene.meshes):
        raise SceneError("scene: found no triangles, expected at least one mesh with triangles")
    coarse_places(scene.meshes, scene.frame, refuse=True)
    flat = FlatScene(scene, _core.Scene(), scene.frame.origin, scene.frame.radius)
    flat.groups = {name: i for i, name in enumerate(scene.groups)}
    for index, material in enumerate(scene.materials):
        flat.materials[material.name] = index
        _check_strength(f'material "{material.name}": emission', material.emission)
        flat.core.add_material(tuple(material.reflectance), tuple(material.emission), material.two_sided)
    ordered = sorted(scene.meshes, key=lambda m: m.movable)  # stable: static ones first
    for index, mesh in enumerate(ordered):
        flat.objects[mesh.name] = index
        flat.core.add_object(flat.object(mesh))
    for light in scene.lights:
        _add_light(flat, light)
    flat.core.set_groups(max(1, len(flat.groups)))
    return flat


def _add_light(flat: FlatScene, light: Light) -> None:
    _check_strength(f'light "{light.name}": intensity', light.strength)
    place = np.zeros(3)
    if light.place is not None:
        place = light.place - (flat.origin if light.attached_to is None else flat.local[light.attached_to])
    flat.core.add_light(
        light.name,
        light.kind,
        tuple(place.tolist()),
        (0.0, -1.0, 0.0) if light.axis is None else tuple(light.axis),
        tuple(light.strength),
        light.parameters(),
        -1 if light.attached_to is None else flat.objects[light.attached_to],
        flat.groups[light.group or light.name],
    )


def _check_strength(where: str, strength: np.ndarray) -> None:
    """Refuse a light that single precision would round to darkness, or nearly, or to infinity."""
    least = np.finfo(np.float32).tiny
    if 0 < strength.max() < least or strength.max() > _STRONGEST:
        raise SceneError(
            f"{where}: found {strength.tolist()}, expected 0, or {least:.2g} to {_STRONGEST:.2g}, which "
            "single precision holds; choose another unit"
        )
