# SPDX-License-Identifier: Apache-2.0
"""Random segments that end on a floor, or nearly do, for the methods that want surfaces."""

from __future__ import annotations

from functools import cache

import deltalux as dl
import numpy as np
from hypothesis import strategies as st
from oracles.flat_floor import Floor

from contract.disc_worlds import World

FLOOR = Floor(((-1, -1, 0, 0), (0, -1, 1, 0), (-1, 0, 0, 1)))  # an L
SEGMENT_KINDS = ("landing", "at one point", "grazing", "from below", "parallel", "in free air",
                 "past the floor", "no length", "endless")  # fmt: skip
SAMPLE_KINDS = ("free", "coincident", "at the border")


@cache
def floor_scene() -> dl.Scene:
    """The floor as one mesh, a quad per rectangle, under a bulb."""
    vertices, triangles = [], []
    for i, (x0, z0, x1, z1) in enumerate(FLOOR.rectangles):
        vertices += [(x0, 0, z0), (x0, 0, z1), (x1, 0, z1), (x1, 0, z0)]
        triangles += [(4 * i, 4 * i + 1, 4 * i + 2), (4 * i, 4 * i + 2, 4 * i + 3)]
    mesh = dl.Mesh("floor", vertices, triangles, "grey")
    return dl.Scene([mesh], [dl.Material("grey", (0.5,) * 3)], [dl.PointLight("bulb", (-0.3, 2, -0.3))])


def on_floor(rng: np.random.Generator, count: int) -> np.ndarray:
    """Points (count, 3), no nearer to a border of a rectangle than 1 mm."""
    x0, z0, x1, z1 = np.array(FLOOR.rectangles)[rng.integers(0, len(FLOOR.rectangles), count)].T
    share = rng.uniform(1e-3, 1 - 1e-3, (2, count))
    return np.stack([x0 + share[0] * (x1 - x0), np.zeros(count), z0 + share[1] * (z1 - z0)], axis=1)


def make_flights(rng: np.random.Generator, kind: str, count: int) -> tuple[np.ndarray, ...]:
    """Origins, directions and lengths."""
    end = on_floor(rng, count)
    length = rng.uniform(0.1, 2, count)
    direction = rng.normal(size=(count, 3))
    direction[:, 1] = -abs(direction[:, 1]) - 0.1
    if kind == "at one point":
        end[:] = (-0.31, 0, -0.42)
    elif kind == "grazing":
        direction[:, 1] = -(10 ** rng.uniform(-4, -2, count))
    elif kind == "from below":
        direction[:, 1] *= -1
    elif kind == "parallel":
        direction[:, 1] = 0
    elif kind == "in free air":
        end[:, 1] = rng.choice([-0.1, 0.1, 0.5], count)
    elif kind == "past the floor":
        end[:, (0, 2)] = rng.uniform(0.01, 1, (count, 2))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    origin = end - length[:, None] * direction
    if kind == "no length":
        origin, length = end, np.zeros(count)
    elif kind == "endless":
        length = np.full(count, np.inf)
    return origin, direction, length


@st.composite
def floor_worlds(draw: st.DrawFn, most_segments: int = 150, most_samples: int = 5) -> World:
    """Flights of several kinds that end at the floor; samples of one kind on it."""
    seed = draw(st.integers(0, 2**32 - 1))
    kinds = ["landing", *draw(st.lists(st.sampled_from(SEGMENT_KINDS), max_size=3))]
    counts = [draw(st.integers(0, most_segments // len(kinds))) for _ in kinds]
    sample_kind = draw(st.sampled_from(SAMPLE_KINDS))
    rng = np.random.default_rng(seed)
    flights = [make_flights(rng, kind, count) for kind, count in zip(kinds, counts, strict=True)]
    origin, direction, length = (np.concatenate(columns) for columns in zip(*flights, strict=True))
    power = rng.exponential(1.0, (len(origin), 3)) * rng.choice([0.0, 1.0, 1.0], (len(origin), 3))
    points = on_floor(rng, draw(st.integers(0, most_samples)))
    if sample_kind == "coincident":
        points[:] = points[:1]
    elif sample_kind == "at the border":
        points[:, 0] = np.where(points[:, 2] < 0, np.where(points[:, 0] > 0, 1, -1), 0)
    samples = dl.Samples(points, np.tile([(0.0, 1, 0)], (len(points), 1)), radius=0.1)
    about = f"{kinds} flights, {sample_kind} samples, seed {seed}"
    return World(about, dl.Segments(origin, direction, length, power), samples)
