# SPDX-License-Identifier: Apache-2.0
"""Random scenes on land: rooms on sunny sites, sheds on terrain, windows under luminous domes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from oracles.path_tracer import Target

from .truth_draft import Array, Draft, Hole, Paint, box_faces, turned, vector
from .truth_rooms import (
    UPRIGHT,
    Room,
    build,
    ceiling_lamp,
    furnish,
    random_paints,
    random_size,
    window,
    work_plane,
)

SITES = (0, 30, 120, 600, 2000, 10_000)  # metres of land around the room, from side to side
WALLS = ("left", "right", "back", "front")
SUN = 1e5  # lux


def land(draft: Draft, room: Room, side: float, depth: float) -> None:
    """A square of land below the house, `depth` below the floor."""
    if side:
        middle = (room.low + room.high) / 2
        corner = vector((middle[0] - side / 2, room.low[1] - depth, middle[2] - side / 2))
        draft.quad("land", "land", corner, (0, 0, side), (side, 0, 0))


def sun_from(side: str, rng: np.random.Generator, steepest: float = 60) -> Array:
    """A direction of travel that enters through the wall `side`."""
    normal = {"left": (1, 0), "right": (-1, 0), "back": (0, 1), "front": (0, -1)}[side]
    up, aside = np.radians(rng.uniform(20, steepest)), np.radians(rng.uniform(-50, 50))
    level = turned(aside) @ vector((normal[0], 0, normal[1])) * np.cos(up)
    return level - (0, np.sin(up), 0)


def _neighbours(draft: Draft, room: Room, rng: np.random.Generator, site: float, depth: float) -> None:
    """Houses on the site, away from the room."""
    for number in range(int(rng.integers(0, 4)) if site >= 120 else 0):
        size, turn = rng.uniform((6, 3, 6), (14, 9, 14)), rng.uniform(0, np.pi)
        away, angle = rng.uniform(18, 0.45 * site), rng.uniform(0, 2 * np.pi)
        place = (room.low + room.high) / 2 + away * vector((np.cos(angle), 0, np.sin(angle)))
        low = vector((place[0] - size[0] / 2, room.low[1] - depth - 0.5, place[2] - size[2] / 2))
        draft.box(f"house {number}", "wood", low, low + size, turn)


def site_lamp(draft: Draft, rng: np.random.Generator) -> None:
    """A closed room with a lamp on a sunny site."""
    site, lumens, thick = int(rng.choice(SITES)), float(10 ** rng.uniform(2, 3.5)), rng.uniform(0.05, 0.3)
    draft.about |= {"site": site, "lumens": round(lumens)}
    random_paints(draft, rng)
    room = Room(vector((0, 0, 0)), random_size(rng))
    build(draft, room, "wall", "land", thick)
    land(draft, room, site, thick)
    _neighbours(draft, room, rng, site, thick)
    draft.suns["sun"] = sun_from("left", rng), SUN
    furnish(draft, room, rng, int(rng.integers(0, 4)))
    ceiling_lamp(draft, room, rng, lumens)
    work_plane(draft, room)


def site_sun(draft: Draft, rng: np.random.Generator) -> None:
    """Sun through a window, and what the land reflects into the room."""
    site, side = int(rng.choice(SITES)), str(rng.choice(WALLS))
    soil, thick = float(rng.choice((0.0, 0.3))), float(rng.choice((0.0, 0.2)))
    size, width, height = random_size(rng), rng.uniform(0.5, 2), rng.uniform(0.5, 1.5)
    draft.about |= {"site": site, "land": soil, "window": f"{width:.1f} x {height:.1f}", "thick": thick}
    random_paints(draft, rng, soil)
    room = Room(vector((0, 0, 0)), size, {side: [window(rng, size, side, width, height)]})
    build(draft, room, "wall", "land", thick)
    land(draft, room, site, thick + 0.01)
    _neighbours(draft, room, rng, site, thick + 0.01)
    draft.suns["sun"] = sun_from(side, rng), SUN
    furnish(draft, room, rng, int(rng.integers(0, 4)))
    draft.patches(room.openings(), list(room.faces.values()))
    work_plane(draft, room)


def terrain(draft: Draft, rng: np.random.Generator) -> None:
    """A shed on uneven land of small triangles: dark, lit by a lamp, or through a window."""
    inside = str(rng.choice(("nothing", "lamp", "window")))
    bumps, half, cells = float(rng.choice((0.005, 0.05, 0.2))), rng.uniform(5, 12), int(rng.integers(16, 29))
    draft.about |= {"inside": inside, "bumps": bumps, "cell": round(2 * half / cells, 2)}
    random_paints(draft, rng)
    size, side = random_size(rng), str(rng.choice(WALLS))
    at = window(rng, size - (0, 0.5, 0), side, 1.2, 1.0)
    at = _lower(at, side, -1.5)
    room = Room(vector((0, -1, 0)), size, {side: [at]} if inside == "window" else {})
    for name, face in room.faces.items():
        if name != "floor":
            upper = room.holes.get(name, ())
            draft.wall("shed", "wall", face, upper)
    for opened in room.openings():
        draft.opening(opened)
    draft.triangles("terrain", "land", _heights(rng, room, half, cells, bumps))
    draft.suns["sun"] = sun_from(side, rng), SUN
    draft.patches(room.openings(), list(box_faces(room.low + vector((0, 1, 0)), room.high).values()))
    above = Room(room.low + vector((0, 1, 0)), room.high)
    if inside == "lamp":
        ceiling_lamp(draft, above, rng, 500)
    if inside == "nothing":
        draft.dark = 1e-5 * SUN
    work_plane(draft, above)
    clear = Room(room.low + vector((0, 1.3, 0)), room.high)  # above the highest bump
    for name in WALLS:
        holes = [_lower(at, name, 1.3)] if inside == "window" and name == side else []
        _draw_beside(draft, clear.faces[name], holes)


def _draw_beside(draft: Draft, face: Target, holes: Sequence[Hole]) -> None:
    """Draw points on a wall beside its holes."""
    plain = Draft()
    plain.wall("", "", face, holes)
    draft.planes += [Target(p.corner, p.u, p.v) for p in plain.pieces]


def _lower(at: Hole, side: str, by: float) -> Hole:
    a, b, c, d = at
    return (a - by, b - by, c, d) if UPRIGHT[side] else (a, b, c - by, d - by)


def _heights(rng: np.random.Generator, room: Room, half: float, cells: int, bumps: float) -> Array:
    """Triangles of an uneven square of land around the room."""
    middle, steps = (room.low + room.high) / 2, np.linspace(-half, half, cells + 1)
    x, z = np.meshgrid(middle[0] + steps, middle[2] + steps, indexing="ij")
    y = bumps * np.sin(2.1 * x + rng.uniform(0, 6)) * np.cos(1.7 * z) + 0.2 * bumps * rng.uniform(
        -1, 1, x.shape
    )
    p = np.stack([x, y, z], axis=2)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    return np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, c, b), (a, d, c))])


def dome(draft: Draft, rng: np.random.Generator) -> None:
    """A luminous dome seen through windows."""
    radius, reflectance = float(rng.choice((20, 60, 250, 1000))), float(rng.choice((0.0, 0.5)))
    size, side = random_size(rng), str(rng.choice(WALLS))
    width, height = rng.uniform(0.3, 2, 2)
    draft.about |= {"radius": radius, "reflectance": reflectance, "window": f"{width:.1f} x {height:.1f}"}
    draft.paints |= {
        "wall": Paint(reflectance), "wood": Paint(reflectance), "land": Paint(0.2), "sky": Paint(0.0, 2000.0),
    }  # fmt: skip
    room = Room(vector((0, 0, 0)), size, {side: [window(rng, size, side, width, height)]})
    build(draft, room, "wall", "land", 0.0)
    land(draft, room, 2 * radius, 0.01)
    furnish(draft, room, rng, int(rng.integers(0, 3)))
    draft.triangles("sky", "sky", _globe(radius, 6) + (room.low + room.high) / 2)
    work_plane(draft, room)


def _globe(radius: float, rings: int) -> Array:
    """Triangles of a globe about the origin, seen from inside."""
    polar, turn = np.meshgrid(
        np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1), indexing="ij"
    )
    p = radius * np.stack([np.sin(polar) * np.cos(turn), np.cos(polar), np.sin(polar) * np.sin(turn)], axis=2)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    lower, upper = (np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d)))
    every = np.concatenate([lower, upper])
    cross = np.cross(every[:, 1] - every[:, 0], every[:, 2] - every[:, 0])
    every = every[np.linalg.norm(cross, axis=1) > 1e-9 * radius**2]
    cross = np.cross(every[:, 1] - every[:, 0], every[:, 2] - every[:, 0])
    outwards = (cross * every.mean(axis=1)).sum(axis=1) > 0
    every[outwards] = every[outwards][:, ::-1]
    return every
