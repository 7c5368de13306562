# SPDX-License-Identifier: Apache-2.0
"""From a user's Scene to the core's: static objects first, groups numbered, float32 geometry."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from . import _core
from .errors import SceneError
from .scene import Mesh, PointLight, Scene, SpotLight, SunLight, versine


@dataclass
class FlatScene:
    """The core's scene and the names that its numbers stand for."""

    scene: Scene
    core: _core.Scene
    objects: dict[str, int] = field(default_factory=dict)
    groups: dict[str, int] = field(default_factory=dict)
    materials: dict[str, int] = field(default_factory=dict)

    def object(self, mesh: Mesh) -> _core.Object:
        """The core's form of `mesh`; its emission's groups must be known already."""
        names = [self.materials[name] for name in mesh.material]
        groups = [self.groups.get(self.scene.material(name).group or mesh.name, 0) for name in mesh.material]
        return _core.Object(
            mesh.name,
            np.ascontiguousarray(mesh.vertices, np.float32),
            np.ascontiguousarray(mesh.triangles, np.uint32),
            np.asarray(names, np.uint32)[mesh.material_index],
            np.asarray(groups, np.uint32)[mesh.material_index],
            mesh.movable,
            np.ascontiguousarray(mesh.pose),
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
    flat = FlatScene(scene, _core.Scene())
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


def _add_light(flat: FlatScene, light: PointLight | SpotLight | SunLight) -> None:
    strength = light.irradiance if isinstance(light, SunLight) else light.intensity
    _check_strength(f'light "{light.name}": intensity', strength)
    kind = "spot" if isinstance(light, SpotLight) else "sun" if isinstance(light, SunLight) else "point"
    flat.core.add_light(
        light.name,
        kind,
        (0.0, 0.0, 0.0) if isinstance(light, SunLight) else tuple(light.position),
        (0.0, -1.0, 0.0) if isinstance(light, PointLight) else tuple(light.direction),
        tuple(strength),
        versine(light.inner_angle) if isinstance(light, SpotLight) else 0.0,
        versine(light.outer_angle) if isinstance(light, SpotLight) else 1.0,
        -1 if light.attached_to is None else flat.objects[light.attached_to],
        flat.groups[light.group or light.name],
    )


def _check_strength(where: str, strength: np.ndarray) -> None:
    """Refuse a light that single precision would round to darkness, or nearly."""
    least = np.finfo(np.float32).tiny
    if 0 < strength.max() < least:
        raise SceneError(
            f"{where}: found {strength.tolist()}, expected 0, or more than {least:.2g}, which single "
            "precision holds; choose another unit"
        )
