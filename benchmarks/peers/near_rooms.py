# SPDX-License-Identifier: Apache-2.0
"""Two rooms where light changes over centimetres: "contacts" and "spots"; in lux.

Things stand on the floor, abut, hang a finger's breadth off a wall. Made for measuring what the
final gather does beside them; every surface is Lambertian.
"""

from __future__ import annotations

import numpy as np
from deltalux.scene import Material, Scene, SpotLight
from deltalux.scenes.placing import NEUTRAL, WARM, lamp_luminance, look_at, luminance
from deltalux.scenes.shapes import GAP, Shape, box, cylinder, merge, panel_lamp, room, sheet, sphere

WIDTH, HEIGHT, DEPTH = 5.6, 2.7, 4.1  # of "contacts", along x, y, z; the floor's centre is the origin
PARTITION = 1.7  # x of its one-polygon wall; no light gets behind it
SPOT_FULL_ANGLES = (4.0, 8.0, 20.0)  # degrees, of "spots"
HOVER = 5e-3  # metres between the small box and the floor

PAINTS = {
    "floor": (0.42, 0.33, 0.24),
    "ceiling": (0.82, 0.82, 0.80),
    "wall": (0.70, 0.68, 0.63),
    "red_wall": (0.58, 0.20, 0.14),
    "partition": (0.74, 0.72, 0.66),
    "oak": (0.50, 0.36, 0.22),
    "walnut": (0.24, 0.15, 0.10),
    "white": (0.78, 0.78, 0.76),
    "metal": (0.30, 0.31, 0.32),
    "cloth": (0.16, 0.30, 0.40),
    "screen": (0.62, 0.52, 0.30),
    "print": (0.20, 0.42, 0.30),
    "book_a": (0.55, 0.12, 0.10),
    "book_b": (0.12, 0.20, 0.45),
    "book_c": (0.66, 0.60, 0.46),
    "ochre": (0.62, 0.42, 0.12),
    "green": (0.14, 0.36, 0.16),
}


def paints() -> list[Material]:
    return [Material(name, reflectance) for name, reflectance in PAINTS.items()]


def on_legs(width: float, height: float, depth: float, leg: float, top: float, material: str) -> Shape:
    """A board of thickness `top` whose four square legs, `leg` thick, abut its underside."""
    x, z = (width - leg) / 2 - 0.02 * width, (depth - leg) / 2 - 0.02 * depth
    legs = [box(leg, height - top, leg, material).moved(i * x, 0, j * z) for i in (-1, 1) for j in (-1, 1)]
    return merge([*legs, box(width, top, depth, material).moved(0, height - top)])


def chair(material: str) -> Shape:
    """Seat on legs of 3 cm, back of two posts and two boards; the sitter looks to +z."""
    parts = [on_legs(0.44, 0.45, 0.44, 0.03, 0.03, material)]
    parts += [box(0.03, 0.45, 0.03, material).moved(s * 0.19, 0.45, -0.19) for s in (-1, 1)]
    parts += [box(0.35, 0.08, 0.02, material).moved(0, y, -0.19) for y in (0.62, 0.80)]
    return merge(parts)


def armchair() -> Shape:
    """Boxes that share faces and edges: base, arms, back, cushion."""
    return merge(
        [
            box(0.56, 0.24, 0.62, "cloth"),
            box(0.14, 0.56, 0.62, "cloth").moved(-0.35),
            box(0.14, 0.56, 0.62, "cloth").moved(0.35),
            box(0.84, 0.86, 0.16, "cloth").moved(0, 0, -0.39),
            box(0.56, 0.16, 0.62, "ochre").moved(0, 0.24),
        ]
    )


def table_lamp() -> Shape:
    """Foot, post and arm; the lit face of its head looks down from 0.36 m."""
    head = panel_lamp(0.18, 0.03, 0.10, 0.015, "metal", "bulb").moved(0.20, 0.36)
    return merge(
        [
            box(0.16, 0.02, 0.16, "metal"),
            box(0.02, 0.37, 0.02, "metal").moved(0, 0.02),
            box(0.20, 0.02, 0.02, "metal").moved(0.09, 0.39),
            head,
        ]
    )


def small_things(tones: tuple[str, str, str]) -> list[Shape]:
    """Four things of 4 to 10 cm, on y = 0: a cube, a ball, a stool, two blocks one upon the other."""
    ball = sphere(0.035, 16, tones[0]).moved(0, 0.035)
    return [
        box(0.05, 0.05, 0.05, tones[1]).turned(20),
        ball,
        on_legs(0.09, 0.06, 0.07, 0.01, 0.01, tones[2]),
        merge([box(0.08, 0.03, 0.05, tones[1]), box(0.04, 0.04, 0.04, tones[0]).moved(0.01, 0.03)]),
    ]


def books(count: int, seed: int) -> Shape:
    """A row of books that abut, from x = 0 on."""
    rng = np.random.default_rng(seed)
    parts, x = [], 0.0
    for i in range(count):
        width, height = rng.uniform(0.02, 0.045), rng.uniform(0.17, 0.25)
        parts.append(box(width, height, 0.17, f"book_{'abc'[i % 3]}").moved(x + width / 2))
        x += width
    return merge(parts)


def shelf() -> Shape:
    """1 m wide, 1.5 m high, 0.26 m deep, four boards; its back is one polygon at z = -0.13."""
    sides = [box(0.02, 1.5, 0.26, "oak").moved(s * 0.49) for s in (-1, 1)]
    boards = [box(0.96, 0.02, 0.26, "oak").moved(0, y) for y in (0.06, 0.52, 0.98, 1.48)]
    corners = [(-0.5, 0, -0.13), (0.5, 0, -0.13), (0.5, 1.5, -0.13), (-0.5, 1.5, -0.13)]
    rows = [
        books(n, n).moved(-0.47 + x, y, -0.03) for n, x, y in ((14, 0, 0.08), (9, 0.2, 0.54), (6, 0, 1.0))
    ]
    return merge([*sides, *boards, sheet(corners, "oak"), *rows])


def upright(x0: float, x1: float, z0: float, z1: float, height: float, material: str) -> Shape:
    """One rectangle on the floor from (x0, z0) to (x1, z1); seen from its front, x0 is at the left."""
    return sheet([(x0, 0, z0), (x1, 0, z1), (x1, height, z1), (x0, height, z0)], material)


def contacts() -> Scene:
    """5.6 x 4.1 x 2.7 m: furniture on thin legs, things that abut, walls of one polygon.

    A ceiling panel, two up-lights whose lamps no surface but the ceiling sees, and a desk lamp.
    """
    walls = room(WIDTH, HEIGHT, DEPTH, ["floor", "ceiling", "wall", "wall", "red_wall", "wall"])
    panel = panel_lamp(1.1, 0.06, 0.25, 0.02, "white", "panel").moved(-0.9, HEIGHT - 0.06, 0.1)
    picture = box(0.8, 0.6, 0.02, "print").moved(-1.5, 1.2, -DEPTH / 2 + 0.01 + 0.01)
    pedestals = {"a": (-2.2, 1.55, 0.9), "b": (1.1, -1.2, 0.6)}
    static = {
        "room": walls,
        "panel": panel,
        "partition": upright(PARTITION, PARTITION, -DEPTH / 2, DEPTH / 2, HEIGHT, "partition"),
        "screen": upright(-2.3, -1.5, 0.4, 0.8, 1.5, "screen"),
        "table": on_legs(1.4, 0.74, 0.75, 0.04, 0.025, "oak").moved(-0.9, GAP, -0.2),
        "chair_fixed": chair("walnut").turned(10).moved(-0.7, GAP, -0.75),
        "shelf": shelf().moved(0.4, GAP, -DEPTH / 2 + 0.14),
        "picture": picture,
        "uplight": cylinder(0.10, 1.6, 12, "metal").moved(1.35, GAP, 1.7),
        "closet_box": box(0.5, 0.8, 0.5, "oak").moved(2.3, GAP, 0.5),
    }
    for name, (x, z, height) in pedestals.items():
        static[f"pedestal_{name}"] = box(0.3, height, 0.3, "white").moved(x, GAP, z)
    meshes = [piece.mesh(name) for name, piece in static.items()]
    places = [(-2.28, 0.9, 1.48), (-2.12, 0.9, 1.6), (1.03, 0.6, -1.26), (1.17, 0.6, -1.14)]
    for i, (thing, (x, y, z)) in enumerate(
        zip(small_things(("ochre", "book_b", "oak")), places, strict=True)
    ):
        meshes.append(thing.moved(x, y + 2 * GAP, z).mesh(f"small_{i}"))
    meshes += [
        chair("oak").mesh("chair", at=(-0.95, GAP, 0.65), degrees=170, movable=True),
        armchair().mesh("armchair", at=(0.75, GAP, 0.9), degrees=-125, movable=True),
        box(0.22, 0.16, 0.18, "green").mesh("small_box", at=(0.1, HOVER, -0.9), movable=True),
        table_lamp().mesh("desk_lamp", at=(-1.4, 0.74 + 2 * GAP, -0.35), degrees=-20, movable=True),
    ]
    materials = [
        *paints(),
        Material("panel", (0.5,) * 3, lamp_luminance(2600, 1.06 * 0.21, NEUTRAL), "panel"),
        Material("bulb", (0.5,) * 3, lamp_luminance(350, 0.15 * 0.07, WARM), "desk lamp"),
    ]
    lights = [
        narrow_spot("uplight_1", (1.35, 1.64, 1.7), (1.35, HEIGHT, 1.7), 70, 1800),
        narrow_spot("uplight_2", (-2.5, 1.9, -1.8), (-2.3, HEIGHT, -1.6), 70, 1200),
    ]
    view = look_at("main", (1.5, 1.75, -0.3), (-1.2, 0.7, 0.4), 75)
    return Scene(meshes, materials, lights, unit="lux", cameras=[view])


def spots() -> Scene:
    """6 x 5 x 2.8 m, lit by three narrow spots alone: on the floor, on the table, on a wall."""
    width, height, depth = 6.0, 2.8, 5.0
    static = {
        "room": room(width, height, depth, ["floor", "ceiling", "wall", "wall", "red_wall", "wall"]),
        "table": on_legs(1.2, 0.72, 0.7, 0.04, 0.03, "oak").moved(0.6, GAP, -0.6),
        "crate": box(0.6, 0.5, 0.5, "walnut").turned(25).moved(-1.9, GAP, -1.4),
        "crate_upon": box(0.3, 0.25, 0.3, "ochre").turned(5).moved(-1.9, 0.5 + 2 * GAP, -1.4),
        "board": box(0.9, 1.8, 0.04, "white").moved(2.2, GAP, -2.0),
        "pedestal": box(0.3, 0.8, 0.3, "white").moved(-0.7, GAP, 1.5),
    }
    meshes = [piece.mesh(name) for name, piece in static.items()]
    places = [(0.35, 0.72, -0.55), (0.95, 0.72, -0.75), (-0.76, 0.8, 1.44), (-0.62, 0.8, 1.56)]
    for i, (thing, (x, y, z)) in enumerate(zip(small_things(("white", "green", "oak")), places, strict=True)):
        meshes.append(thing.moved(x, y + 2 * GAP, z).mesh(f"small_{i}"))
    meshes += [
        box(0.45, 0.45, 0.45, "cloth").mesh("cube", at=(-1.3, GAP, 0.6), degrees=15, movable=True),
        chair("oak").mesh("chair", at=(1.0, GAP, 0.5), degrees=160, movable=True),
    ]
    floor, table, wall = SPOT_FULL_ANGLES
    lights = [
        narrow_spot("floor", (-1.2, 2.75, -0.2), (-0.6, 0, 0.3), floor, 900),
        narrow_spot("table", (0.2, 2.75, 0.4), (0.65, 0.72, -0.6), table, 900),
        narrow_spot("wall", (-1.0, 2.75, 1.0), (-width / 2, 1.2, 0.9), wall, 1200),
    ]
    view = look_at("main", (2.6, 1.7, 2.3), (-0.6, 0.7, -0.4), 68)
    return Scene(meshes, paints(), lights, unit="lux", cameras=[view])


def narrow_spot(name: str, place: tuple, target: tuple, full_degrees: float, lumens: float) -> SpotLight:
    """A spot of warm light; its inner cone is 0.7 times as wide as the outer one."""
    outer = np.radians(full_degrees / 2)
    inner = 0.7 * outer
    solid = 2 * np.pi * ((1 - np.cos(inner)) + (np.cos(inner) - np.cos(outer)) / 3)
    return SpotLight(name, place, np.subtract(target, place), luminance(lumens / solid, WARM), inner, outer)
