# SPDX-License-Identifier: Apache-2.0
"""Columns, arches, vaults and mouldings of the atrium; `fine` multiplies every count of edges."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from .shapes import Shape, block, box, circle, closed_loft, lathe, loft, merge, shape


def count(edges: int, fine: float) -> int:
    """`edges` times `fine`, never less than half of `edges`."""
    return max(round(edges * fine), (edges + 1) // 2)


def refine(line: Any, points: int) -> np.ndarray:
    """The polyline with its longest edges halved until it has that many points."""
    line = [np.asarray(p, np.float64) for p in line]
    while len(line) < points:
        lengths = [float(np.hypot(*(b - a))) for a, b in pairwise(line)]
        i = int(np.argmax(lengths))
        line.insert(i + 1, (line[i] + line[i + 1]) / 2)
    return np.array(line)


def _torus(radius: float, low: float, high: float, swell: float) -> list[tuple[float, float]]:
    """Half-round moulding of a profile."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 6)
    middle, half = (low + high) / 2, (high - low) / 2
    return [(radius + swell * float(np.cos(a)), middle + half * float(np.sin(a))) for a in angle]


def column(height: float, radius: float, fine: float, stone: str, capital: str, flutes: int = 0) -> Shape:
    """Round column with plinth, base, tapering shaft, leafy capital and abacus."""
    r, top = radius, height
    plinth = block(2.7 * r, 0.12, 2.7 * r, stone, 0.008)
    foot = [
        *_torus(1.12 * r, 0.115, 0.20, 0.2 * r),
        (1.08 * r, 0.215),
        (1.06 * r, 0.235),
        *_torus(1.02 * r, 0.245, 0.30, 0.14 * r),
        (1.02 * r, 0.315),
        (r, 0.345),
    ]
    base = lathe(refine(foot, count(len(foot), fine)), count(24, fine), stone)

    start, neck = 0.34, top - 0.52
    t = np.linspace(0, 1, count(10, fine) + 1)
    swell = r * (1 - 0.16 * t**1.6)
    around = count(28, fine) if flutes == 0 else flutes * max(3, round(4 * fine))
    unit = circle(1.0, around)[::-1]
    angle = 2 * np.pi * np.arange(around) / around
    groove = 1 - (0.05 * np.abs(np.sin(angle * flutes / 2)) if flutes else 0 * angle)
    shaft = _rings(start + (neck + 0.01 - start) * t, swell[:, None] * groove, unit)

    bell = np.linspace(0, 1, count(11, fine) + 1)
    around = max(32, 8 * round(4 * fine))
    angle = 2 * np.pi * np.arange(around) / around
    flare = 0.84 * r + (0.40 * r) * bell**2.2 + 0.10 * r * np.exp(-(((bell - 0.03) / 0.05) ** 2))
    leaves = (
        0.09
        * r
        * np.sin(np.pi * np.clip(bell * 2 % 1, 0, 1))[:, None]
        * np.cos(8 * angle + np.pi * (bell[:, None] >= 0.5))
    )
    cup = _rings(neck + (top - 0.10 - neck) * bell, flare[:, None] + leaves, circle(1.0, around)[::-1])
    abacus = block(2.6 * r, 0.12, 2.6 * r, capital, 0.012).moved(0, top - 0.115)
    return merge([plinth, base, _capped(shaft, stone), _capped(cup, capital), abacus])


def _rings(y: np.ndarray, radius: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """(k, n, 3) horizontal rings at heights `y` with radii (k, n)."""
    x, z = radius * unit[:, 0], radius * unit[:, 1]
    return np.stack([x, np.broadcast_to(y[:, None], x.shape), z], axis=-1)


def _capped(rings: np.ndarray, material: str) -> Shape:
    return loft(rings, rings[0].mean(axis=0), rings[-1].mean(axis=0), material)


def pier(height: float, half_x: float, half_z: float, stone: str) -> Shape:
    """Rectangular pier with base and cap."""
    profile = [
        (0.07, 0.0),
        (0.07, 0.26),
        (0.025, 0.32),
        (0.0, 0.36),
        (0.0, height - 0.34),
        (0.02, height - 0.3),
        (0.0, height - 0.26),
        (0.015, height - 0.2),
        (0.06, height - 0.1),
        (0.06, height),
    ]
    rings = [
        [(sx * (half_x + out), y, sz * (half_z + out)) for sx, sz in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
        for out, y in profile
    ]
    return _capped(np.array(rings), stone)


def curved_wall(lower: np.ndarray, upper: np.ndarray, section: Any, material: str) -> Shape:
    """Solid between two lines (k, 2) in the xy-plane, both going to +x.

    `section` (n, 2) is its cross-section as (share of the way from lower to upper line, z),
    counter-clockwise when seen along -x with +z on the left, star-shaped about (0.5, 0).
    """
    share, z = np.asarray(section, np.float64).T
    flat = lower[:, None] + share[:, None] * (upper - lower)[:, None]
    rings = np.concatenate([flat, np.broadcast_to(z[:, None], (len(lower), len(z), 1))], axis=2)
    start, end = (np.append((lower[i] + upper[i]) / 2, 0.0) for i in (0, -1))
    return loft(rings, start, end, material)


def block_section(half: float, across: int, up: int) -> np.ndarray:
    """Rectangular section for `curved_wall`, `across` edges on the soffit, `up` on each face."""
    below = [(0.0, half - 2 * half * i / across) for i in range(across)]
    front = [(i / up, -half) for i in range(up)]
    behind = [(1 - i / up, half) for i in range(up)]
    return np.array([*below, *front, (1.0, -half), *behind])


def arc(centre: float, spring: float, radius: float, edges: int) -> np.ndarray:
    """(edges + 1, 2) half circle from left to right."""
    angle = np.linspace(np.pi, 0, edges + 1)
    return np.stack([centre + radius * np.cos(angle), spring + radius * np.sin(angle)], axis=1)


def arcade_wall(
    bays: int,
    bay: float,
    radius: float,
    spring: float,
    top: float,
    overhang: float,
    half: float,
    fine: float,
    material: str,
) -> Shape:
    """Wall of `bays` arches about x = 0, one solid, reaching `overhang` beyond the outer bays."""
    edges = count(20, fine)
    # The lines from arch to top lean outwards, so that they clear the arch near its vertical springing.
    reach = radius + 0.7 * (bay / 2 - radius)
    lower, upper = [], []
    for i in range(bays):
        centre = (i - (bays - 1) / 2) * bay
        curve = arc(centre, spring, radius, edges)
        lower.append(curve)
        upper.append(np.linspace((centre - reach, top), (centre + reach, top), edges + 1))
    end = bays * bay / 2 + overhang
    below = np.concatenate([[(-end, spring)], *lower, [(end, spring)]])
    above = np.concatenate([[(-end, top)], *upper, [(end, top)]])
    return curved_wall(below, above, block_section(half, count(4, fine), count(3, fine)), material)


def rib(radius: float, thickness: float, half: float, fine: float, material: str) -> Shape:
    """Half-circular arch over y = 0."""
    edges = count(20, fine)
    section = block_section(half, count(3, fine), count(2, fine))
    return curved_wall(arc(0, 0, radius, edges), arc(0, 0, radius + thickness, edges), section, material)


def arch_moulding(
    radius: float, posts: float, wide: float, proud: float, fine: float, material: str
) -> Shape:
    """Profiled band around an arch, on posts, in relief before z = 0."""
    inner, outer = (_arch_line(r, posts, fine) for r in (radius, radius + wide))
    section = [
        (0.0, proud * 0.6),
        (0.0, -0.03),
        (1.0, -0.03),
        (1.0, proud),
        (0.78, proud),
        (0.66, proud * 0.7),
        (0.34, proud * 0.7),
        (0.22, proud * 0.95),
    ]
    return curved_wall(inner, outer, refine(section, count(8, fine)), material)


def _arch_line(radius: float, posts: float, fine: float) -> np.ndarray:
    """Half circle on posts, from the left foot to the right one."""
    curve = arc(0, posts, radius, count(16, fine))
    if posts == 0:
        return curve
    up = np.linspace(0, posts, count(3, fine), endpoint=False)
    left = np.stack([np.full(len(up), -radius), up], axis=1)
    return np.concatenate([left, curve, (left * (-1, 1))[::-1]])


def arched_panel(radius: float, posts: float, half: float, fine: float, material: str) -> Shape:
    """Flat field under an arch on posts, `half` metres to each side of z = 0."""
    top = arc(0, posts, radius, count(16, fine))
    return curved_wall(top * (1, 0), top, block_section(half, 1, count(3, fine)), material)


def groin_vault(radius: float, fine: float, material: str) -> Shape:
    """Square groin vault, springing at y = 0, seen from below: a sheet, not a solid."""
    half = count(9, fine)  # the centre lines must be grid lines, so that creases follow diagonals
    n = 2 * half + 1
    s = radius * np.sin(np.linspace(-np.pi / 2, np.pi / 2, n))
    s[[0, half, -1]] = -radius, 0.0, radius
    rise = np.sqrt(np.maximum(radius**2 - s**2, 0))
    x, z = np.meshgrid(s, s, indexing="ij")
    vertices = np.stack([x, np.maximum.outer(rise, rise), z], axis=-1)
    index = np.arange(n * n).reshape(n, n)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)
    i, j = np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij")
    other = (i < half) != (j < half)
    quads[other] = np.roll(quads[other], 1, axis=-1)
    quads = quads.reshape(-1, 4)
    return shape(vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), material)


def moulding_loop(profile: Any, half_x: float, half_z: float, edge: float, material: str) -> Shape:
    """Moulding around the inside of a rectangle, mitred at its corners.

    `profile` (n, 2) is closed: (distance inwards from the rectangle, y), counter-clockwise with
    inwards to the right; `edge` is the length of its edges along the loop.
    """
    inwards, y = np.asarray(profile, np.float64).T
    corners = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)], np.float64)
    rings = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = 2 * (half_x if a[1] == b[1] else half_z)
        for t in np.arange(steps := max(1, round(length / edge))) / steps:
            sx, sz = a + t * (b - a)
            rings.append(np.stack([sx * (half_x - inwards), y, sz * (half_z - inwards)], axis=1))
    return closed_loft(np.array(rings), material)


def cornice(low: float, height: float, proud: float) -> np.ndarray:
    """Profile for `moulding_loop`: widens upwards by steps and curves."""
    steps: Sequence[tuple[float, float]] = [
        (-0.005, 0.0),  # only slightly into the wall: the part of an underside within it would be dark
        (0.12, 0.0),
        (0.12, 0.12),
        (0.2, 0.18),
        (0.34, 0.22),
        (0.34, 0.32),
        (0.5, 0.38),
        (0.72, 0.5),
        (0.8, 0.62),
        (0.8, 0.74),
        (1.0, 0.8),
        (1.0, 0.96),
        (0.96, 1.0),
        (-0.35, 1.0),
    ]
    return np.array([(proud * x if x > 0 else x, low + height * y) for x, y in steps])


def baluster(height: float, fine: float, material: str) -> Shape:
    """Turned post of a balustrade."""
    profile = [
        (0.055, 0),
        (0.055, 0.05),
        (0.035, 0.07),
        (0.04, 0.10),
        (0.062, 0.2),
        (0.068, 0.27),
        (0.058, 0.36),
        (0.036, 0.52),
        (0.028, 0.64),
        (0.032, 0.7),
        (0.045, 0.72),
        (0.045, 0.76),
        (0.03, 0.79),
        (0.035, 0.86),
        (0.052, 0.93),
        (0.055, 1.0),
    ]
    line = [(r, y * height) for r, y in profile]
    return lathe(refine(line, count(len(line), fine)), count(12, fine), material)


def rail(length: float, height: float, width: float, material: str) -> Shape:
    """Rounded handrail or kerb along x."""
    core = box(length - 0.01, height * 0.5, width * 0.7, material)
    return merge([core, block(length, height * 0.62, width, material, height * 0.12).moved(0, height * 0.38)])


def dado(length: float, height: float, panel: str, stone: str) -> Shape:
    """Wainscot along x, half of it behind z = 0, with a moulded top."""
    field = box(length - 0.02, height - 0.03, 0.08, panel).moved(0, 0.005)
    cap = rail(length + 0.01, 0.08, 0.15, stone).moved(0, height - 0.08)
    return merge([field, cap, box(length + 0.01, 0.10, 0.12, stone)])
