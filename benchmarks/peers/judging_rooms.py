# SPDX-License-Identifier: Apache-2.0
"""Rooms to judge by, for which nothing was tuned: a box of 1 m, a hall of 60 m, a shop of 8 m; in lux."""

from __future__ import annotations

from deltalux.scene import Material, Scene
from deltalux.scenes.placing import COOL, NEUTRAL, WARM, lamp_luminance, look_at
from deltalux.scenes.shapes import GAP, box, cylinder, merge, panel_lamp, room, sheet
from near_rooms import books, chair, narrow_spot, on_legs, paints, small_things, upright

HALL = (60.0, 9.0, 35.0)
DOWNLIGHT = 0.6  # metres, the side of a lamp of the hall


def little_box() -> Scene:
    """A cube of 1 m: a panel, a lamp behind a sheet, blocks, things of 1 to 2 cm, two movables."""
    gap, small = GAP / 6, 1 / 6
    static = {
        "room": room(1, 1, 1, ["wall", "ceiling", "wall", "wall", "red_wall", "green"]),
        "panel": panel_lamp(0.22, 0.02, 0.16, 0.008, "white", "panel").moved(0.1, 0.98, -0.1),
        "tall": box(0.22, 0.55, 0.22, "white").turned(18).moved(-0.22, gap, -0.22),
        "low": box(0.26, 0.2, 0.2, "oak").turned(-20).moved(0.2, gap, 0.12),
        "leaf": upright(-0.38, -0.2, 0.22, 0.32, 0.3, "screen"),
        "stool": on_legs(0.2, 0.12, 0.14, 0.008, 0.006, "walnut").moved(-0.12, gap, 0.12),
        "strut": cylinder(0.006, 0.9, 10, "metal").moved(0.42, gap, -0.4),
    }
    meshes = [piece.mesh(name) for name, piece in static.items()]
    places = [(-0.16, 0.12, 0.1), (-0.07, 0.12, 0.14), (0.15, 0.2, 0.1), (0.24, 0.2, 0.14)]
    for i, (thing, (x, y, z)) in enumerate(
        zip(small_things(("white", "book_b", "ochre")), places, strict=True)
    ):
        meshes.append(thing.scaled(small).moved(x, y + 2 * gap, z).mesh(f"small_{i}"))
    meshes += [
        merge([box(0.12, 0.08, 0.1, "cloth"), box(0.12, 0.06, 0.03, "cloth").moved(0, 0.08, -0.035)]).mesh(
            "seat", at=(0.0, gap, 0.36), degrees=30, movable=True
        ),
        box(0.16, 0.008, 0.12, "book_c").mesh("plate", at=(0.33, 5e-3 / 6, 0.36), degrees=-10, movable=True),
    ]
    panel = lamp_luminance(90, 0.204 * 0.144, NEUTRAL)
    lights = [narrow_spot("up", (-0.42, 0.4, -0.42), (-0.3, 1.0, -0.3), 50, 40)]
    view = look_at("main", (0.02, 0.55, 0.49), (0.0, 0.3, 0.0), 85)
    materials = [*paints(), Material("panel", (0.5,) * 3, panel, "panel")]
    return Scene(meshes, materials, lights, unit="lux", cameras=[view])


def hall() -> Scene:
    """60 x 35 x 9 m: 40 downlights, stands of boards, benches, plinths with things of 4 to 10 cm."""
    width, height, depth = HALL
    lit = (DOWNLIGHT - 0.08) ** 2
    lamp = panel_lamp(DOWNLIGHT, 0.1, DOWNLIGHT, 0.04, "metal", "downlight")
    static = {"room": room(width, height, depth, ["floor", "ceiling", "wall", "wall", "red_wall", "white"])}
    for i in range(40):
        x, z = -26.25 + 7.5 * (i % 8), -14 + 7 * (i // 8)
        static[f"downlight_{i}"] = lamp.moved(x, height - 0.1 - GAP - 0.8 * (i % 3), z)
    for i, (x, z, degrees) in enumerate(
        [(-22, -10, 0), (-9, -9, 30), (6, -11, -15), (20, -8, 75), (-20, 8, 110), (-4, 9, 200), (9, 7, -60)]
    ):
        stand = merge(
            [
                box(5.0, 2.8, 0.08, "white"),
                box(0.08, 2.8, 3.0, "ochre").moved(-2.54, 0, 1.46),
                on_legs(1.6, 0.9, 0.6, 0.04, 0.03, "oak").moved(0.8, 0, 1.6),
                sheet([(0.5, 0.4, 0.05), (2.0, 0.4, 0.05), (2.0, 2.0, 0.05), (0.5, 2.0, 0.05)], "print"),
            ]
        )
        static[f"stand_{i}"] = stand.turned(degrees).moved(x, GAP, z)
    for i, (x, z, degrees) in enumerate([(-14, 0, 0), (-3, -1, 40), (12, 1, 90), (24, 4, 20)]):
        static[f"bench_{i}"] = on_legs(2.0, 0.45, 0.45, 0.05, 0.04, "walnut").turned(degrees).moved(x, GAP, z)
    static["banner"] = upright(13.0, 18.0, 10.0, 13.0, 4.0, "screen")
    plinths = [(-6.0, 3.0), (1.5, 1.0), (15.0, -3.0), (-17.0, -4.0)]
    for i, (x, z) in enumerate(plinths):
        static[f"plinth_{i}"] = box(0.4, 1.0, 0.4, "white").moved(x, GAP, z)
    meshes = [piece.mesh(name) for name, piece in static.items()]
    for i, (thing, (x, z)) in enumerate(
        zip(small_things(("ochre", "book_b", "white")), plinths, strict=True)
    ):
        meshes.append(thing.moved(x + 0.05, 1.0 + 2 * GAP, z - 0.04).mesh(f"small_{i}"))
    crates = merge(
        [
            box(1.0, 0.8, 0.8, "oak"),
            box(0.8, 0.8, 0.8, "book_c").moved(0.9),
            box(0.6, 0.6, 0.6, "oak").moved(0.2, 0.8),
        ]
    )
    meshes += [
        crates.mesh("crates", at=(2.5, GAP, -4.5), degrees=20, movable=True),
        on_legs(2.0, 0.45, 0.45, 0.05, 0.04, "oak").mesh(
            "bench", at=(-10.0, GAP, 4.5), degrees=-10, movable=True
        ),
    ]
    lights = [
        narrow_spot("stand_spot_1", (-7.0, 7.5, -4.0), (-9.0, 1.5, -8.9), 24, 4000),
        narrow_spot("stand_spot_2", (6.0, 7.5, 1.0), (1.5, 1.0, 1.0), 10, 1500),
    ]
    materials = [*paints(), Material("downlight", (0.5,) * 3, lamp_luminance(9000, lit, COOL), "downlights")]
    view = look_at("main", (-1.0, 3.2, 4.5), (3.0, 0.8, -6.0), 60)
    return Scene(meshes, materials, lights, unit="lux", cameras=[view])


def shop() -> Scene:
    """8 x 6 x 3.2 m: shelves lit from under a canopy, spots of 6 to 14 degrees on a counter and a plinth.

    A counter on thin legs, rows of books, a stool, a parcel that moves before a pool.
    """
    width, height, depth = 8.0, 3.2, 6.0
    strip = panel_lamp(2.4, 0.05, 0.12, 0.02, "metal", "strip")
    rack = merge(
        [
            *[box(0.03, 2.0, 0.35, "walnut").moved(s * 1.2) for s in (-1, 1)],
            *[box(2.37, 0.025, 0.35, "walnut").moved(0, y) for y in (0.1, 0.6, 1.1, 1.6)],
            *[books(10, 20 + i).moved(-1.1 + 0.8 * i, 0.125 + 0.5 * i, -0.05) for i in range(3)],
        ]
    )
    static = {
        "room": room(width, height, depth, ["oak", "ceiling", "wall", "green", "wall", "wall"]),
        "canopy": box(3.0, 0.04, 0.9, "white").moved(-1.5, 2.5, -2.5),
        "strip": strip.moved(-1.5, 2.44, -2.3),
        "rack": rack.moved(-1.5, GAP, -2.78),
        "counter": on_legs(2.0, 0.95, 0.6, 0.03, 0.04, "book_c").turned(90).moved(2.4, GAP, -0.4),
        "plinth": box(0.35, 0.7, 0.35, "ochre").moved(-2.6, GAP, 1.2),
        "sign": upright(0.6, 2.0, 2.2, 2.6, 2.2, "red_wall"),
        "pole": cylinder(0.03, 3.1, 12, "metal").moved(0.2, GAP, 0.6),
    }
    meshes = [piece.mesh(name) for name, piece in static.items()]
    places = [(2.3, 0.95, -1.0), (2.5, 0.95, 0.1), (-2.66, 0.7, 1.14), (-2.52, 0.7, 1.28)]
    for i, (thing, (x, y, z)) in enumerate(
        zip(small_things(("book_a", "white", "walnut")), places, strict=True)
    ):
        meshes.append(thing.moved(x, y + 2 * GAP, z).mesh(f"small_{i}"))
    meshes += [
        box(0.5, 0.35, 0.3, "book_c").mesh("parcel", at=(-0.9, GAP, 0.4), degrees=25, movable=True),
        chair("metal").mesh("stool", at=(1.5, GAP, 0.1), degrees=100, movable=True),
        box(0.16, 0.24, 0.12, "screen").mesh("till", at=(2.35, 0.95 + 2 * GAP, -0.45), movable=True),
    ]
    lights = [
        narrow_spot("counter", (1.2, 3.1, -1.2), (2.3, 0.95, -0.9), 14, 700),
        narrow_spot("plinth", (-2.0, 3.1, 2.2), (-2.6, 0.75, 1.2), 6, 500),
        narrow_spot("floor", (0.8, 3.1, 1.6), (-0.3, 0, 0.7), 9, 800),
    ]
    view = look_at("main", (3.6, 1.8, 2.7), (-1.0, 0.8, -0.8), 72)
    materials = [*paints(), Material("strip", (0.5,) * 3, lamp_luminance(1800, 2.36 * 0.08, WARM), "strip")]
    return Scene(meshes, materials, lights, unit="lux", cameras=[view])
