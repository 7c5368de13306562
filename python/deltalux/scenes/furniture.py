# SPDX-License-Identifier: Apache-2.0
"""Furniture of the demonstration scenes; each piece stands on y = 0 and faces +z."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from .shapes import (
    GAP,
    Shape,
    block,
    box,
    lathe,
    merge,
    prism,
    rounded_rectangle,
    skyline,
    tube,
)

BULB_RADIUS = 0.035  # of `desk_lamp`, metres


def wooden_chair(wood: str, seat: str) -> Shape:
    """Wooden chair, about 0.46 x 0.88 x 0.5 m; it faces +z."""
    parts = []
    for side in (-1, 1):
        parts.append(lathe([(0.014, 0), (0.02, 0.30), (0.02, 0.43)], 12, wood).moved(side * 0.19, 0, 0.19))
        # The back leg continues as the upright of the back, which leans backwards.
        upright = [
            (side * 0.17, 0, -0.195),
            (side * 0.17, 0.02, -0.195),
            (side * 0.17, 0.25, -0.185),
            (side * 0.17, 0.45, -0.185),
            (side * 0.175, 0.65, -0.205),
            (side * 0.18, 0.86, -0.245),
        ]
        parts.append(tube(upright, [0.014, 0.014, 0.02, 0.02, 0.018, 0.014], 12, wood))
        parts.append(tube([(side * 0.188, 0.2, 0.18), (side * 0.172, 0.2, -0.18)], 0.011, 8, wood))
    parts.append(tube([(-0.18, 0.2, 0.0), (0.18, 0.2, 0.0)], 0.011, 8, wood))
    parts.append(prism(rounded_rectangle(0.46, 0.43, 0.06, 5), 0.035, seat, bevel=0.008).moved(0, 0.42, 0.01))
    rail = np.array(
        [
            (0.012, 0.0),
            (0.012, 0.028),
            (-0.0, 0.034),
            (-0.012, 0.028),
            (-0.012, 0.0),
            (-0.012, -0.028),
            (0.0, -0.034),
            (0.012, -0.028),
        ]
    )
    for y, z, half in ((0.56, -0.195, 0.171), (0.69, -0.212, 0.174), (0.82, -0.236, 0.178)):
        x = np.linspace(-half, half, 9)
        path = np.stack([x, np.full(9, y), z - 0.025 * (1 - (x / half) ** 2)], axis=1)
        parts.append(tube(path, 1.0, 8, wood, section=rail))
    return merge(parts)


def desk_lamp(body: str, bulb: str) -> Shape:
    """Desk lamp, about 0.45 m tall; its shade opens downwards and lies towards +z."""
    foot = lathe([(0.085, 0), (0.085, 0.012), (0.03, 0.022), (0.012, 0.024), (0.008, 0.026)], 20, body)
    arm = tube(
        [
            (0, 0.02, 0),
            (0, 0.16, -0.035),
            (0, 0.27, -0.05),
            (0, 0.36, -0.02),
            (0, 0.405, 0.05),
            (0, 0.42, 0.13),
        ],
        0.008,
        8,
        body,
    )
    # Seen from below: rim, inside of the shade, and the bulb's face within it.
    head = lathe(
        [(BULB_RADIUS, 0.035), (0.072, 0.0), (0.078, 0.0), (0.045, 0.075), (0.022, 0.09)],
        20,
        [bulb, body, body, body, body, body],
    )
    return merge([foot, arm, head.moved(0, 0.345, 0.15)])


def bulb_area() -> float:
    """Luminous area of a `desk_lamp`, square metres: a regular polygon of 20 corners."""
    return float(10 * np.sin(np.pi / 10)) * BULB_RADIUS**2


def desk(width: float, top: str, metal: str) -> Shape:
    """Table of 0.8 m depth, 0.74 m high, on two trestles."""
    parts = [block(width, 0.028, 0.8, top).moved(0, 0.712, 0)]
    for side in (-1, 1):
        x = side * (width / 2 - 0.08)
        parts += [
            block(0.06, 0.03, 0.7, metal).moved(x, 0, 0),
            box(0.05, 0.70, 0.07, metal).moved(x, 0.02, 0),
        ]
        parts.append(box(0.046, 0.03, 0.6, metal).moved(x, 0.688, 0))
    return merge(parts)


def pedestal(body: str, front: str, handle: str) -> Shape:
    """Drawer unit, 0.42 x 0.58 x 0.6 m."""
    parts = [block(0.42, 0.58, 0.58, body)]
    for i, height in enumerate((0.12, 0.2, 0.2)):
        y = (0.44, 0.23, 0.02)[i]
        parts.append(block(0.40, height, 0.02, front).moved(0, y, 0.299))
        parts.append(box(0.14, 0.012, 0.016, handle).moved(0, y + height - 0.04, 0.315))
    return merge(parts)


def monitor(body: str, screen: str) -> Shape:
    """Screen, 0.55 m wide, on a foot, 0.5 m high in all."""
    frame = block(0.56, 0.34, 0.03, body).moved(0, 0.14, 0)
    face = box(0.53, 0.31, 0.004, screen).moved(0, 0.155, 0.0145)
    neck = box(0.05, 0.26, 0.02, body).moved(0, 0.012, -0.02)
    foot = prism(rounded_rectangle(0.24, 0.17, 0.03, 4), 0.014, body)
    return merge([frame, face, neck, foot])


def keyboard(body: str, keys: str) -> Shape:
    """Keyboard, 0.44 x 0.14 m, with one raised field of keys."""
    return merge([block(0.44, 0.016, 0.14, body), block(0.42, 0.010, 0.12, keys, 0.002).moved(0, 0.012, 0)])


def cabinet(
    width: float, height: float, depth: float, doors: int, body: str, front: str, handle: str
) -> Shape:
    """Closed cupboard with `doors` doors on a plinth."""
    parts = [
        box(width - 0.04, 0.07, depth - 0.06, handle),
        block(width, height - 0.06, depth, body).moved(0, 0.06),
    ]
    door = width / doors
    for i in range(doors):
        x = (i + 0.5) * door - width / 2
        parts.append(block(door - 0.006, height - 0.09, 0.02, front).moved(x, 0.075, depth / 2 + 0.009))
        grip = x + (0.5 if i % 2 == 0 else -0.5) * (door - 0.10)
        parts.append(box(0.014, 0.16, 0.02, handle).moved(grip, height * 0.6, depth / 2 + 0.027))
    return merge(parts)


def bookcase(
    width: float, height: float, depth: float, shelves: int, wood: str, spines: Sequence[str], seed: int
) -> Shape:
    """Open shelves of 22 mm boards with rows of books."""
    board = 0.022
    parts = [block(board, height, depth, wood, 0.002).moved(s * (width - board) / 2) for s in (-1, 1)]
    parts.append(box(width - 0.02, height - 0.02, 0.008, wood).moved(0, 0.01, 0.006 - depth / 2))
    levels = np.linspace(0.06, height - board - 0.004, shelves + 1)
    parts += [box(width - 2 * board + 0.01, board, depth - 0.02, wood).moved(0, y, 0.004) for y in levels]
    rng = np.random.default_rng(seed)
    for y, above in pairwise(levels):
        clear = above - y - board
        inside = width - 2 * board - 0.02
        count = int(rng.uniform(0.45, 0.95) * inside / 0.045)
        widths = rng.uniform(0.025, 0.06, count)
        widths *= min(1.0, inside / widths.sum())
        heights = 0.005 * np.round(clear * rng.uniform(0.62, 0.88, count) / 0.005)
        names = [spines[i] for i in rng.integers(0, len(spines), count)]
        row = skyline(heights, widths, depth * 0.62, names)
        start = -inside / 2 if rng.uniform() < 0.6 else inside / 2 - widths.sum()
        parts.append(row.moved(start, y + board + GAP, 0.02))
    return merge(parts)


def picture(width: float, height: float, frame: str, colours: Sequence[str], seed: int) -> Shape:
    """Framed colour field; its back is at z = 0."""
    rng = np.random.default_rng(seed)
    rim = 0.035
    across, up = width - 2 * rim, height - 2 * rim
    canvas = box(across, up, 0.012, colours[0]).moved(0, rim, 0.017)
    parts = [block(width, height, 0.02, frame).moved(0, 0, 0.01), canvas]
    for i, (x, y, w, h) in enumerate(_cut(rng, -across / 2, rim, across, up, 4)):
        field = box(w - 0.012, h - 0.012, 0.004, colours[1 + i % (len(colours) - 1)])
        parts.append(field.moved(x + w / 2, y + 0.006, 0.024))
    return merge(parts)


def _cut(
    rng: np.random.Generator, x: float, y: float, w: float, h: float, depth: int
) -> list[tuple[float, float, float, float]]:
    """Rectangles from random guillotine cuts of one rectangle."""
    if depth == 0 or min(w, h) < 0.12:
        return [(x, y, w, h)]
    share = float(rng.choice([0.38, 0.5, 0.62]))
    if w > h:
        halves = [(x, y, w * share, h), (x + w * share, y, w * (1 - share), h)]
    else:
        halves = [(x, y, w, h * share), (x, y + h * share, w, h * (1 - share))]
    # The second half gets one cut fewer, so that the fields differ in size.
    return [*_cut(rng, *halves[0], depth - 1), *_cut(rng, *halves[1], max(depth - 2, 0))]


def window(width: float, height: float, frame: str, glass: str) -> Shape:
    """Two-winged window before a wall, back at z = 0, bottom at y = 0; the panes are dark, as at night."""
    rim, thick = 0.06, 0.07
    parts = [box(width - 0.02, height - 0.02, 0.02, glass).moved(0, 0.01, 0.012)]
    parts += [box(width, rim, thick, frame).moved(0, y, thick / 2) for y in (0, height - rim)]
    for x in (-(width - rim) / 2 + 0.002, 0, (width - rim) / 2 - 0.002):
        parts.append(box(rim, height - rim, thick - 0.006, frame).moved(x, rim / 2, thick / 2 - 0.002))
    parts.append(block(width + 0.12, 0.035, 0.2, frame).moved(0, -0.045, 0.1))
    return merge(parts)


def door(width: float, height: float, leaf: str, frame: str, handle: str) -> Shape:
    """Door in its frame before a wall, back at z = 0."""
    parts = [block(width, height, 0.03, leaf).moved(0, 0, 0.015)]
    for side in (-1, 1):
        parts.append(box(0.08, height + 0.08, 0.05, frame).moved(side * (width / 2 + 0.043), 0, 0.025))
    parts.append(box(width + 0.006 + 0.02, 0.08, 0.046, frame).moved(0, height + 0.003, 0.025))
    for i in range(2):
        parts.append(block(width - 0.3, 0.72, 0.012, leaf).moved(0, 0.2 + 0.95 * i, 0.034))
    parts.append(tube([(width / 2 - 0.07, 1.03, 0.025), (width / 2 - 0.07, 1.03, 0.075)], 0.011, 10, handle))
    parts.append(tube([(width / 2 - 0.06, 1.03, 0.073), (width / 2 - 0.2, 1.03, 0.073)], 0.010, 10, handle))
    return merge(parts)


def pot_plant(pot: str, soil: str, leaf: str, seed: int) -> Shape:
    """Broad leaves in a pot, about 1.2 m tall."""
    profile = [(0.11, 0), (0.16, 0.30), (0.165, 0.32), (0.148, 0.32), (0.143, 0.27)]
    return merge([lathe(profile, 20, [pot] * 5 + [soil]), foliage(leaf, seed).moved(0, 0.26)])


def foliage(leaf: str, seed: int) -> Shape:
    """Broad leaves that grow from the origin, up to 0.9 m tall."""
    rng = np.random.default_rng(seed)
    parts = []
    for i in range(11):
        reach, rise = rng.uniform(0.22, 0.42), rng.uniform(0.35, 0.85)
        t = np.linspace(0, 1, 9)
        height = rise * np.sin(1.9 * t) / np.sin(1.9) * (1.045 - 0.095 * t)
        path = np.stack([0 * t, height, 0.02 + reach * t**1.3], axis=1)
        wide = 0.006 + 0.05 * np.sin(np.pi * np.clip((t - 0.3) / 0.7, 0, 1)) ** 0.8
        section = np.array([(1.0, 0.0), (0.0, 0.15), (-1.0, 0.0), (0.0, -0.15)])
        parts.append(tube(path, wide, 4, leaf, section=section).turned(137.5 * i))
    return merge(parts)


def waste_basket(metal: str, inside: str) -> Shape:
    """Waste-paper basket, open at the top."""
    return lathe(
        [(0.11, 0), (0.14, 0.32), (0.134, 0.32), (0.106, 0.01)], 20, [metal, metal, metal, inside, inside]
    )


def mug(material: str) -> Shape:
    """Cup without a handle, 0.1 m tall."""
    return lathe([(0.03, 0), (0.04, 0.01), (0.042, 0.1), (0.037, 0.1), (0.035, 0.015)], 16, material)


def papers(material: str) -> Shape:
    """A pile of sheets."""
    return merge(
        [box(0.21, 0.012, 0.297, material), box(0.21, 0.006, 0.297, material).turned(9).moved(0, 0.013)]
    )
