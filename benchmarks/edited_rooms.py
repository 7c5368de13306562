# SPDX-License-Identifier: Apache-2.0
"""Rooms to time edits in: a gallery in the light of spots, a study in the sun; in lux."""

from __future__ import annotations

import numpy as np
from deltalux.scene import Material, PointLight, Scene, SpotLight, SunLight
from deltalux.scenes.placing import look_at
from deltalux.scenes.shapes import GAP, Shape, box, cylinder, merge, room, sheet
from peers.pictured_rooms import named_scene

PAINTS = {
    "white": (0.78, 0.77, 0.74),
    "floor": (0.42, 0.36, 0.3),
    "wood": (0.5, 0.35, 0.2),
    "cloth": (0.3, 0.38, 0.5),
    "stone": (0.62, 0.6, 0.55),
}


def _materials() -> list[Material]:
    return [Material(name, colour) for name, colour in PAINTS.items()]


def gallery() -> Scene:
    """10 x 3.5 x 7 m: four spots, the exhibit in the light of one and beside those of others; a dim lamp."""
    meshes = [room(10, 3.5, 7, ["floor", "white", "white", "white", "white", "white"]).mesh("shell")]
    meshes.append(
        merge([box(0.5, 0.9, 0.5, "white"), cylinder(0.16, 0.7, 24, "stone").moved(0, 0.9 + GAP)]).mesh(
            "exhibit", at=(0.3, GAP, -0.4), movable=True
        )
    )
    for i, (x, z) in enumerate([(-3.2, -1.9), (-2.4, 2.0), (3.1, 1.7)]):
        meshes.append(box(0.45, 1.0, 0.45, "white").moved(x, GAP, z).mesh(f"plinth_{i}"))
        meshes.append(cylinder(0.14, 0.45, 20, "stone").moved(x, 1.0 + 2 * GAP, z).mesh(f"vase_{i}"))
    meshes.append(box(1.6, 0.42, 0.5, "wood").moved(1.4, GAP, 2.3).mesh("bench"))
    meshes.append(box(3.0, 2.4, 0.12, "white").moved(2.8, GAP, -2.0).mesh("partition"))
    narrow = {"inner_angle": np.radians(14), "outer_angle": np.radians(20)}
    wide = {"inner_angle": np.radians(24), "outer_angle": np.radians(32)}
    lights = [
        SpotLight("at_vase_0", (-1.8, 3.4, -1.1), (-0.5, -0.8, -0.3), (2600, 2450, 2200), **narrow),
        SpotLight("at_vase_1", (-1.2, 3.4, 1.2), (-0.42, -0.8, 0.28), (2600, 2450, 2200), **narrow),
        SpotLight("at_exhibit", (1.6, 3.4, 0.7), (-0.45, -0.8, -0.38), (2400, 2250, 2000), **wide),
        SpotLight("at_wall", (0.2, 3.4, -1.6), (-0.1, -0.75, -0.66), (2200, 2200, 2150), **wide),
        PointLight("fill", (0.0, 3.2, 3.0), (60, 58, 52)),
    ]
    view = look_at("main", (-4.2, 1.7, 3.0), (0.8, 1.0, -0.8), 62)
    return Scene(meshes, _materials(), lights, unit="lux", cameras=[view])


def _pierced_wall(x: list[float], y: list[float], holes: set[tuple[int, int]]) -> Shape:
    """A wall in the plane z = 0 between these lines, but for the holes; its front looks along +z."""
    return merge(
        [
            sheet(
                [(x[i], y[j], 0.0), (x[i + 1], y[j], 0.0), (x[i + 1], y[j + 1], 0.0), (x[i], y[j + 1], 0.0)],
                "white",
            )
            for i in range(len(x) - 1)
            for j in range(len(y) - 1)
            if (i, j) not in holes
        ]
    )


def study() -> Scene:
    """6.4 x 2.8 x 4.8 m: the sun comes through two windows to the stool; a lamp beside the couch."""
    wall = _pierced_wall([-3.2, -2.2, -0.8, 0.6, 2.0, 3.2], [0.0, 0.85, 2.3, 2.8], {(1, 1), (3, 1)})
    desk = merge(
        [
            box(1.6, 0.04, 0.75, "wood").moved(0, 0.7),
            *(box(0.05, 0.7, 0.05, "wood").moved(x, 0, z) for x in (-0.74, 0.74) for z in (-0.3, 0.3)),
        ]
    )
    shelf = merge(
        [
            *(box(0.3, 0.03, 1.2, "wood").moved(0, 0.1 + 0.4 * k) for k in range(5)),
            *(box(0.3, 2.0, 0.03, "wood").moved(0, 0, z) for z in (-0.62, 0.62)),
        ]
    )
    stool = merge(
        [
            cylinder(0.18, 0.04, 20, "cloth").moved(0, 0.42),
            *(box(0.03, 0.42, 0.03, "wood").moved(x, 0, z) for x in (-0.1, 0.1) for z in (-0.1, 0.1)),
        ]
    )
    meshes = [
        merge(
            [room(6.4, 2.8, 4.8, ["floor", "white", "white", None, "white", "white"]), wall.moved(0, 0, -2.4)]
        ).mesh("shell"),
        desk.moved(-1.2, GAP, -1.4).mesh("desk"),
        box(0.4, 0.3, 0.05, "stone").moved(-1.2, 0.74 + 2 * GAP, -1.6).mesh("screen"),
        shelf.moved(3.0, GAP, 0.4).mesh("shelf"),
        box(1.9, 0.42, 0.85, "cloth").moved(-1.6, GAP, 1.7).mesh("couch"),
        box(1.8, 0.012, 1.3, "cloth").moved(0.9, GAP, 0.2).mesh("rug"),
        stool.mesh("stool", at=(0.9, 0.012 + 2 * GAP, -0.2), movable=True),
    ]
    lights = [
        SunLight("sun", (-0.35, -0.75, 0.8), (60000, 57000, 50000)),
        PointLight("reading", (-2.7, 1.5, 1.0), (70, 62, 48)),
    ]
    return Scene(
        meshes,
        _materials(),
        lights,
        unit="lux",
        cameras=[look_at("main", (2.7, 1.6, 2.1), (-0.8, 0.8, -1.0), 65)],
    )


EDITED = {"gallery": gallery, "study": study}


def room_named(name: str) -> Scene:
    """One of these rooms, or what pictured_rooms.named_scene() finds."""
    return EDITED[name]() if name in EDITED else named_scene(name)
