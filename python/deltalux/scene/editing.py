# SPDX-License-Identifier: Apache-2.0
"""A scene as the edits of a session have made it, as a scene of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .lights import Light, SunLight
from .scene import Material, Mesh, Scene, replace_scene


def with_edits(
    scene: Scene,
    poses: Mapping[str, np.ndarray | None],
    factors: Mapping[str, float],
    reflectances: Mapping[str, np.ndarray],
) -> Scene:
    """A copy in which what was moved, removed, dimmed or painted is so from the start.

    It has no node tree, as moved meshes no longer stand where their nodes do.

    Parameters
    ----------
    scene : Scene
    poses : 4x4 local to world by movable, None = removed, with the lights on it
    factors : of light groups; lights of factor 0 are left out
    reflectances : (3,) by material
    """
    meshes = [
        mesh if (pose := poses.get(mesh.name, mesh.pose)) is mesh.pose else replace(mesh, pose=pose)
        for mesh in scene.meshes
        if poses.get(mesh.name, mesh.pose) is not None
    ]
    materials = {
        m.name: replace(m, reflectance=reflectances[m.name]) if m.name in reflectances else m
        for m in scene.materials
    }
    present = {mesh.name for mesh in meshes}
    lights = [
        _dimmed(light, factor)
        for light in scene.lights
        if (factor := factors.get(light.group or light.name, 1.0)) > 0
        and (light.attached_to is None or light.attached_to in present)
    ]
    meshes = [_with_dimmed_materials(mesh, materials, factors) for mesh in meshes]
    return replace_scene(scene, meshes=meshes, materials=materials.values(), lights=lights, nodes=())


def _dimmed(light: Light, factor: float) -> Light:
    power = "irradiance" if isinstance(light, SunLight) else "intensity"
    return light if factor == 1 else replace(light, **{power: factor * getattr(light, power)})


def _with_dimmed_materials(mesh: Mesh, materials: dict[str, Material], factors: Mapping[str, float]) -> Mesh:
    """The mesh with luminous materials of its groups' factors, which are added to `materials`."""
    names = []
    for name in mesh.material:
        own = materials[name]
        factor = factors.get(own.group or mesh.name, 1.0) if own.emissive else 1.0
        if factor != 1:
            own = replace(own, name=f"{name} at {factor:g}", emission=factor * own.emission)
            materials.setdefault(own.name, own)
        names.append(own.name)
    return replace(mesh, material=tuple(names)) if tuple(names) != tuple(mesh.material) else mesh
