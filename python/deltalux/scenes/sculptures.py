# SPDX-License-Identifier: Apache-2.0
"""Sculptures and plinths of the demonstration scenes; each stands on y = 0, about the y axis."""

from __future__ import annotations

import numpy as np

from .shapes import GAP, Shape, block, circle, closed_tube, lathe, loft, merge, shell, sphere, tube


def plinth(width: float, height: float, material: str) -> Shape:
    """Square pedestal with a set-back foot."""
    foot = block(width - 0.06, 0.06, width - 0.06, material)
    return merge([foot, block(width, height - 0.05, width, material, 0.006).moved(0, 0.05)])


def on_plinth(sculpture: Shape, width: float, height: float, material: str) -> Shape:
    """`sculpture` on a plinth, the whole as one shape."""
    return merge([plinth(width, height, material), sculpture.moved(0, height + GAP)])


def knot(radius: float, thickness: float, material: str, along: int = 100, around: int = 12) -> Shape:
    """Trefoil knot, upright."""
    t = 2 * np.pi * np.arange(along) / along
    path = np.stack(
        [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -1.2 * np.sin(3 * t)], axis=1
    )
    return _on_ground(closed_tube(path * (radius / 3), thickness, around, material))


def hoops(radius: float, thickness: float, material: str) -> Shape:
    """Three interlocked rings leaning on each other."""
    t = 2 * np.pi * np.arange(44) / 44
    ring = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    parts = [
        closed_tube(ring * r, thickness, 10, material).turned(lean, "x").turned(turn)
        for r, lean, turn in ((radius, 8, 0), (radius * 0.74, -18, 70), (radius * 0.5, 25, 140))
    ]
    return merge([_on_ground(part) for part in parts])


def twist(width: float, height: float, turns: float, material: str) -> Shape:
    """Tapering square column that turns about its axis."""
    t = np.linspace(0, 1, 33)
    per_edge = 4
    edge = np.linspace(-1, 1, per_edge, endpoint=False)
    square = np.concatenate(
        [
            np.stack(p, axis=1)
            for p in (
                (edge, edge * 0 - 1),
                (edge * 0 + 1, edge),
                (-edge, edge * 0 + 1),
                (edge * 0 - 1, -edge),
            )
        ]
    )[::-1]
    angle = 2 * np.pi * turns * t
    half = width / 2 * (1 - 0.55 * t**1.5)
    x = half[:, None] * (np.cos(angle)[:, None] * square[:, 0] - np.sin(angle)[:, None] * square[:, 1])
    z = half[:, None] * (np.sin(angle)[:, None] * square[:, 0] + np.cos(angle)[:, None] * square[:, 1])
    y = np.broadcast_to((height * t)[:, None], x.shape)
    return loft(np.stack([x, y, z], axis=-1), (0, 0, 0), (0, height, 0), material)


def figure(height: float, material: str) -> Shape:
    """Upright rounded form whose axis sways."""
    t = np.linspace(0, 1, 37)
    radius = 0.02 + 0.17 * np.sin(np.pi * np.clip(t, 0.02, 0.995)) ** 0.6 * (1 - 0.35 * np.sin(3 * np.pi * t))
    unit = circle(1.0, 20)[::-1]
    sway = 0.10 * np.sin(2.4 * np.pi * t) * t
    x = sway[:, None] + radius[:, None] * unit[:, 0]
    z = 0.06 * (np.cos(3 * t) - 1)[:, None] + 0.72 * radius[:, None] * unit[:, 1]
    y = np.broadcast_to(t[:, None], x.shape)
    rings = np.stack([x, y, z], axis=-1) * height
    return loft(rings, rings[0].mean(axis=0), rings[-1].mean(axis=0), material)


def sail(width: float, height: float, material: str, post: str) -> Shape:
    """Saddle-shaped sheet on a post."""
    u, v = np.meshgrid(np.linspace(-1, 1, 19), np.linspace(-1, 1, 19), indexing="ij")
    z = 0.22 * width * (u * u - v * v)
    front = np.stack([width / 2 * u, height * (0.62 + 0.36 * v), z + 0.008], axis=-1)
    back = front - [0, 0, 0.016]
    return merge(
        [
            lathe([(0.09, 0), (0.09, 0.012), (0.012, 0.02), (0.012, height * 0.64)], 16, post),
            shell(front, back, material),
        ]
    )


def totem(material: str, accent: str) -> Shape:
    """Turned column of bulbs and collars, about 1 m tall."""
    y = np.linspace(0, 1, 41)
    radius = 0.075 + 0.045 * np.cos(6 * np.pi * y) * (1 - 0.5 * y) + 0.014 * np.cos(14 * np.pi * y)
    return merge(
        [lathe(np.stack([radius, y], axis=1), 16, material), sphere(0.11, 16, accent).moved(0, 1.09, 0)]
    )


def spiral(radius: float, height: float, material: str) -> Shape:
    """Rising spring that narrows, on a disc."""
    t = np.linspace(0, 1, 84)
    angle = 2 * np.pi * 3.6 * t
    r = radius * (1 - 0.75 * t)
    path = np.stack([r * np.cos(angle), 0.03 + (height - 0.04) * t**0.9, r * np.sin(angle)], axis=1)
    disc = lathe([(radius * 1.15, 0), (radius * 1.15, 0.025), (radius * 1.1, 0.03)], 28, material)
    return merge([disc, tube(path, 0.032 * (1 - 0.5 * t), 8, material)])


def _on_ground(part: Shape) -> Shape:
    return part.moved(0, -float(part.vertices[:, 1].min()), 0)
