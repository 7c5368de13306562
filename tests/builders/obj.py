# SPDX-License-Identifier: Apache-2.0
"""Writes scenes as small OBJ files with their MTL."""

from __future__ import annotations

import deltalux as dl


def obj_text(scene: dl.Scene, library: str = "scene.mtl") -> str:
    """Every mesh as an object, in world space."""
    lines, first = [f"mtllib {library}"], 1
    for mesh in scene.meshes:
        lines.append(f"o {mesh.name}")
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.world_vertices]
        for triangle, material in zip(mesh.triangles, mesh.material_index, strict=True):
            lines.append(f"usemtl {mesh.material[material]}")
            lines.append("f " + " ".join(str(first + corner) for corner in triangle))
        first += len(mesh.vertices)
    return "\n".join(lines) + "\n"


def mtl_text(scene: dl.Scene) -> str:
    """Reflectances as Kd, emissions as Ke."""
    lines = []
    for material in scene.materials:
        lines.append(f"newmtl {material.name}")
        for key, values in (("Kd", material.reflectance), ("Ke", material.emission)):
            lines.append(f"{key} " + " ".join(f"{value:.9g}" for value in values))
    return "\n".join(lines) + "\n"
