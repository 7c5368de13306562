# SPDX-License-Identifier: Apache-2.0
"""Light from surfaces that hide each other (bushes, grass) against a path tracer."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux import _core
from scenes_for_tests import Shape, box

LAMP, INTENSITY = np.array((2.0, 2.7, 2.0)), 100.0
WALL, LEAF = 0.3, 0.5
ROOM = box((0, 0, 0), (4, 3, 4))
NEAR = 2e-6  # metres: above a surface


def leaves(count, low, high, size, random) -> Shape:
    """Triangles at random."""
    centre = random.uniform(low, high, (count, 3))
    normal = random.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    u = np.cross(normal, random.normal(size=(count, 3)))
    u *= size / np.linalg.norm(u, axis=1)[:, None]
    v = np.cross(normal, u)
    corners = np.stack([centre - u, centre + u, centre + v], axis=1)
    return Shape(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def grass(count, random) -> Shape:
    zero = np.zeros(count)
    foot = np.stack([random.uniform(0.5, 3.5, count), zero, random.uniform(0.5, 3.5, count)], axis=1)
    turn = random.uniform(0, 6.3, count)
    wide = 0.004 * np.stack([np.cos(turn), zero, np.sin(turn)], axis=1)
    high, (aside, along) = random.uniform(0.05, 0.12, count), random.normal(0, 0.03, (2, count))
    corners = np.stack([foot - wide, foot + wide, foot + np.stack([aside, high, along], axis=1)], axis=1)
    return Shape(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


KINDS = {
    "bush": lambda random: leaves(3000, (1.2, 0.1, 1.2), (2.8, 1.2, 2.8), 0.025, random),
    "grass": lambda random: grass(6000, random),
}


class Tracer:
    """Light at points, by paths from there that ask for the lamp wherever they land. Unbiased, and slow."""

    def __init__(self, plants: Shape) -> None:
        vertices = np.concatenate([ROOM.vertices, plants.vertices])
        triangles = np.concatenate([ROOM.triangles, plants.triangles + len(ROOM.vertices)])
        self._reflectance = np.repeat((WALL, LEAF), (len(ROOM.triangles), len(plants.triangles)))
        a, b, c = vertices[triangles].transpose(1, 0, 2)
        self._normal = np.cross(b - a, c - a)
        self._normal /= np.linalg.norm(self._normal, axis=1)[:, None]
        self._caster = _core.RayCaster(vertices.astype(np.float32), triangles.astype(np.uint32), 1)

    def _cast(self, origin, direction):
        t, triangle, *_ = self._caster.intersect(
            np.ascontiguousarray(origin, np.float32), np.ascontiguousarray(direction, np.float32)
        )
        return t.astype(float), triangle.astype(np.int64)

    def _direct(self, point, normal):
        to = LAMP - point
        distance = np.linalg.norm(to, axis=1)
        to /= distance[:, None]
        free = self._cast(point, to)[0] > distance - 1e-4  # the room is closed
        return free * INTENSITY * np.clip((to * normal).sum(axis=1), 0, None) / distance**2

    def irradiance(self, point, normal, rays: int, random) -> float:
        """Mean over all points, each with as many rays."""
        point, normal = np.repeat(point, rays, axis=0), np.repeat(normal, rays, axis=0)
        total, weight = self._direct(point, normal).sum(), np.ones(len(point))
        count = len(point)
        for _ in range(16):
            sphere = random.normal(size=point.shape)
            direction = sphere / np.linalg.norm(sphere, axis=1)[:, None] + normal * (1 + 1e-9)
            direction /= np.linalg.norm(direction, axis=1)[:, None]
            t, triangle = self._cast(point, direction)
            met = self._normal[triangle]
            normal = np.where(((met * direction).sum(axis=1) > 0)[:, None], -met, met)
            point = point + direction * t[:, None] + normal * NEAR
            weight = weight * self._reflectance[triangle]
            total += (weight * self._direct(point, normal)).sum()
        return total / count


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [1])
def test_light_from_what_hides_itself_is_within_two_percent(kind, seed):
    """The mean over points that look down at it; both sides have a noise of about 0.4 % there."""
    random = np.random.default_rng(seed)
    plants = KINDS[kind](random)
    points = np.stack([random.uniform(0.8, 3.2, 64), np.full(64, 1.6), random.uniform(0.8, 3.2, 64)], axis=1)
    down = np.tile((0.0, -1.0, 0.0), (64, 1))
    truth = Tracer(plants).irradiance(points, down, 1000, random)
    scene = dl.Scene(
        [ROOM.mesh("room", "wall"), plants.mesh("plants", "leaf")],
        [dl.Material("wall", (WALL,) * 3), dl.Material("leaf", (LEAF,) * 3)],
        [dl.PointLight("lamp", LAMP, (INTENSITY,) * 3)],
        unit="lux",
    )
    session = dl.Session(scene, dl.Samples(points, down), gather=512, paths=200_000, seed=seed)
    session.bake()
    assert session.irradiance[:, 1].mean() == pytest.approx(truth, rel=0.02)
