# SPDX-License-Identifier: Apache-2.0
"""Furnishings of the atrium: curtains, urns, a fountain, lanterns, the trolley."""

from __future__ import annotations

import numpy as np

from deltalux.vectors import triangle_areas

from .masonry import count, refine
from .shapes import Shape, block, box, cylinder, lathe, merge, prism, rounded_rectangle, shell, sphere, tube

GLOBE_RADIUS = 0.15  # of `lantern`
CLOTH = 0.008  # thickness, metres


def curtain(width: float, height: float, folds: float, fine: float, material: str) -> Shape:
    """Cloth that hangs from y = `height` to y = 0 in folds, which deepen towards the hem."""
    u, v = np.meshgrid(
        np.linspace(0, 1, count(64, fine) + 1), np.linspace(0, 1, count(14, fine) + 1), indexing="ij"
    )
    phase = 2 * np.pi * folds * u + 0.6 * np.sin(2.3 * np.pi * u + 1.0)
    depth = (0.035 + 0.075 * (1 - v)) * (0.75 + 0.25 * np.sin(9.0 * u + 2.0))
    gather = 1 - 0.22 * np.sin(np.pi * np.clip(1.25 * (1 - v), 0, 1)) ** 2
    x = width * ((u - 0.5) * gather - 0.06 * (1 - gather))
    front = np.stack([x, height * v, depth * np.sin(phase)], axis=-1)
    return shell(front, front - [0, 0, CLOTH], material)


def drape(width: float, drop: float, fine: float, material: str, trim: str) -> Shape:
    """Tapestry before z = 0, from y = 0 down by `drop`, with a weighted hem."""
    u, v = np.meshgrid(
        np.linspace(-1, 1, count(30, fine) + 1), np.linspace(0, 1, count(22, fine) + 1), indexing="ij"
    )
    ripple = 0.035 * (1 - v) * np.sin(4.5 * np.pi * u + 0.5) + 0.06 * (1 - v)
    front = np.stack([width / 2 * u, drop * (v - 1), 0.03 + ripple], axis=-1)
    hem = tube(front[:, 0] - [0, 0.012, CLOTH / 2], 0.02, 8, trim)
    rod = tube([(-width / 2 - 0.08, 0, 0.028), (width / 2 + 0.08, 0, 0.028)], 0.022, 12, trim)
    return merge([shell(front, front - [0, 0, CLOTH], material), hem, rod])


def urn(fine: float, clay: str, stone: str, inside: str) -> Shape:
    """Open vase of about 0.8 m on a block."""
    t = np.linspace(0, 1, 15)
    belly = np.stack([0.11 + 0.21 * np.sin(np.pi * t**0.75) ** 1.2 * (1 - 0.25 * t), 0.06 + 0.62 * t], axis=1)
    outline = [(0.15, 0.0), (0.15, 0.03), *belly, (0.17, 0.72), (0.20, 0.75), (0.20, 0.77), (0.17, 0.77)]
    inner = [(0.085, 0.68), (0.13, 0.60), (0.15, 0.50)]  # inside the belly, which is 0.11 at the neck
    line = refine([*outline, *inner], count(len(outline) + 3, fine))
    names = [clay] * len(line) + [inside]
    vase = lathe(line, count(32, fine), names)
    return merge([block(0.5, 0.42, 0.5, stone, 0.012), vase.moved(0, 0.42 - 0.002)])


def fountain(fine: float, stone: str, water: str) -> Shape:
    """Round basin of 3 m with a bowl on a pillar."""
    basin = [
        (1.62, 0),
        (1.62, 0.08),
        (1.52, 0.12),
        (1.48, 0.16),
        (1.48, 0.40),
        (1.54, 0.44),
        (1.58, 0.50),
        (1.56, 0.55),
        (1.30, 0.55),
        (1.28, 0.52),
        (1.28, 0.38),
    ]
    pillar = [
        (0.24, 0.38),
        (0.24, 0.44),
        (0.15, 0.50),
        (0.12, 0.66),
        (0.16, 0.80),
        (0.13, 0.92),
        (0.16, 1.0),
        (0.40, 1.06),
        (0.62, 1.16),
        (0.72, 1.27),
        (0.70, 1.30),
        (0.62, 1.22),
    ]
    finial = [
        (0.10, 1.22),
        (0.07, 1.30),
        (0.05, 1.42),
        (0.09, 1.50),
        (0.11, 1.56),
        (0.08, 1.64),
        (0.03, 1.70),
    ]
    parts = [refine(line, count(len(line), fine)) for line in (basin, pillar, finial)]
    names = [stone]
    for part in parts:
        names += [*[stone] * (len(part) - 1), water]
    return lathe(np.concatenate(parts), count(48, fine), [*names[:-1], stone])


def lantern(drop: float, metal: str, globe: str) -> Shape:
    """Luminous globe under a cap, hung by a rod of length `drop` from y = 0; its centre is at -drop."""
    parts = [sphere(GLOBE_RADIUS, 14, globe).moved(0, -drop)]
    cap = [
        (GLOBE_RADIUS * 0.86, 0.105),
        (GLOBE_RADIUS * 0.92, 0.11),
        (0.09, 0.17),
        (0.03, 0.21),
        (0.014, 0.25),
    ]
    parts.append(lathe(cap, 16, metal).moved(0, -drop))
    parts.append(cylinder(0.010, drop - 0.24, 8, metal).moved(0, 0.24 - drop))
    parts.append(lathe([(0.05, -0.03), (0.09, 0.0), (0.09, 0.02)], 16, metal))
    return merge(parts)


def globe_area() -> float:
    """Luminous area of a `lantern`, square metres, as tessellated."""
    ball = sphere(GLOBE_RADIUS, 14, "globe")
    return float(triangle_areas(ball.vertices[ball.triangles]).sum())


def stone_bench(stone: str) -> Shape:
    """Slab on two blocks, 1.8 m long along x."""
    feet = [block(0.16, 0.40, 0.40, stone, 0.01).moved(x) for x in (-0.62, 0.62)]
    return merge([*feet, block(1.8, 0.10, 0.5, stone, 0.014).moved(0, 0.39)])


def trolley(wood: str, metal: str, rubber: str, crate: str, cloth: str, clay: str, leaf: str) -> Shape:
    """Flat barrow with crates, a sack and a potted plant; 1 m long along x, 0.9 m high."""
    parts = [block(0.92, 0.045, 0.52, wood, 0.006).moved(0, 0.20)]
    for x in (-0.30, 0.30):
        axle = tube([(x, 0.09, -0.25), (x, 0.09, 0.25)], 0.014, 10, metal)
        parts += [axle, box(0.05, 0.14, 0.40, metal).moved(x, 0.07)]
        for z in (-0.235, 0.235):
            wheel = [
                (0.03, -0.026),
                (0.05, -0.018),
                (0.076, -0.018),
                (0.09, -0.012),
                (0.09, 0.012),
                (0.076, 0.018),
                (0.05, 0.018),
                (0.03, 0.026),
            ]
            parts.append(
                lathe(wheel, 24, [metal, metal, *[rubber] * 5, metal, metal])
                .turned(90, "x")
                .moved(x, 0.09, z)
            )
    bow = np.linspace(0, np.pi, 13)
    handle = [
        (-0.43, 0.22, 0.22),
        *(
            (-0.47 - 0.02 * float(np.sin(a)), 0.72 + 0.16 * float(np.sin(a)), 0.22 * float(np.cos(a)))
            for a in bow
        ),
        (-0.43, 0.22, -0.22),
    ]
    parts.append(tube(handle, 0.014, 10, metal))
    parts.append(tube([(-0.452, 0.5, -0.225), (-0.452, 0.5, 0.225)], 0.010, 8, metal))
    lid = 0.247
    for width, height, depth, x, y, z, turn in (
        (0.34, 0.26, 0.40, -0.21, 0, 0.01, 3),
        (0.27, 0.2, 0.3, -0.2, 0.262, 0, -8),
    ):
        parts.append(_crate(width, height, depth, crate).turned(turn).moved(x, lid + y, z))
    pot = lathe([(0.075, 0), (0.11, 0.17), (0.118, 0.17), (0.118, 0.2), (0.10, 0.2), (0.095, 0.17)], 24, clay)
    parts.append(pot.moved(0.27, lid, -0.11))
    bush = sphere(0.16, 18, leaf)
    bump = 1 + 0.10 * np.sin(37 * bush.vertices[:, 0]) * np.sin(41 * bush.vertices[:, 1] + 1) * np.cos(
        39 * bush.vertices[:, 2]
    )
    bush = Shape(bush.vertices * bump[:, None], bush.triangles, bush.materials, bush.material_index)
    parts.append(bush.moved(0.27, lid + 0.31, -0.11))
    sack = prism(rounded_rectangle(0.26, 0.2, 0.08, 5), 0.16, cloth, bevel=0.04)
    parts.append(sack.turned(12).moved(0.22, lid, 0.13))
    return merge(parts)


def _crate(width: float, height: float, depth: float, wood: str) -> Shape:
    """Box with battens at its ends."""
    parts = [box(width, height - 0.012, depth, wood).moved(0, 0.006)]
    for side in (-1, 1):
        parts += [
            box(width + 0.024, 0.05, 0.03, wood).moved(0, y, side * (depth / 2)) for y in (0, height - 0.05)
        ]
        parts += [
            box(0.05, height - 0.004, 0.024, wood).moved(x, 0.002, side * (depth / 2))
            for x in (-width / 2 + 0.03, width / 2 - 0.03)
        ]
    return merge(parts)
