# SPDX-License-Identifier: Apache-2.0
"""Two sites: a house on uneven land with sun, windows and lamps; a courtyard with façades under a sky."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from oracles.path_tracer import Target

from .truth_draft import Array, Draft, Hole, Paint, box_faces, hole_target, vector
from .truth_rooms import Room, build, ceiling_lamp, furnish, glow, hole, line_hole, work_plane

SUN, SKY = 8e4, 3000.0  # lux; candela per square metre
PAINTS = {
    "wall": Paint(0.7), "wood": Paint(0.35), "plaster": Paint(0.5), "land": Paint(0.2), "leaves": Paint(0.15),
}  # fmt: skip


def house(draft: Draft, rng: np.random.Generator) -> dict[str, list[Target]]:
    """Two rooms behind walls of 30 cm with a door between them, hedges and a shed, 150 m of land."""
    draft.paints |= PAINTS
    door, wide = hole("right", 0.6, 0.0, 0.9, 2.1), hole("back", 1.4, 0.9, 2.0, 1.3)
    small = hole("right", 1.5, 1.1, 0.8, 0.9)
    living = Room(vector((0, 0, 0)), vector((5.2, 2.6, 4.4)), {"right": [door], "back": [wide]})
    study = Room(vector((5.3, 0, 0)), vector((8.6, 2.6, 4.4)), {"left": [_mirrored(door)], "right": [small]})
    draft.suns["sun"] = vector((-0.35, -0.55, 0.76)) / np.linalg.norm((-0.35, -0.55, 0.76)), SUN
    build(draft, living, "wall", "plaster", 0.0, "living")
    build(draft, study, "wall", "plaster", 0.0, "study")
    line_hole(draft, "door", "wood", hole_target(living.faces["right"], door), 0.1)
    hull = Room(vector((-0.3, -0.6, -0.3)), vector((8.9, 2.9, 4.7)))
    _hull(draft, hull, [hole_target(living.faces["back"], wide), hole_target(study.faces["right"], small)])
    furnish(draft, living, rng, 5)
    furnish(draft, Room(study.low + vector((0.9, 0, 0)), study.high), rng, 2)
    ceiling_lamp(draft, living, rng, 1500, "ceiling lamp")
    draft.bulbs["desk lamp"] = study.low + vector((2.4, 1.3, 3.2)), 40.0
    draft.triangles("land", "land", _uneven(rng, 75, 30, 0.12, vector((4.3, -0.35, 2.2))))
    for k, x in enumerate((-7, 1, 9)):
        draft.box(f"hedge {k}", "leaves", (x, -0.6, -9.5), (x + 5, 1.4, -8.5))
    draft.box("shed", "wood", (14, -0.6, 3), (17, 2.4, 6), turn=0.3)
    for room in (living, study):
        draft.patches([o for o in room.openings() if o.corner[1] > 0.5], list(room.faces.values()))
    return {"rooms": _walls(living) + _walls(study) + _planes(living) + _planes(study)}


def courtyard(draft: Draft, rng: np.random.Generator) -> dict[str, list[Target]]:
    """A court of 16 x 11 m between façades of 12 m with balconies, and a room on the ground floor."""
    draft.paints |= PAINTS
    court = Room(vector((0, 0, 0)), vector((16, 12, 11)))
    window = hole("right", 3.2, 1.0, 2.4, 1.5)
    room = Room(vector((-5, 0, 2.5)), vector((0, 3, 8.3)), {"right": [window]})
    opening = hole_target(room.faces["right"], window)
    faces = court.faces
    for side in ("right", "back", "front", "floor"):
        draft.wall("court", "plaster", faces[side])
    left = faces["left"]
    draft.wall("court", "plaster", left, [_hole_in(Target(left.corner, left.v, left.u), opening)])
    for side, face in room.faces.items():
        if side != "right":
            draft.wall("room", "wall", face)
    draft.opening(opening)
    for k in range(6):
        low = vector((2 + 4.5 * (k % 3), 3.2 + 3.5 * (k // 3), 10.0))
        draft.box(f"balcony {k}", "plaster", low, low + vector((2.6, 0.9, 1.0)))
    for side, face in box_faces((-60, 12.1, -60), (76, 70, 71)).items():
        if side != "floor":
            draft.paints["sky"] = Paint(0.0, SKY)
            draft.quad("sky", "sky", face.corner, face.u, face.v)
    draft.opening(faces["ceiling"])
    draft.quad("roofs", "land", (-60, 12.1, -60), (0, 0, 131), (59.9, 0, 0))
    furnish(draft, room, rng, 4)
    draft.paints["glow"] = glow(900, 0.24)
    draft.panel("lamp", "glow", (-3.0, 2.95, 5.0), (0.4, 0, 0), (0, 0, 0.6))
    draft.box("kiosk", "wood", (9, 0, 3), (11.5, 2.6, 5), turn=0.4)
    draft.solids.append((vector((10.25, 1.3, 4)), vector((1.25, 1.3, 1)), 0.4))
    outside = [faces["back"], faces["right"], faces["floor"]]
    return {"rooms": _walls(room) + _planes(room), "court": outside}


PLACES: dict[str, Callable[[Draft, np.random.Generator], dict[str, list[Target]]]] = {
    "house": house,
    "courtyard": courtyard,
}


def _mirrored(door: Hole) -> Hole:
    """A hole of a wall's right side as one of its other side, where u is vertical."""
    a, b, c, d = door
    return (c, d, a, b)


def _hull(draft: Draft, hull: Room, openings: list[Target]) -> None:
    """Outer walls with the holes of `openings`, and what lines these."""
    for face in hull.faces.values():
        holes = []
        for own in openings:
            normal = np.cross(face.u, face.v) / np.linalg.norm(np.cross(face.u, face.v))
            depth = (own.corner - face.corner) @ normal
            if 0 < depth < 0.5 and abs(own.u @ normal) + abs(own.v @ normal) < 1e-9:
                holes.append(_hole_in(face, own))
                line_hole(draft, "linings", "plaster", own, depth)
        draft.wall("hull", "plaster", Target(face.corner, face.v, face.u), holes)


def _hole_in(face: Target, own: Target) -> Hole:
    """The hole where `face` is seen from its back, with u and v changed."""
    a, b = (
        sorted((c - face.corner) @ e / np.linalg.norm(e) for c in (own.corner, own.corner + own.u + own.v))
        for e in (face.v, face.u)
    )
    return a[0], a[1], b[0], b[1]


def _uneven(rng: np.random.Generator, half: float, cells: int, bumps: float, middle: Array) -> Array:
    """Triangles of a square of land."""
    steps = np.linspace(-half, half, cells + 1)
    x, z = np.meshgrid(middle[0] + steps, middle[2] + steps, indexing="ij")
    y = middle[1] + bumps * rng.uniform(-1, 1, x.shape)
    p = np.stack([x, y, z], axis=2)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    return np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, c, b), (a, d, c))])


def _walls(room: Room) -> list[Target]:
    """Walls without holes, and the ceiling."""
    return [face for side, face in room.faces.items() if side not in ("floor", *room.holes)]


def _planes(room: Room) -> list[Target]:
    plain = Draft()
    work_plane(plain, room)
    return plain.planes
