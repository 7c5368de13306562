# SPDX-License-Identifier: Apache-2.0
"""Rooms of random size with holes, furniture and lamps: what the kinds of random scenes are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from oracles.path_tracer import Target

from .truth_draft import SIDES, Array, Draft, Hole, Paint, box_faces, hole_target, turned, vector

PLANE = 0.8  # height of the work plane, metres
UPRIGHT = {"left": True, "front": True, "right": False, "back": False}  # whether u of the side is vertical


@dataclass(frozen=True, eq=False)
class Room:
    """The inside of a box, and holes of its walls by side."""

    low: Array
    high: Array
    holes: Mapping[str, Sequence[Hole]] = field(default_factory=dict)

    @property
    def size(self) -> Array:
        return self.high - self.low

    @property
    def faces(self) -> dict[str, Target]:
        return box_faces(self.low, self.high)

    def openings(self) -> list[Target]:
        """The holes on the inside of the walls."""
        return [hole_target(self.faces[side], hole) for side, holes in self.holes.items() for hole in holes]


def random_size(rng: np.random.Generator) -> Array:
    return vector((rng.uniform(3, 6), rng.uniform(2.4, 3.2), rng.uniform(3, 5)))


def hole(side: str, along: float, up: float, width: float, height: float) -> Hole:
    """A hole of a wall: its place along the wall and its sill, whichever of u and v is vertical."""
    level, vertical = (along, along + width), (up, up + height)
    return (*vertical, *level) if UPRIGHT[side] else (*level, *vertical)


def window(rng: np.random.Generator, size: Array, side: str, width: float, height: float) -> Hole:
    """At a random place of the wall."""
    length = size[2] if side in ("left", "right") else size[0]
    width = min(width, length - 0.4)
    height = min(height, size[1] - 0.6)
    return hole(
        side, rng.uniform(0.2, length - width - 0.2), rng.uniform(0.3, size[1] - height - 0.2), width, height
    )


def random_paints(draft: Draft, rng: np.random.Generator, land: float | None = None) -> None:
    draft.paints["wall"] = Paint(rng.uniform(0.3, 0.8))
    draft.paints["wood"] = Paint(rng.uniform(0.1, 0.6))
    draft.paints["land"] = Paint(rng.uniform(0.1, 0.4) if land is None else land)


def build(draft: Draft, room: Room, paint: str, outside: str, thick: float, mesh: str = "room") -> None:
    """Walls, floor and ceiling, seen from inside; with `thick` also an outer hull and the holes' linings."""
    for side, face in room.faces.items():
        draft.wall(mesh, paint, face, room.holes.get(side, ()), measured=True)
    if thick > 0:
        outer = box_faces(room.low - thick, room.high + thick)
        for side in SIDES:
            holes, f = room.holes.get(side, ()), outer[side]
            swapped = [(c + thick, d + thick, a + thick, b + thick) for a, b, c, d in holes]
            draft.wall(f"{mesh} hull", outside, Target(f.corner, f.v, f.u), swapped)
            for own in holes:
                line_hole(draft, f"{mesh} hull", outside, hole_target(room.faces[side], own), thick)
    for opening in room.openings():
        draft.opening(opening)


def line_hole(draft: Draft, mesh: str, paint: str, opening: Target, thick: float) -> None:
    """Close a wall of that thickness around an opening of its inside."""
    normal = np.cross(opening.u, opening.v)
    out = -thick * normal / np.linalg.norm(normal)
    o, u, v = opening.corner, opening.u, opening.v
    for corner, edge in ((o, u), (o + u, v), (o + u + v, -u), (o + v, -v)):
        draft.quad(mesh, paint, corner, edge, out)


def furnish(draft: Draft, room: Room, rng: np.random.Generator, count: int, paint: str = "wood") -> None:
    """Boxes and tables that stand on the floor, turned, apart from each other and from the walls."""
    taken: list[tuple[float, float, float]] = []
    for number in range(count):
        size = vector((rng.uniform(0.2, 1.2), rng.uniform(0.2, 1.8), rng.uniform(0.2, 0.8)))
        table, turn = rng.random() < 0.3, rng.uniform(0, np.pi)
        wide = 0.5 * float(np.hypot(size[0], size[2]))
        for _ in range(30):
            x, z = (rng.uniform(room.low[k] + wide + 0.03, room.high[k] - wide - 0.03) for k in (0, 2))
            if all(np.hypot(x - a, z - b) > wide + c for a, b, c in taken):
                break
        else:
            continue
        taken.append((x, z, wide))
        name, place = f"thing {number}", vector((x, room.low[1], z))
        if rng.random() < 0.3:
            draft.movable.add(name)
        if table:
            _table(draft, name, paint, place, size, turn)
        else:
            half = vector((size[0] / 2, 0, size[2] / 2))
            gap = vector((0, rng.choice((0.0, 0.001)), 0))
            draft.solid(name, paint, place - half + gap, place + half + vector((0, size[1], 0)), turn)


def _table(draft: Draft, mesh: str, paint: str, place: Array, size: Array, turn: float) -> None:
    half, top = vector((size[0] / 2, 0, size[2] / 2)), 0.72
    draft.solid(
        mesh, paint, place + vector((0, top - 0.04, 0)) - half, place + vector((0, top, 0)) + half, turn
    )
    for x in (-1, 1):
        for z in (-1, 1):
            offset = half * (0.9 * x, 0, 0.9 * z)
            foot = place + turned(turn) @ offset
            draft.solid(mesh, paint, foot - (0.02, 0, 0.02), foot + vector((0.02, top - 0.04, 0.02)), turn)


def ceiling_lamp(
    draft: Draft, room: Room, rng: np.random.Generator, lumens: float, mesh: str = "lamp"
) -> None:
    """A luminous panel close below the ceiling, or a bulb above man's height."""
    x, z = (rng.uniform(room.low[k] + 0.7, room.high[k] - 0.7) for k in (0, 2))
    if rng.random() < 0.4:
        y = rng.uniform(1.6, room.size[1] - 0.4) + room.low[1]
        draft.bulbs[mesh] = vector((x, y, z)), lumens / (4 * np.pi)
        return
    a, b = rng.uniform(0.15, 0.6, 2)
    draft.paints[f"{mesh} glow"] = glow(lumens, 4 * a * b)
    corner = (x - a, room.high[1] - rng.uniform(0.01, 0.2), z - b)
    draft.panel(mesh, f"{mesh} glow", corner, (2 * a, 0, 0), (0, 0, 2 * b))


def glow(lumens: float, area: float) -> Paint:
    """The paint of a lamp that emits `lumens` from its front."""
    return Paint(0.0, lumens / (np.pi * area))


def work_plane(draft: Draft, room: Room) -> None:
    """Draw points on a plane at the height of tables, too."""
    low, size = room.low + vector((0.1, PLANE, 0.1)), room.size - 0.2
    draft.planes.append(Target(low, vector((0, 0, size[2])), vector((size[0], 0, 0))))
