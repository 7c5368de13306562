# SPDX-License-Identifier: Apache-2.0
"""Demonstration scene: an open-plan office in the evening, in lux; a chair and a desk lamp to move."""

from __future__ import annotations

from deltalux.scene import Material, Mesh, Scene

from . import furniture as make
from .placing import NEUTRAL, WARM, lamp_luminance, look_at
from .shapes import GAP, box, merge, panel_lamp, room

WIDTH, HEIGHT, DEPTH = 8.0, 3.0, 6.0  # along x, y, z; the floor's centre is the origin
LAMP_LUMENS, DESK_LAMP_LUMENS = 5200.0, 420.0
LAMP_WIDTH, LAMP_DEPTH, LAMP_RIM = 1.2, 0.3, 0.02
SPINES = ("book_red", "book_blue", "book_green", "book_cream", "book_grey", "book_ochre")
DESK_TOP = 0.74


def office() -> Scene:
    """An office of 8 x 6 x 3 m with four desks, lit by six ceiling luminaires and a desk lamp.

    Returns
    -------
    Scene
        Unit "lux"; light groups "window row", "wall row" (three luminaires each) and "desk lamp";
        movable "chair" (free floor around it: x 0.9 to 3, z 0.8 to 2.4) and "desk_lamp", which
        carries its light; camera "main".
    """
    return Scene(
        [*_walls(), *_luminaires(), *_workplaces(), *_along_walls(), *_movables()],
        _materials(),
        unit="lux",
        cameras=[look_at("main", (3.3, 1.62, 2.62), (-0.7, 0.72, -0.5), 48)],
    )


def _materials() -> list[Material]:
    lit = (LAMP_WIDTH - 2 * LAMP_RIM) * (LAMP_DEPTH - 2 * LAMP_RIM)
    tube = lamp_luminance(LAMP_LUMENS, lit, NEUTRAL)
    bulb = lamp_luminance(DESK_LAMP_LUMENS, make.bulb_area(), WARM)
    plain = {
        "carpet": (0.22, 0.23, 0.25),
        "wall": (0.66, 0.64, 0.60),
        "accent_wall": (0.30, 0.47, 0.50),
        "ceiling": (0.80, 0.80, 0.79),
        "white_metal": (0.72, 0.72, 0.72),
        "grey_metal": (0.38, 0.39, 0.40),
        "dark_metal": (0.10, 0.10, 0.11),
        "desktop": (0.62, 0.52, 0.40),
        "oak": (0.48, 0.32, 0.18),
        "beech": (0.60, 0.45, 0.28),
        "seat": (0.55, 0.16, 0.10),
        "seat_blue": (0.14, 0.26, 0.42),
        "front_white": (0.70, 0.70, 0.68),
        "black_plastic": (0.06, 0.06, 0.06),
        "screen": (0.07, 0.08, 0.10),
        "night_glass": (0.05, 0.06, 0.08),
        "paper": (0.78, 0.78, 0.75),
        "clay": (0.50, 0.26, 0.17),
        "soil": (0.08, 0.06, 0.04),
        "leaf": (0.13, 0.30, 0.09),
        "lamp_body": (0.60, 0.13, 0.09),
        "porcelain": (0.75, 0.74, 0.70),
        "book_red": (0.46, 0.10, 0.08),
        "book_blue": (0.10, 0.18, 0.40),
        "book_green": (0.12, 0.30, 0.17),
        "book_cream": (0.68, 0.62, 0.48),
        "book_grey": (0.30, 0.30, 0.32),
        "book_ochre": (0.58, 0.38, 0.10),
        "paint_sand": (0.70, 0.60, 0.44),
        "paint_rust": (0.58, 0.22, 0.10),
        "paint_teal": (0.10, 0.38, 0.40),
        "paint_navy": (0.09, 0.13, 0.27),
        "paint_white": (0.76, 0.74, 0.70),
    }
    return [Material(name, reflectance) for name, reflectance in plain.items()] + [
        Material("lamp_window_row", (0.5, 0.5, 0.5), tube, "window row"),
        Material("lamp_wall_row", (0.5, 0.5, 0.5), tube, "wall row"),
        Material("bulb", (0.5, 0.5, 0.5), bulb, "desk lamp"),
    ]


def _walls() -> list[Mesh]:
    sides = ["carpet", "ceiling", "wall", "wall", "accent_wall", "wall"]
    return [room(WIDTH, HEIGHT, DEPTH, sides).mesh("room")]


def _luminaires() -> list[Mesh]:
    meshes = []
    for row, z in (("window_row", -1.5), ("wall_row", 1.5)):
        for i, x in enumerate((-2.6, 0.0, 2.6)):
            lamp = panel_lamp(LAMP_WIDTH, 0.07, LAMP_DEPTH, LAMP_RIM, "white_metal", f"lamp_{row}")
            meshes.append(lamp.moved(x, HEIGHT - 0.07 - GAP, z).mesh(f"luminaire_{row}_{i + 1}"))
    return meshes


def _workplaces() -> list[Mesh]:
    """Two pairs of desks, back to back; the near pair looks to -z, the far one to +z."""
    meshes = []
    for i, (x, z, degrees) in enumerate(
        [(-1.75, 0.0, 180.0), (-0.12, 0.0, 180.0), (-1.75, -0.83, 0.0), (-0.12, -0.83, 0.0)]
    ):
        mug = ("porcelain", "seat_blue", "seat", "porcelain")[i]
        # Positions in the sitter's frame: to the left, up, and towards the screen.
        on_top = DESK_TOP + 2 * GAP
        pieces = [
            ("desk", make.desk(1.6, "desktop", "grey_metal"), 0.0, GAP, 0.0, 0),
            ("drawers", make.pedestal("front_white", "front_white", "dark_metal"), 0.42, GAP, -0.05, 180),
            ("monitor", make.monitor("black_plastic", "screen"), 0.05, on_top, 0.2, (188, 174, 185, 170)[i]),
            ("keyboard", make.keyboard("grey_metal", "front_white"), 0.03, on_top, -0.16, 0),
            ("papers", make.papers("paper"), -0.5, on_top, -0.12, (12, -20, 35, 5)[i]),
            ("mug", make.mug(mug), 0.42, on_top, -0.02, 0),
        ]
        if i > 0:  # the chair of the first desk is the movable one
            chair = make.wooden_chair("beech", "seat_blue")
            pieces.append(("chair", chair, (-0.1, 0.05, 0.0)[i - 1], GAP, -0.7, (14, -6, 10)[i - 1]))
        for name, piece, left, up, ahead, turn in pieces:
            placed = piece.turned(turn).moved(left, up, ahead).turned(degrees).moved(x, 0, z)
            meshes.append(placed.mesh(f"{name}_{i + 1}"))
    return meshes


def _along_walls() -> list[Mesh]:
    far, left = -DEPTH / 2 + GAP, -WIDTH / 2 + GAP
    pieces = {
        "window_1": make.window(1.9, 1.35, "white_metal", "night_glass").moved(-2.0, 1.12, far),
        "window_2": make.window(1.9, 1.35, "white_metal", "night_glass").moved(0.6, 1.12, far),
        "sideboard": make.cabinet(2.4, 0.78, 0.45, 4, "oak", "front_white", "dark_metal").moved(
            -0.7, GAP, far + 0.225
        ),
        "bookcase_1": make.bookcase(1.1, 2.0, 0.32, 5, "oak", SPINES, 3)
        .turned(90)
        .moved(left + 0.16, GAP, 0.25),
        "bookcase_2": make.bookcase(1.1, 2.0, 0.32, 5, "oak", SPINES, 8)
        .turned(90)
        .moved(left + 0.16, GAP, 1.36),
        "picture_1": make.picture(1.1, 0.8, "dark_metal", _PAINTS, 5).turned(90).moved(left, 1.2, -1.2),
        "picture_2": make.picture(0.7, 0.95, "oak", _PAINTS[::-1], 11).moved(2.6, 1.2, far),
        "picture_3": make.picture(1.4, 0.9, "oak", _PAINTS, 21).turned(180).moved(-0.6, 1.2, -far),
        "door": make.door(0.95, 2.05, "front_white", "grey_metal", "dark_metal")
        .turned(-90)
        .moved(-left, GAP, 0.4),
        "cupboard": make.cabinet(1.6, 1.9, 0.42, 2, "front_white", "front_white", "dark_metal")
        .turned(-90)
        .moved(-left - 0.21, GAP, -1.9),
        "plant": make.pot_plant("clay", "soil", "leaf", 4).moved(-3.5, GAP, -2.5),
        "bin": make.waste_basket("dark_metal", "grey_metal").moved(0.95, GAP, 0.1),
        "vase": make.mug("clay").scaled(2.6).moved(-0.1, 0.78 + 2 * GAP, far + 0.2),
        "box_file": merge(
            [box(0.32, 0.26, 0.22, "book_blue"), box(0.3, 0.24, 0.2, "book_red").moved(0.36)]
        ).moved(-1.55, 0.78 + 2 * GAP, far + 0.2),
    }
    return [piece.mesh(name) for name, piece in pieces.items()]


_PAINTS = ("paint_white", "paint_rust", "paint_teal", "paint_sand", "paint_navy")


def _movables() -> list[Mesh]:
    chair = make.wooden_chair("beech", "seat")
    lamp = make.desk_lamp("lamp_body", "bulb")
    return [
        chair.mesh("chair", at=(1.1, GAP, 0.92), degrees=-110, movable=True),
        lamp.mesh("desk_lamp", at=(-0.68, DESK_TOP + 2 * GAP, -0.22), degrees=50, movable=True),
    ]
