# SPDX-License-Identifier: Apache-2.0
"""Demonstration scene: an exhibition hall with booths, panels and spots, in lux; an exhibit to move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deltalux.scene import Material, Mesh, Scene, SpotLight

from . import furniture as make
from . import sculptures as art
from .placing import NEUTRAL, WARM, lamp_luminance, look_at, luminance
from .shapes import GAP, Shape, block, box, cylinder, lathe, merge, panel_lamp, room, shell, tiles, tube

WIDTH, HEIGHT, DEPTH = 20.0, 5.0, 14.0  # along x, y, z; the floor's centre is the origin
PANEL_LUMENS, PANEL_WIDTH, PANEL_DEPTH, PANEL_RIM = 9000.0, 2.4, 0.6, 0.03
TRACK_HEIGHT, TRACKS = 4.2, (0.4, 2.9)  # y, and z of the two tracks over the sculptures
WASHER_TRACK = -4.6
BOOTH, BOOTH_DEPTH, WALL_HEIGHT = 5.0, 3.0, 2.8
EXHIBIT_AT = (3.4, 2.6)  # x, z
PAINTS = ("paint_white", "paint_rust", "paint_teal", "paint_sand", "paint_navy", "paint_rose")
COLOURS = ("paint_teal", "paint_ochre", "paint_rust", "paint_navy")  # of the booths, from the left


def expo() -> Scene:
    """An exhibition hall of 20 x 14 x 5 m with booths, picture panels and sculptures on plinths.

    Returns
    -------
    Scene
        Unit "lux"; light groups "panels" (eight area lights), "spots" (on the plinths),
        "exhibit spots" and "wall washers"; movable "exhibit", a knot on a plinth (free floor
        around it: x 0.5 to 4.5, z 0.8 to 3.4); camera "main".
    """
    spots = _spots()
    housings = merge([_housing(spot) for spot in spots]).mesh("spotlights")
    fixed = [*_hall(), *_panel_lamps(), housings, *_booths(), *_pictures(), *_podiums(), *_furniture()]
    return Scene(
        [*fixed, _exhibit()],
        _materials(),
        [spot.light() for spot in spots],
        unit="lux",
        cameras=[look_at("main", (8.2, 2.0, 6.2), (-0.4, 1.05, -1.2), 46)],
    )


def _materials() -> list[Material]:
    lit = (PANEL_WIDTH - 2 * PANEL_RIM) * (PANEL_DEPTH - 2 * PANEL_RIM)
    plain = {
        "slate": (0.20, 0.20, 0.21),
        "slate_light": (0.31, 0.30, 0.29),
        "hall_wall": (0.66, 0.65, 0.63),
        "hall_ceiling": (0.58, 0.58, 0.58),
        "steel": (0.34, 0.35, 0.37),
        "track": (0.12, 0.12, 0.12),
        "partition": (0.74, 0.73, 0.71),
        "runner": (0.40, 0.09, 0.09),
        "plinth": (0.78, 0.77, 0.75),
        "oak": (0.48, 0.32, 0.18),
        "dark_metal": (0.10, 0.10, 0.11),
        "white_metal": (0.72, 0.72, 0.72),
        "screen": (0.07, 0.08, 0.11),
        "brass": (0.60, 0.44, 0.18),
        "bronze": (0.32, 0.20, 0.11),
        "marble": (0.76, 0.74, 0.71),
        "terracotta": (0.56, 0.27, 0.17),
        "verdigris": (0.22, 0.48, 0.40),
        "lacquer": (0.60, 0.07, 0.05),
        "clay": (0.45, 0.40, 0.35),
        "soil": (0.08, 0.06, 0.04),
        "leaf": (0.13, 0.30, 0.09),
        "rope": (0.38, 0.06, 0.10),
        "leather": (0.22, 0.13, 0.08),
        "paper": (0.78, 0.78, 0.75),
        "paint_sand": (0.70, 0.60, 0.44),
        "paint_rust": (0.58, 0.22, 0.10),
        "paint_teal": (0.10, 0.40, 0.42),
        "paint_navy": (0.10, 0.15, 0.34),
        "paint_white": (0.76, 0.74, 0.70),
        "paint_rose": (0.68, 0.38, 0.36),
        "paint_ochre": (0.66, 0.45, 0.12),
    }
    panel = lamp_luminance(PANEL_LUMENS, lit, NEUTRAL)
    return [
        *(Material(name, reflectance) for name, reflectance in plain.items()),
        Material("panel_lamp", (0.5, 0.5, 0.5), panel, "panels"),
    ]


def _hall() -> list[Mesh]:
    walls = room(WIDTH, HEIGHT, DEPTH, [None, "hall_ceiling", *["hall_wall"] * 4])
    floor = tiles(
        np.linspace(-WIDTH / 2, WIDTH / 2, 21),
        np.linspace(-DEPTH / 2, DEPTH / 2, 15),
        lambda i, j: ("slate", "slate_light")[(i + j) % 2],
    )
    beams = [box(0.2, 0.42, DEPTH - 4 * GAP, "steel").moved(x, HEIGHT - 0.42 - GAP) for x in (-5, 0, 5)]
    tracks = []
    for z in (*TRACKS, WASHER_TRACK):
        tracks.append(box(WIDTH - 2.4, 0.05, 0.05, "track").moved(0, TRACK_HEIGHT, z))
        for x in (-8.0, -4.0, 0.0, 4.0, 8.0):
            top = HEIGHT - 0.41 if x == 0 else HEIGHT - GAP
            tracks.append(
                cylinder(0.008, top - TRACK_HEIGHT - 0.045, 8, "track").moved(x, TRACK_HEIGHT + 0.045, z)
            )
    shaft = [(0.30, 0), (0.30, 0.12), (0.25, 0.16), (0.25, 4.34), (0.33, 4.44), (0.33, 4.57)]
    columns = [lathe(shaft, 32, "hall_wall").moved(x, GAP, -3.5) for x in (-5, 5)]
    runner = block(WIDTH - 3, 0.008, 1.3, "runner", 0.002).moved(0, GAP, -2.42)
    return [
        walls.mesh("hall"),
        floor.mesh("floor"),
        merge(beams).mesh("beams"),
        merge(tracks).mesh("tracks"),
        *(column.mesh(f"column_{i + 1}") for i, column in enumerate(columns)),
        runner.mesh("runner"),
    ]


def _panel_lamps() -> list[Mesh]:
    lamp = panel_lamp(PANEL_WIDTH, 0.08, PANEL_DEPTH, PANEL_RIM, "white_metal", "panel_lamp")
    places = [(x, z) for z in (-2.6, 4.4) for x in (-7.5, -2.5, 2.5, 7.5)]
    return [
        lamp.moved(x, HEIGHT - 0.08 - GAP, z).mesh(f"panel_lamp_{i + 1}") for i, (x, z) in enumerate(places)
    ]


@dataclass(frozen=True)
class _Spot:
    """A spotlight under a track, with half angles in degrees."""

    name: str
    group: str
    position: np.ndarray
    direction: np.ndarray
    candela: float
    inner: float
    outer: float

    def light(self) -> SpotLight:
        return SpotLight(
            self.name,
            self.position,
            self.direction,
            luminance(self.candela, WARM),
            float(np.radians(self.inner)),
            float(np.radians(self.outer)),
            self.group,
        )


def _spot(
    name: str,
    group: str,
    x: float,
    z: float,
    target: Sequence[float],
    candela: float,
    angles: tuple[float, float],
) -> _Spot:
    position = np.array([x, TRACK_HEIGHT - 0.28, z])
    direction = np.asarray(target) - position
    return _Spot(name, group, position, direction / np.linalg.norm(direction), candela, *angles)


def _spots() -> list[_Spot]:
    spots = []
    for name, (_, _, x, z) in _SCULPTURES.items():
        track = max(TRACKS, key=lambda t: -abs(abs(t - z) - 1.8))
        spots.append(_spot(f"spot_{name}", "spots", x + 0.7, track, (x, 1.25, z), 6500, (10, 19)))
    x, z = EXHIBIT_AT
    for i, (dx, track) in enumerate([(1.3, TRACKS[0]), (-0.9, TRACKS[1])]):
        spots.append(
            _spot(f"spot_exhibit_{i + 1}", "exhibit spots", x + dx, track, (x, 1.2, z), 6500, (11, 22))
        )
    for i in range(4):
        x = (i - 1.5) * BOOTH
        target = (x, 1.5, -DEPTH / 2)
        spots.append(_spot(f"washer_{i + 1}", "wall washers", x, WASHER_TRACK, target, 3500, (24, 42)))
    return spots


def _housing(spot: _Spot) -> Shape:
    """Can behind a spotlight, open face just before the light, on a stem from the track."""
    back = -spot.direction
    can = lathe([(0.055, 0.0), (0.06, 0.02), (0.06, 0.17), (0.03, 0.2)], 12, "track").moved(0, 0.03)
    tilt, turn = np.degrees(np.arccos(back[1])), np.degrees(np.arctan2(back[0], back[2]))
    joint = spot.position + 0.13 * back
    x, _, z = spot.position
    stem = tube([joint, (x, TRACK_HEIGHT + 0.02, z)], 0.012, 8, "track")
    return merge([can.turned(float(tilt), "x").turned(float(turn)).moved(*spot.position), stem])


def _booths() -> list[Mesh]:
    back = -DEPTH / 2
    meshes = []
    for i, x in enumerate((-BOOTH, 0.0, BOOTH)):
        wall = box(0.1, WALL_HEIGHT, BOOTH_DEPTH - GAP, "partition")
        meshes.append(wall.moved(x, GAP, back + BOOTH_DEPTH / 2 + GAP).mesh(f"partition_{i + 1}"))
    for i, colour in enumerate(COLOURS):
        x = (i - 1.5) * BOOTH
        clear = BOOTH - 0.1 - 2 * GAP
        panel = box(clear - 0.2, WALL_HEIGHT - 0.1, 0.03, colour).moved(x, GAP, back + 0.016)
        fascia = box(clear, 0.34, 0.06, colour).moved(x, WALL_HEIGHT - 0.36, back + BOOTH_DEPTH - 0.05)
        meshes += [panel.mesh(f"booth_{i + 1}_back"), fascia.mesh(f"booth_{i + 1}_fascia")]
        meshes += [_banner(colour).moved(x, 3.02, back + BOOTH_DEPTH + 0.15).mesh(f"banner_{i + 1}")]
    return [*meshes, *_booth_contents(back)]


def _banner(colour: str) -> Shape:
    """Cloth of 1.5 x 1.3 m between two rods, hung from the ceiling."""
    u, v = np.meshgrid(np.linspace(-0.75, 0.75, 21), np.linspace(0.02, 1.3, 7), indexing="ij")
    wave = 0.03 * np.sin(7.5 * u + 0.8) * (1.3 - v) / 1.3
    front = np.stack([u, v, wave + 0.003], axis=-1)
    parts = [shell(front, front - [0, 0, 0.006], colour)]
    parts.append(tube([(-0.79, 1.3, 0), (0.79, 1.3, 0)], 0.016, 10, "dark_metal"))
    for x in (-0.7, 0.7):
        parts.append(cylinder(0.004, HEIGHT - 3.02 - 1.3 - GAP, 6, "dark_metal").moved(x, 1.295))
    return merge(parts)


def _booth_contents(back: float) -> list[Mesh]:
    counter = merge([box(1.7, 1.0, 0.5, "plinth"), block(1.8, 0.04, 0.6, "oak").moved(0, 0.99)])
    screen = merge(
        [block(1.5, 0.86, 0.05, "dark_metal"), box(1.44, 0.8, 0.004, "screen").moved(0, 0.03, 0.0245)]
    )
    desk = make.desk(1.8, "oak", "dark_metal")
    chair = make.wooden_chair("oak", "leather")
    shelf = make.bookcase(1.5, 2.1, 0.34, 4, "oak", PAINTS, 17)
    on_back = back + 0.032
    pieces = {
        "booth_1_counter": counter.moved(-8.1, GAP, -4.9),
        "booth_1_screen": screen.moved(-7.0, 1.3, on_back + 0.026),
        "booth_1_shelf": shelf.moved(-9.05, GAP, on_back + 0.171),
        "booth_2_table": desk.moved(-2.5, GAP, -5.4),
        "booth_2_chair_1": chair.turned(170).moved(-2.1, GAP, -4.75),
        "booth_2_chair_2": chair.turned(10).moved(-2.8, GAP, -6.1),
        "booth_2_picture": make.picture(1.9, 1.15, "dark_metal", PAINTS, 2).moved(-2.5, 1.15, on_back),
        "booth_2_papers": make.papers("paper").turned(25).moved(-2.4, 0.742, -5.4),
        "booth_3_shelf_1": shelf.moved(1.4, GAP, on_back + 0.171),
        "booth_3_shelf_2": make.bookcase(1.5, 2.1, 0.34, 4, "oak", PAINTS[::-1], 29).moved(
            3.0, GAP, on_back + 0.171
        ),
        "booth_3_counter": counter.moved(3.3, GAP, -4.8),
        "booth_4_plinths": merge(
            [
                art.on_plinth(art.totem("clay", "brass").scaled(0.6), 0.4, 0.9, "plinth").moved(6.3),
                art.on_plinth(art.knot(0.22, 0.04, "marble", 64, 8), 0.4, 1.15, "plinth").moved(7.5),
                art.on_plinth(art.twist(0.22, 0.6, 0.4, "lacquer"), 0.4, 0.9, "plinth").moved(8.7),
            ]
        ).moved(0, GAP, -5.9),
        "booth_4_bench": _bench().moved(7.5, GAP, -4.6),
    }
    return [piece.mesh(name) for name, piece in pieces.items()]


def _bench() -> Shape:
    parts = [block(1.6, 0.08, 0.42, "leather", 0.015).moved(0, 0.38)]
    parts += [box(0.06, 0.39, 0.36, "dark_metal").moved(x) for x in (-0.6, 0.6)]
    return merge(parts)


def _pictures() -> list[Mesh]:
    """Free-standing panels on the left with pictures on both sides, and pictures on the walls."""
    meshes = []
    for i, (x, z, degrees) in enumerate(
        [(-8.2, 0.6, 52), (-6.2, 3.2, 62), (-8.2, 5.2, 20), (-3.6, 5.9, -12)]
    ):
        parts = [block(2.3, 2.1, 0.07, "partition").moved(0, 0.12)]
        parts += [block(0.06, 0.14, 0.5, "dark_metal").moved(side * 0.9) for side in (-1, 1)]
        for side, turn in ((1, 0), (-1, 180)):
            frame = make.picture(1.5, 1.05, ("oak", "dark_metal")[i % 2], PAINTS, 40 + 2 * i + side)
            parts.append(frame.moved(0, 0.85, 0.035 + GAP).turned(turn))
        meshes.append(merge(parts).turned(degrees).moved(x, GAP, z).mesh(f"panel_{i + 1}"))
    on_walls = [
        (make.picture(2.4, 1.6, "dark_metal", PAINTS[::-1], 5), 90, -WIDTH / 2 + GAP, -1.6),
        (make.picture(1.8, 1.8, "oak", PAINTS, 6), 90, -WIDTH / 2 + GAP, 2.6),
        (make.picture(2.4, 1.5, "oak", PAINTS, 9), 180, -6.0, DEPTH / 2 - GAP),
        (make.picture(2.4, 1.5, "dark_metal", PAINTS[::-1], 10), 180, 0.5, DEPTH / 2 - GAP),
        (make.picture(1.8, 1.8, "dark_metal", PAINTS, 14), -90, WIDTH / 2 - GAP, -0.5),
    ]
    for i, (frame, turn, x, z) in enumerate(on_walls):
        meshes.append(frame.turned(turn).moved(x, 1.2, z).mesh(f"picture_{i + 1}"))
    return meshes


# Sculpture, height of its plinth, x, z.
_SCULPTURES: dict[str, tuple[Shape, float, float, float]] = {
    "twist": (art.twist(0.42, 1.25, 0.42, "marble"), 0.55, -2.2, -0.55),
    "hoops": (art.hoops(0.46, 0.032, "brass"), 0.9, 4.7, -0.6),
    "sail": (art.sail(0.9, 1.0, "verdigris", "dark_metal"), 0.8, 7.0, -0.9),
    "figure": (art.figure(1.25, "terracotta"), 0.6, -4.3, 1.8),
    "totem": (art.totem("clay", "brass"), 0.7, -6.1, -1.0),
    "spiral": (art.spiral(0.3, 0.95, "lacquer"), 0.8, -1.3, 4.0),
}


def _podiums() -> list[Mesh]:
    return [
        art.on_plinth(sculpture, 0.78, height, "plinth").moved(x, GAP, z).mesh(f"podium_{name}")
        for name, (sculpture, height, x, z) in _SCULPTURES.items()
    ]


def _furniture() -> list[Mesh]:
    plant = make.pot_plant("clay", "soil", "leaf", 2).scaled(1.25)
    pieces = {
        "bench_1": _bench().turned(90).moved(-3.6, GAP, -0.6),
        "bench_2": _bench().moved(2.4, GAP, 4.6),
        "plant_1": plant.moved(-9.3, GAP, -3.4),
        "plant_2": plant.turned(75).moved(9.3, GAP, -3.4),
        "plant_3": plant.turned(200).moved(9.2, GAP, 4.6),
        "barrier": _barrier(0.95).moved(-2.2, GAP, -0.55),
        "info_desk": _info_desk().turned(-20).moved(-0.2, GAP, 6.0),
        "door": make.door(1.6, 2.3, "oak", "steel", "dark_metal")
        .turned(-90)
        .moved(WIDTH / 2 - GAP, GAP, 2.4),
    }
    return [piece.mesh(name) for name, piece in pieces.items()]


def _barrier(half: float) -> Shape:
    """Four posts with sagging ropes, around a square."""
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    post = lathe(
        [(0.13, 0), (0.13, 0.01), (0.02, 0.03), (0.016, 0.86), (0.03, 0.88), (0.03, 0.92)], 16, "brass"
    )
    parts = [post.moved(x, 0, z) for x, z in corners]
    t = np.linspace(0, 1, 13)
    for (x0, z0), (x1, z1) in zip(corners, corners[1:] + corners[:1], strict=True):
        sag = 0.84 - 0.22 * 4 * t * (1 - t)
        path = np.stack([x0 + (x1 - x0) * t, sag, z0 + (z1 - z0) * t], axis=1)
        parts.append(tube(path, 0.014, 8, "rope"))
    return merge(parts)


def _info_desk() -> Shape:
    """Curved counter of 1.1 m height, its outside to -z."""

    def arc(half: float, inner: float, outer: float, low: float, high: float, material: str) -> Shape:
        angle = np.radians(np.linspace(270 - half, 270 + half, 33))
        round_ = np.stack([np.cos(angle), np.zeros(33), np.sin(angle)], axis=1)
        front, back = (np.stack([r * round_ + [0, y, 0] for y in (low, high)]) for r in (outer, inner))
        return shell(front, back, material)

    return merge([arc(70, 1.25, 1.40, 0.0, 1.05, "plinth"), arc(72, 1.15, 1.48, 1.049, 1.09, "oak")])


def _exhibit() -> Mesh:
    x, z = EXHIBIT_AT
    exhibit = art.on_plinth(art.knot(0.42, 0.062, "bronze"), 0.62, 0.85, "plinth")
    return exhibit.mesh("exhibit", at=(x, GAP, z), degrees=25, movable=True)
