# SPDX-License-Identifier: Apache-2.0
"""A scene as the edits of a session have made it, as a scene of its own."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from .lights import Light, SunLight
from .scene import Material, Mesh, Scene, replace_scene


def with_edits(
    scene: Scene,
    poses: Mapping[str, np.ndarray],
    removed: Collection[str],
    factors: Mapping[str, float],
    reflectances: Mapping[str, np.ndarray],
) -> Scene:
    """A copy in which what was moved, removed, dimmed or painted is so from the start.

    It has no node tree, as moved meshes no longer stand where their nodes do.

    Parameters
    ----------
    scene : Scene
    poses : 4x4 local to world by movable that was moved
    removed : names of movables, which take the lights on them with them
    factors : of light groups; lights of factor 0 are left out
    reflectances : (3,) by material
    """
    materials = {
        m.name: replace(m, reflectance=reflectances[m.name]) if m.name in reflectances else m
        for m in scene.materials
    }
    meshes = [
        replace(
            mesh,
            pose=poses.get(mesh.name, mesh.pose),
            material=_dimmed_materials(mesh, materials, factors),
        )
        for mesh in scene.meshes
        if mesh.name not in removed
    ]
    lights = [
        _dimmed(light, factor)
        for light in scene.lights
        if (factor := factors.get(light.group or light.name, 1.0)) > 0 and light.attached_to not in removed
    ]
    return replace_scene(scene, meshes=meshes, materials=materials.values(), lights=lights, nodes=())


def _dimmed(light: Light, factor: float) -> Light:
    power = "irradiance" if isinstance(light, SunLight) else "intensity"
    return light if factor == 1 else replace(light, **{power: factor * getattr(light, power)})


def _dimmed_materials(
    mesh: Mesh, materials: dict[str, Material], factors: Mapping[str, float]
) -> tuple[str, ...]:
    """Names of the mesh's materials; those dimmed by its groups' factors are added to `materials`."""
    names = []
    for name in mesh.material:
        own = materials[name]
        factor = factors.get(own.group or mesh.name, 1.0) if own.emissive else 1.0
        if factor != 1:
            own = replace(own, name=f"{name} at {factor:g}", emission=factor * own.emission)
            while own.name in materials:
                own = replace(own, name=f"{own.name}'")
            materials[own.name] = own
        names.append(own.name)
    return tuple(names)
