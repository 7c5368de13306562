# SPDX-License-Identifier: Apache-2.0
"""Two rooms made after pictures were tuned: a living room in the sun, a corridor of spots; in lux."""

from __future__ import annotations

import deltalux as dl
import numpy as np
from deltalux.scene import Material, Scene, SpotLight, SunLight
from deltalux.scenes.placing import look_at
from deltalux.scenes.shapes import GAP, box, merge, room, sheet

SPOTS, LENGTH = 30, 40.0  # of the corridor, metres along x


def living_room() -> Scene:
    """5 x 2.7 x 4 m; all of its light is sun that comes through a window of 1.2 x 1.4 m."""
    y, z = (0.0, 0.9, 2.1, 2.7), (-2.0, -0.8, 0.6, 2.0)
    window_wall = [
        sheet([(-2.5, y[j], z[m]) for j, m in ((i, k), (i + 1, k), (i + 1, k + 1), (i, k + 1))], "white")
        for i in range(3)
        for k in range(3)
        if (i, k) != (1, 1)
    ]
    sofa = merge([box(2.0, 0.4, 0.9, "cloth"), box(2.0, 0.4, 0.2, "cloth").moved(0, 0.4, 0.35)])
    table = merge(
        [
            box(1.1, 0.04, 0.6, "wood").moved(0, 0.4),
            *(box(0.05, 0.4, 0.05, "wood").moved(x, 0, -0.4 * x) for x in (-0.5, 0.5)),
        ]
    )
    meshes = [
        merge([room(5, 2.7, 4, ["white"] * 4 + [None, "white"]), *window_wall]).mesh("shell"),
        sofa.moved(0, GAP, 1.4).mesh("sofa"),
        box(0.3, 1.8, 1.2, "wood").moved(2.34, GAP, -0.5).mesh("shelf"),
        box(0.2, 0.25, 0.04, "red").moved(-0.2, 0.44 + GAP).mesh("book"),
        box(0.8, 0.5, 0.02, "red").moved(-0.3, 1.35, -1.985).mesh("picture"),
        box(2.2, 0.01, 1.4, "red").moved(-0.1, GAP).mesh("rug"),
        table.mesh("table", at=(-0.1, 0.01 + 2 * GAP, 0), movable=True),
    ]
    paints = {
        "white": (0.75, 0.73, 0.7),
        "cloth": (0.3, 0.4, 0.5),
        "wood": (0.5, 0.35, 0.2),
        "red": (0.6, 0.15, 0.1),
    }
    return Scene(
        meshes,
        [Material(name, colour) for name, colour in paints.items()],
        [SunLight("sun", (0.8, -0.7, 0.25), (60000, 57000, 50000))],
        unit="lux",
        cameras=[look_at("main", (2.2, 1.5, -1.6), (-1.3, 0.8, 0.8), 57)],
    )


def corridor() -> Scene:
    """40 x 2.8 x 2.4 m, lit by 30 spots of 16 to 64 degrees; benches on one side, doors on the other."""
    meshes = [room(LENGTH, 2.8, 2.4, ["white"] * 6).mesh("shell")]
    for i in range(10):
        bench = box(1.2, 0.45, 0.4, "wood").mesh(f"bench_{i}", at=(3.8 * i - 17, GAP, -0.9), movable=i == 1)
        meshes += [bench, box(0.9, 2.05, 0.04, "wood").moved(3.9 * i - 18, GAP, 1.178).mesh(f"door_{i}")]
    lights = []
    for i in range(SPOTS):
        side, wide = i % 3 - 1, i % 4
        direction = (0.05 * side, -1.0, -0.3 * side)
        inner, outer = np.radians(8 + 4 * wide), np.radians(14 + 6 * wide)
        place = (1.33 * i - 19.3, 2.79, 0.6 * side)
        lights.append(
            SpotLight(f"spot_{i}", place, direction, (900, 820, 700), inner_angle=inner, outer_angle=outer)
        )
    return Scene(
        meshes,
        [Material("white", (0.7, 0.7, 0.68)), Material("wood", (0.5, 0.35, 0.2))],
        lights,
        unit="lux",
        cameras=[look_at("main", (-19.4, 1.6, 0.0), (-8.0, 1.0, 0.0), 57)],
    )


ROOMS = {"living_room": living_room, "corridor": corridor}


def named_scene(source: str) -> Scene:
    """A file, one of these rooms, or a bundled scene."""
    if "." in source:
        return dl.load(source)
    return ROOMS[source]() if source in ROOMS else getattr(dl.scenes, source)()
