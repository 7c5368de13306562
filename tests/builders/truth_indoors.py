# SPDX-License-Identifier: Apache-2.0
"""Random rooms: ratios of powers, openings, joined lamps, doubled faces, white walls, furniture, halls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from oracles.path_tracer import Target

from .truth_draft import Draft, Paint, box_faces, vector
from .truth_outdoors import SUN, land, sun_from
from .truth_rooms import (
    Room,
    build,
    ceiling_lamp,
    furnish,
    glow,
    hole,
    random_paints,
    random_size,
    work_plane,
)


def ratio(draft: Draft, rng: np.random.Generator) -> None:
    """A weak lamp whose room the strong light does not enter, or is switched off in."""
    variant = str(rng.choice(("next room", "lantern", "dimmed", "sky")))
    power = float(10 ** rng.uniform(0, 12))
    draft.about |= {"variant": variant, "ratio": f"{power:.0e}"}
    random_paints(draft, rng)
    room = Room(vector((0, 0, 0)), random_size(rng))
    weak = float(10 ** rng.uniform(-3, 2))
    build(draft, room, "wall", "land", 0.1)
    ceiling_lamp(draft, room, rng, weak, "weak")
    furnish(draft, room, rng, int(rng.integers(0, 3)))
    work_plane(draft, room)
    if variant == "dimmed":
        ceiling_lamp(draft, room, rng, weak * power, "strong")
        draft.dimmed.append("strong")
    elif variant == "sky":
        for face in box_faces((-500, -500, -500), (500, 500, 500)).values():
            draft.paints["sky"] = Paint(0.0, weak * power / (np.pi * 6e6))
            draft.quad("sky", "sky", face.corner, face.u, face.v)
    else:
        low = (
            room.low + vector((room.size[0] + 0.5, 0, 0))
            if variant == "next room"
            else room.low + room.size * 0.4
        )
        other = Room(low, low + (vector((3, 2.5, 3)) if variant == "next room" else 0.3))
        build(draft, other, "wall", "land", 0.02, "other")
        draft.pieces = [p if p.mesh != "other" else replace(p, measured=False) for p in draft.pieces]
        draft.solids.append(((low + other.high) / 2, other.size / 2 + 0.02, 0.0))
        draft.bulbs["strong"] = (other.low + other.high) / 2, weak * power / (4 * np.pi)


def opening(draft: Draft, rng: np.random.Generator) -> None:
    """A dark room that gets its light through a gap or a hole of 5 mm to a window."""
    width = float(rng.choice((0.005, 0.02, 0.1, 0.6)))
    slit = rng.random() < 0.5
    behind = str(rng.choice(("panel", "sun", "room")))
    draft.about |= {"width": width, "shape": "slit" if slit else "square", "behind": behind}
    random_paints(draft, rng)
    size, side = random_size(rng), "left"
    height = rng.uniform(0.3, 2.0) if slit else width
    own = hole(
        side, rng.uniform(0.5, size[2] - 0.5 - width), rng.uniform(0.2, size[1] - height - 0.1), width, height
    )
    room = Room(vector((0, 0, 0)), size, {side: [own]})
    build(draft, room, "wall", "land", 0.0)
    work_plane(draft, room)
    furnish(draft, room, rng, int(rng.integers(0, 3)))
    if behind == "sun":
        land(draft, room, 30, 0.01)
        draft.suns["sun"] = sun_from(side, rng), SUN
        draft.patches(room.openings(), list(room.faces.values()))
        return
    next_room = box_faces(room.low - (3, 0, 0), room.high * (0, 1, 1))
    for name, face in next_room.items():
        if name != "right":
            draft.quad("next room", "wall" if behind == "room" else "land", face.corner, face.u, face.v)
    middle = vector((-1.5, size[1] / 2, size[2] / 2))
    if behind == "room":
        draft.bulbs["lamp"] = middle + rng.uniform(-0.7, 0.7, 3), 300.0
        draft.patches(room.openings(), list(room.faces.values()))
    else:
        draft.paints["glow"] = glow(4000, 1.44)
        draft.panel("panel", "glow", middle + vector((-1.0, 0.2 * size[1], -0.6)), (1.2, 0, 0), (0, 0, 1.2))


def joined(draft: Draft, rng: np.random.Generator) -> None:
    """Many lamps that are one mesh, in a furnished room."""
    count, boxes = int(rng.choice((2, 5, 20, 60, 150))), rng.random() < 0.4
    count = min(count, 20) if boxes else count
    draft.about |= {"lamps": count, "as": "boxes" if boxes else "panels"}
    random_paints(draft, rng)
    room = Room(vector((0, 0, 0)), random_size(rng) * (1.5, 1, 1.5))
    build(draft, room, "wall", "land", 0.0)
    furnish(draft, room, rng, int(rng.integers(2, 8)))
    work_plane(draft, room)
    half = rng.uniform(0.02, 0.15)
    draft.paints["glow"] = glow(3000, count * 4 * half**2 * (6 if boxes else 1))
    side = int(np.ceil(np.sqrt(count)))
    for k in range(count):
        at = vector((k % side + 0.5, 0, k // side + 0.5)) / side * room.size
        at = at + vector((0, room.high[1] - 0.35, 0))
        if not boxes:
            draft.panel("lamps", "glow", at - (half, -0.2, half), (2 * half, 0, 0), (0, 0, 2 * half))
            continue
        draft.box("lamps", "glow", at - half, at + half)
        draft.hints += [Target(p.corner, p.u, p.v) for p in draft.pieces[-6:]]


def doubled(draft: Draft, rng: np.random.Generator) -> None:
    """Faces that lie twice or overlap, exactly or 0.1 mm apart, and a lamp that does."""
    walls, furniture, lamp = (bool(x) for x in rng.random(3) < (0.5, 0.5, 0.3))
    patches, veneer = int(rng.integers(0, 6)), rng.random() < 0.4
    draft.about |= {
        "walls": walls,
        "furniture": furniture,
        "lamp": lamp,
        "patches": patches,
        "veneer": veneer,
    }
    random_paints(draft, rng)
    room = Room(vector((0, 0, 0)), random_size(rng))
    build(draft, room, "wall", "land", 0.0)
    furnish(draft, room, rng, int(rng.integers(1, 5)))
    ceiling_lamp(draft, room, rng, 2000)
    copied = ["room"] * walls + [f"thing {k}" for k in range(5)] * furniture + ["lamp"] * lamp
    for piece in [p for p in draft.pieces if p.mesh in copied]:
        draft.quad(f"{piece.mesh} again", piece.paint, piece.corner, piece.u, piece.v)
    for k in range(patches):
        size = rng.uniform(0.3, 1.5, 2)
        x, z = (rng.uniform(room.low[a], room.high[a] - s) for a, s in zip((0, 2), size, strict=True))
        draft.quad(f"patch {k}", "wall", (x, room.low[1], z), (0, 0, size[1]), (size[0], 0, 0))
    if veneer:
        floor = room.faces["floor"]
        draft.quad("veneer", "wood", floor.corner + vector((0, 1e-4, 0)), floor.u, floor.v)
    work_plane(draft, room)


def white(draft: Draft, rng: np.random.Generator) -> None:
    """A closed room whose surfaces reflect 0.9 to 0.98."""
    reflectance = float(rng.choice((0.9, 0.95, 0.98)))
    draft.about |= {"reflectance": reflectance}
    draft.paints |= {name: Paint(reflectance) for name in ("wall", "wood", "land")}
    room = Room(vector((0, 0, 0)), random_size(rng) * rng.uniform(0.2, 1.5))
    build(draft, room, "wall", "land", 0.0)
    if room.size.min() > 2.4:
        furnish(draft, room, rng, int(rng.integers(0, 3)))
    draft.bulbs["lamp"] = room.low + room.size * rng.uniform(0.35, 0.65, 3), 100.0


def furnished(draft: Draft, rng: np.random.Generator) -> None:
    """An ordinary room: furniture, some lamps."""
    lamps, things = int(rng.integers(1, 4)), int(rng.integers(4, 11))
    draft.about |= {"lamps": lamps, "things": things}
    random_paints(draft, rng)
    room = Room(vector((0, 0, 0)), random_size(rng) * (1.4, 1, 1.4))
    build(draft, room, "wall", "land", 0.0)
    furnish(draft, room, rng, things)
    for k in range(lamps):
        ceiling_lamp(draft, room, rng, float(rng.uniform(300, 3000)), f"lamp {k}")
    work_plane(draft, room)


def hall(draft: Draft, rng: np.random.Generator) -> None:
    """A hall of panels, each a mesh of its own, over shelves."""
    rows, columns = int(rng.integers(3, 7)), int(rng.integers(4, 10))
    draft.about |= {"panels": rows * columns}
    random_paints(draft, rng)
    room = Room(vector((0, 0, 0)), vector((columns * 3.0, rng.uniform(3, 6), rows * 3.0)))
    build(draft, room, "wall", "land", 0.0)
    draft.paints["glow"] = glow(4000, 0.72)
    for k in range(rows * columns):
        corner = (3 * (k % columns) + 0.9, room.high[1] - 0.02, 3 * (k // columns) + 1.2)
        draft.panel(f"panel {k}", "glow", corner, (1.2, 0, 0), (0, 0, 0.6))
    for k in range(rows - 1):
        low = vector((1.5, 0, 3 * k + 2.8))
        draft.solid(f"shelf {k}", "wood", low, low + vector((room.size[0] - 3, rng.uniform(1.5, 2.2), 0.4)))
    work_plane(draft, room)


def bulb(draft: Draft, rng: np.random.Generator) -> None:
    """A small luminous box at the origin of coordinates."""
    half = float(10 ** rng.uniform(-2.5, -1))
    draft.about |= {"size": round(2 * half, 4)}
    draft.centred = True
    random_paints(draft, rng)
    size = random_size(rng)
    low = -size * rng.uniform(0.3, 0.7, 3)
    room = Room(low, low + size)
    build(draft, room, "wall", "land", 0.0)
    draft.paints["glow"] = glow(1000, 24 * half**2)
    draft.box("bulb", "glow", (-half,) * 3, (half,) * 3)
    draft.hints += [Target(p.corner, p.u, p.v) for p in draft.pieces[-6:]]
