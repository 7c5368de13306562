# SPDX-License-Identifier: Apache-2.0
"""A scene as the edits of a session have made it, as a scene of its own."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from .lights import Light
from .scene import Material, Mesh, Scene, replace_scene


def with_edits(
    scene: Scene,
    poses: Mapping[str, np.ndarray],
    removed: Collection[str],
    factors: Mapping[str, float],
    reflectances: Mapping[str, Any],
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
    scene = dimmed(repainted(scene, reflectances), factors)
    meshes = [
        replace(mesh, pose=poses.get(mesh.name, mesh.pose))
        for mesh in scene.meshes
        if mesh.name not in removed
    ]
    lights = [
        light
        for light in scene.lights
        if factors.get(light.group or light.name, 1.0) > 0 and light.attached_to not in removed
    ]
    return replace_scene(scene, meshes=meshes, lights=lights, nodes=())


def repainted(scene: Scene, reflectances: Mapping[str, Any]) -> Scene:
    """A copy with these reflectances (3,) of materials, by name."""
    materials = [
        replace(m, reflectance=reflectances[m.name]) if m.name in reflectances else m for m in scene.materials
    ]
    return replace_scene(scene, materials=materials)


def dimmed(scene: Scene, factors: Mapping[str, float]) -> Scene:
    """A copy with the factors of its light groups in the strengths of lights and the emission of materials.

    The materials that are there keep their numbers. Those whose meshes have several factors are followed by
    dimmed ones of their own.
    """
    if all(factor == 1 for factor in factors.values()):
        return scene
    materials = {m.name: m for m in scene.materials}
    of_mesh = [
        {n: factors.get(materials[n].group or mesh.name, 1.0) for n in mesh.material if materials[n].emissive}
        for mesh in scene.meshes
    ]
    of_material: dict[str, set[float]] = {}
    for found in of_mesh:
        for name, factor in found.items():
            of_material.setdefault(name, set()).add(factor)
    shared = {name for name, found in of_material.items() if len(found) > 1}
    for name in of_material.keys() - shared:
        (factor,) = of_material[name]
        materials[name] = replace(materials[name], emission=factor * materials[name].emission)
    meshes = [
        replace(
            mesh, material=_dimmed_materials(mesh, materials, {n: found[n] for n in shared & found.keys()})
        )
        for mesh, found in zip(scene.meshes, of_mesh, strict=True)
    ]
    lights = [_dimmed(light, factors.get(light.group or light.name, 1.0)) for light in scene.lights]
    return replace_scene(scene, meshes=meshes, materials=materials.values(), lights=lights)


def _dimmed(light: Light, factor: float) -> Light:
    changes: dict[str, Any] = {light.brightness: factor * light.strength}
    return light if factor == 1 else replace(light, **changes)


def _dimmed_materials(
    mesh: Mesh, materials: dict[str, Material], factors: Mapping[str, float]
) -> tuple[str, ...]:
    """Names of the mesh's materials; those with `factors` other than 1 are added to `materials`."""
    names = []
    for name in mesh.material:
        own, factor = materials[name], factors.get(name, 1.0)
        if factor != 1:
            own = replace(own, name=f"{name} at {factor:g}", emission=factor * own.emission)
            while own.name in materials:
                own = replace(own, name=f"{own.name}'")
            materials[own.name] = own
        names.append(own.name)
    return tuple(names)
