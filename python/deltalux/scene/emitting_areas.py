# SPDX-License-Identifier: Apache-2.0
"""Areas of luminous triangles, of which several in one place shine once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from deltalux import _core


def emitting_areas(scene: Any, meshes: Sequence[Any]) -> dict[str, np.ndarray]:
    """What emits of each triangle of `meshes` of a Scene, in m²; by name of the mesh, each (m,)."""
    core = _core.Scene()
    numbers = {}
    for number, material in enumerate(scene.materials):
        numbers[material.name] = number
        glow = tuple((material.emission > 0).astype(float).tolist())
        core.add_material(material.name, (0.0,) * 3, glow, material.two_sided, "diffuse", [])
    ordered = sorted(meshes, key=lambda mesh: mesh.movable)  # static ones first
    for mesh in ordered:
        vertices = mesh.vertices if mesh.movable else mesh.world_vertices - scene.frame.origin
        materials = np.asarray([numbers[name] for name in mesh.material], np.uint32)[mesh.material_index]
        core.add_object(
            _core.Object(
                mesh.name,
                np.ascontiguousarray(vertices, np.float32),
                np.ascontiguousarray(mesh.triangles, np.uint32),
                materials,
                np.zeros(len(materials), np.uint32),
                mesh.movable,
                np.eye(4),
                np.zeros((0, 6), np.float32),
            )
        )
    return {mesh.name: np.asarray(areas) for mesh, areas in zip(ordered, core.emitting_areas(), strict=True)}
