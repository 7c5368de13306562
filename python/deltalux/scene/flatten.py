# SPDX-License-Identifier: Apache-2.0
"""Converts a user's Scene to the core's: static objects first, numbered groups, float32 near the centre."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from deltalux import _core
from deltalux.errors import SceneError
from deltalux.units import FARTHEST

from .core_textures import CoreTextures
from .frame import coarse_places, local_origin
from .lights import Light
from .scene import Material, Mesh, Scene

_STRONGEST = 1e30  # largest strength in the scene's unit: leaves room for nearby surfaces, and for sums


@dataclass
class FlatScene:
    """The core's scene, the names behind its numbers, and the origin of its coordinates."""

    scene: Scene
    core: _core.Scene
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))  # origin of the core's world coordinates
    radius: float = 0.0  # see `SceneFrame`
    # origin of each movable's own coordinates in the core
    local: dict[str, np.ndarray] = field(default_factory=dict)
    objects: dict[str, int] = field(default_factory=dict)
    groups: dict[str, int] = field(default_factory=dict)
    materials: dict[str, int] = field(default_factory=dict)
    textures: CoreTextures = field(default_factory=lambda: CoreTextures(()))

    def points(self, world: np.ndarray) -> np.ndarray:
        """(n, 3) float32: points in the core's world coordinates."""
        return np.ascontiguousarray(world - self.origin, np.float32)

    def pose(self, name: str, pose: np.ndarray) -> np.ndarray:
        """4x4: a movable's pose from local to world coordinates, both with the core's origins."""
        return self._shifted(pose, self.local[name], -1.0)

    def user_pose(self, name: str, pose: np.ndarray) -> np.ndarray:
        """4x4: the inverse of `pose`: the user's pose from the core's."""
        return self._shifted(pose, -self.local[name], 1.0)

    def _shifted(self, pose: np.ndarray, local: np.ndarray, sign: float) -> np.ndarray:
        out = np.array(pose, np.float64)
        if local.any() or self.origin.any():
            out[:3, 3] += out[:3, :3] @ local + sign * self.origin
        return out

    def object(self, mesh: Mesh) -> _core.Object:
        """The core's form of `mesh`, whose light may be of new groups (see `groups_with`)."""
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
        known = self.groups_with(mesh)
        groups = [known.get(self.scene.material(name).group or mesh.name, 0) for name in mesh.material]
        return _core.Object(
            mesh.name,
            np.ascontiguousarray(vertices, np.float32),
            np.ascontiguousarray(mesh.triangles, np.uint32),
            np.asarray(names, np.uint32)[mesh.material_index],
            np.asarray(groups, np.uint32)[mesh.material_index],
            mesh.movable,
            np.ascontiguousarray(pose),
            self._texture(mesh),
        )

    def groups_with(self, mesh: Mesh) -> dict[str, int]:
        """Numbers of the light groups once `mesh` is in the scene."""
        groups = dict(self.groups)
        for name in self.scene.groups_of(mesh):
            groups.setdefault(name, len(groups))
        return groups

    def _texture(self, mesh: Mesh) -> np.ndarray:
        """(m, 6) float32 texture coordinates of the corners, for surfaces that read them; else (0, 6)."""
        reads = any(self._reads_texture(self.scene.material(name)) for name in mesh.material)
        if mesh.coordinates is None or not reads:
            return np.zeros((0, 6), np.float32)
        return np.ascontiguousarray(mesh.coordinates.reshape(-1, 6))

    def _reads_texture(self, material: Material) -> bool:
        return material.surface.reads_texture or self.textures.have(material)


def flatten(scene: Scene, textured: bool = True) -> FlatScene:
    """Build the core's scene; without textures unless `textured`, which takes less time.

    Raises
    ------
    SceneError
        If there is nothing to light.
    """
    if not any(len(m.triangles) for m in scene.meshes):
        raise SceneError("scene: found no triangles, expected at least one mesh with triangles")
    coarse_places(scene.meshes, scene.frame, refuse=True)
    flat = FlatScene(scene, _core.Scene(), scene.frame.origin, scene.frame.radius)
    if textured:
        flat.textures = CoreTextures(scene.materials)
    flat.groups = {name: i for i, name in enumerate(scene.groups)}
    for index, material in enumerate(scene.materials):
        flat.materials[material.name] = index
        _check_strength(f'material "{material.name}": emission', material.emission)
        flat.core.add_material(
            material.name,
            tuple(material.reflectance),
            tuple(material.emission),
            material.two_sided,
            material.surface.kind,
            material.surface.parameters(),
        )
        flat.textures.set_last(flat.core, material)
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
    """Refuse a light whose strength single precision would round to (nearly) zero or to infinity."""
    least = np.finfo(np.float32).tiny
    if 0 < strength.max() < least or strength.max() > _STRONGEST:
        raise SceneError(
            f"{where}: found {strength.tolist()}, expected 0, or {least:.2g} to {_STRONGEST:.2g}, which "
            "single precision holds; choose another unit"
        )
