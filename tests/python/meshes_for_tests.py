# SPDX-License-Identifier: Apache-2.0
"""Boxes and rectangles as meshes of a grey material, which several test modules share."""

from __future__ import annotations

from deltalux.scene import Material, Mesh, Scene

GREY = Material("grey", reflectance=(0.5, 0.5, 0.5))
RED = Material("red", reflectance=(0.5, 0.1, 0.1))
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def box(name: str, low, high, **options) -> Mesh:
    """Axis-aligned box of 8 vertices, front sides outward."""
    corners = [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    triangles = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]
    return Mesh(name, corners, triangles, material=options.pop("material", "grey"), **options)


def quad(name: str, a, b, c, d, **options) -> Mesh:
    return Mesh(name, [a, b, c, d], [[0, 1, 2], [0, 2, 3]], material="grey", **options)


def scene_of(*meshes: Mesh) -> Scene:
    return Scene(meshes, [GREY, RED])
