# SPDX-License-Identifier: Apache-2.0
"""Demonstration scene: the Cornell box, open at the front, in W/m2; both blocks can be moved."""

from __future__ import annotations

from deltalux.scene import Material, Scene

from .placing import look_at
from .shapes import GAP, box, panel_lamp, room

# The measured box is 552.8 x 548.8 x 559.2 mm; here 100 mm become 1 m, for light and blocks, too.
WIDTH, HEIGHT, DEPTH = 5.528, 5.488, 5.592
BLOCK_WIDTH, BLOCK_DEPTH = 1.66, 1.66
LAMP_THICKNESS, LAMP_RIM = 0.02, 0.01


def cornell_box() -> Scene:
    """The classic box of 5.5 m with a red and a green wall and two blocks.

    Returns
    -------
    Scene
        Unit "W/m2"; light group "ceiling"; movable "tall_block" and "short_block"; camera
        "main", in front of the open side as in the original.
    """
    white = (0.725, 0.71, 0.68)
    materials = [
        Material("white", white),
        Material("red", (0.63, 0.065, 0.05)),
        Material("green", (0.14, 0.45, 0.091)),
        Material("lamp", (0.78, 0.78, 0.78), (18.4, 14.0, 6.8), "ceiling"),
    ]
    walls = room(WIDTH, HEIGHT, DEPTH, ["white", "white", None, "white", "red", "green"])
    lamp = panel_lamp(1.30, LAMP_THICKNESS, 1.05, LAMP_RIM, "white", "lamp")
    block = box(BLOCK_WIDTH, 1.65, BLOCK_DEPTH, "white")
    tall = box(BLOCK_WIDTH, 3.30, BLOCK_DEPTH, "white")
    meshes = [
        walls.mesh("walls"),
        lamp.moved(0, HEIGHT - LAMP_THICKNESS - GAP, 0.0).mesh("lamp"),
        block.mesh("short_block", at=(0.925, GAP, 1.11), degrees=-16.7, movable=True),
        tall.mesh("tall_block", at=(-0.905, GAP, -0.7125), degrees=17.1, movable=True),
    ]
    camera = look_at("main", (0, 2.73, 10.8), (0, 2.73, 0), 39.3)
    return Scene(meshes, materials, unit="W/m2", cameras=[camera])
