# SPDX-License-Identifier: Apache-2.0
"""Shapes and scenes that several test modules share: boxes, spheres, bowls, a cell in a hall, two rooms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import deltalux as dl
import numpy as np
from numpy.typing import ArrayLike
from oracles import closed_forms as cf
from oracles.radiosity import ConvexRoom


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangles, front side counter-clockwise; vertices (n, 3), triangles (m, 3)."""

    vertices: np.ndarray
    triangles: np.ndarray

    def mesh(self, name: str, material: str, **options) -> dl.Mesh:
        return dl.Mesh(name, self.vertices, self.triangles, material, **options)

    def flipped(self) -> Shape:
        return Shape(self.vertices, self.triangles[:, ::-1])

    def _corners(self) -> np.ndarray:
        return self.vertices[self.triangles]

    def _crosses(self) -> np.ndarray:
        a, b, c = self._corners().transpose(1, 0, 2)
        return np.cross(b - a, c - a)

    @property
    def area(self) -> float:
        return float(0.5 * np.linalg.norm(self._crosses(), axis=1).sum())

    def rectangles(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """(corner, u, v) of each parallelogram of a shape that `quad` and `box` made."""
        return [(a, b - a, d - a) for a, b, _, d in self.vertices.reshape(-1, 4, 3)]

    def points(self, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Points uniform by area, and the normals of their triangles; each (count, 3)."""
        rng = np.random.default_rng(seed)
        cross = self._crosses()
        weight = np.linalg.norm(cross, axis=1)
        chosen = rng.choice(len(weight), count, p=weight / weight.sum())
        u, v = rng.random((2, count, 1))
        fold = u + v > 1
        u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
        a, b, c = self._corners()[chosen].transpose(1, 0, 2)
        return a + u * (b - a) + v * (c - a), cross[chosen] / weight[chosen, None]

    def samples(self, count: int, seed: int, radius: ArrayLike | None = None) -> dl.Samples:
        """Samples uniform by area, so that their mean is the mean over the area."""
        return dl.Samples(*self.points(count, seed), radius)


def joined(*shapes: Shape) -> Shape:
    first = np.cumsum([0, *(len(s.vertices) for s in shapes[:-1])])
    return Shape(
        np.concatenate([s.vertices for s in shapes]),
        np.concatenate([s.triangles + n for s, n in zip(shapes, first, strict=True)]),
    )


def quad(corner: ArrayLike, u: ArrayLike, v: ArrayLike) -> Shape:
    """One parallelogram; its front shows u x v."""
    corner, u, v = (np.asarray(x, np.float64) for x in (corner, u, v))
    return Shape(np.array([corner, corner + u, corner + u + v, corner + v]), np.array([[0, 1, 2], [0, 2, 3]]))


def disc(centre: ArrayLike, radius: float, corners: int = 256) -> Shape:
    """Regular polygon of a disc's area that faces down (-Y)."""
    turn = np.arange(corners) * 2 * np.pi / corners
    reach = radius * np.sqrt(2 * np.pi / corners / np.sin(2 * np.pi / corners))
    rim = np.stack([np.cos(turn), np.zeros(corners), np.sin(turn)], axis=1) * reach
    after = np.roll(np.arange(corners), -1)
    fan = np.stack([np.full(corners, corners), np.arange(corners), after], axis=1)
    return Shape(np.concatenate([rim, np.zeros((1, 3))]) + np.asarray(centre, np.float64), fan)


BOX_SIDES = ("left", "right", "floor", "ceiling", "back", "front")  # -x, +x, -y, +y, -z, +z


def box(low: ArrayLike, high: ArrayLike, sides: Sequence[str] = BOX_SIDES) -> Shape:
    """Sides of a box that are seen from inside, in the order of `sides`."""
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    shapes = []
    for side in sides:
        axis, upper = divmod(BOX_SIDES.index(side), 2)
        u, v = np.zeros(3), np.zeros(3)
        u[(axis + 1) % 3], v[(axis + 2) % 3] = (high - low)[(axis + 1) % 3], (high - low)[(axis + 2) % 3]
        corner = low.copy()
        if upper:
            corner[axis] = high[axis]
            u, v = v, u
        shapes.append(quad(corner, u, v))
    return joined(*shapes)


def sphere(cells: int, radius: float = 1.0) -> Shape:
    """Octahedron with `cells` x `cells` triangles a face, pushed out to the sphere; seen from inside.

    Vertices are shared, so that the normals that samples get from them are smooth.
    """
    row = cells + 1
    i, j = np.divmod(np.arange(row * row), row)
    octant = np.stack([i, j, cells - i - j], axis=1) / cells
    lower = np.flatnonzero(i + j < cells)
    upper = np.flatnonzero(i + j < cells - 1)
    faces = np.concatenate(
        [
            np.stack([lower, lower + row, lower + 1], axis=1),
            np.stack([upper + row, upper + row + 1, upper + 1], axis=1),
        ]
    )
    points, triangles = [], []
    for k in range(8):
        sign = np.array([1 if k >> axis & 1 else -1 for axis in range(3)])
        triangles.append(faces[:, :: 1 if sign.prod() < 0 else -1] + k * len(octant))
        points.append(octant * sign)
    vertices, index = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    used, index = np.unique(index.ravel()[np.concatenate(triangles)], return_inverse=True)
    vertices = vertices[used] / np.linalg.norm(vertices[used], axis=1, keepdims=True)
    return Shape(radius * vertices, index.reshape(-1, 3))


def bowl(cells: int, radius: float = 1.0) -> Shape:
    """The lower half of `sphere`, open at y = 0."""
    whole = sphere(cells, radius)
    below = whole.vertices[whole.triangles][:, :, 1].mean(axis=1) < 0
    used, index = np.unique(whole.triangles[below], return_inverse=True)
    return Shape(whole.vertices[used], index.reshape(-1, 3))


# ---- scenes ----------------------------------------------------------------------------------------

GREY = 0.5
BULB = np.array([1.0, 1.0, 1.0])  # intensity of point lights, W/sr
CELL_BULB, ROOM_BULB = (0.35, 0.6, 0.45), (-1.4, 1.8, 1.3)  # where they are


def grey(reflectance: float = GREY) -> dl.Material:
    return dl.Material("grey", (reflectance,) * 3)


def furnace(emission: float = 1.0, reflectance: float = GREY) -> tuple[dl.Scene, Shape]:
    """A closed cube of 2 m whose walls all emit and reflect alike."""
    walls = box((-1, -1, -1), (1, 1, 1))
    glowing = dl.Material("glowing", (reflectance,) * 3, (emission,) * 3, "walls")
    return dl.Scene([walls.mesh("walls", "glowing")], [glowing]), walls


def plane_under(*lights: dl.PointLight | dl.SpotLight | dl.SunLight) -> tuple[dl.Scene, Shape]:
    """A black floor of 4 x 4 m and nothing else."""
    floor = quad((-2, 0, -2), (0, 0, 4), (4, 0, 0))
    return dl.Scene([floor.mesh("floor", "black")], [dl.Material("black", (0, 0, 0))], lights), floor


HIGH, DEPTH = 2.5, 3.0  # of the two rooms; the left one is 3 m wide, the right one 4 m


def two_rooms(lit: str, lamp: str = "panel") -> dl.Scene:
    """Two closed rooms on one floor polygon, under one ceiling polygon, parted by one polygon at x = 0.

    Parameters
    ----------
    lit : "left" or "right", the room with the lamp; the other one is dark
    lamp : "panel" or "bulb"
    """
    hull = box((-3, 0, 0), (4, HIGH, DEPTH)).mesh("hull", "grey")
    wall = quad((0, 0, 0), (0, HIGH, 0), (0, 0, DEPTH)).mesh("wall", "grey")
    x = ROOM_BULB[0] if lit == "left" else 1.7
    if lamp == "bulb":
        return dl.Scene([hull, wall], [grey()], [dl.PointLight("bulb", (x, *ROOM_BULB[1:]), BULB)])
    panel = quad((x - 0.3, 2.4, 1.2), (0.6, 0, 0), (0, 0, 0.6)).mesh("panel", "glowing")
    return dl.Scene([hull, wall, panel], [grey(), dl.Material("glowing", (0, 0, 0), (10, 10, 10))])


def closet_in_hall(sides: int, turn: float) -> tuple[dl.Scene, dl.Samples]:
    """A lit prism of single polygons in a dark hall whose floor is one polygon; floor samples around it.

    Corners of the prism jut into the discs of the samples; with 3 sides its own are acute.
    """
    angle = turn + np.arange(sides) * 2 * np.pi / sides
    corners = 0.5 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    sheets = [quad(a, (0, 1, 0), b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    top = quad((-0.6, 1, -0.6), (1.2, 0, 0), (0, 0, 1.2))
    walls = joined(box((-2, 0, -2), (2, 2, 2)), *sheets, top).mesh("walls", "grey")
    scene = dl.Scene([walls], [grey()], [dl.PointLight("bulb", (0.05, 0.5, 0.02), BULB)])
    points = np.random.default_rng(sides).uniform(-0.8, 0.8, (8000, 2))
    facing = np.stack([np.cos(angle + np.pi / sides), np.sin(angle + np.pi / sides)])
    beyond = (points @ facing).max(axis=1) - 0.5 * np.cos(np.pi / sides)
    points = points[(beyond > 1e-6) & (beyond < 0.2)]
    return scene, dl.Samples(np.insert(points, 1, 0, axis=1), (0, 1, 0))


# ---- cases: error and leak of a rule ---------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Case:
    """Samples on one side of a wall, with the light on their side and on the other one.

    Parameters
    ----------
    lit, other : the scene with a lamp on the samples' side, and on the other side, whence none reaches them
    samples : automatic radii
    reference : (n,) irradiance in `lit`: exact in bowls, to 0.2 % in rooms
    places : masks of samples, by name
    """

    lit: dl.Scene
    other: dl.Scene
    samples: dl.Samples
    reference: np.ndarray
    places: dict[str, np.ndarray]


RIM_HEIGHT = 0.3  # of the bulb above the centre of the bowl


@cache
def bowl_case(smooth: bool, cells: int = 32) -> Case:
    """A hemispherical bowl of 1 m: light from above its centre, or from below."""
    mesh = bowl(cells).mesh("bowl", "grey", smooth_angle=35.0 if smooth else 0.0)
    inside, outside = (0, RIM_HEIGHT, 0), (0.2, -1.2, 0.1)
    scenes = [dl.Scene([mesh], [grey()], [dl.PointLight("bulb", at, BULB)]) for at in (inside, outside)]
    samples = dl.Samples.on_vertices(scenes[0], 0.2)
    caught = 2 * np.pi * (1 - RIM_HEIGHT / np.hypot(RIM_HEIGHT, 1))  # solid angle of the opening
    reference = cf.point_irradiance(inside, BULB, samples.points, samples.normals)[:, 0]
    reference = reference + cf.hemisphere_indirect(caught, GREY, 1.0)
    rim = samples.points[:, 1] > -0.1
    return Case(*scenes, samples, reference, {"inside": ~rim, "rim": rim})


@cache
def corner_case(thickness: float) -> Case:
    """A closed cell of 1 m on the floor of a hall that is one polygon: light in the cell, or in the hall.

    The cell's walls and ceiling are single polygons or, with a `thickness`, solid.
    """
    upper = ("left", "right", "ceiling", "back", "front")
    shapes = [box((-1, 0, -1), (2, 2, 2)), box((0, 0, 0), (1, 1, 1), upper)]
    if thickness > 0:
        outer = box((-thickness, 0, -thickness), (1 + thickness,) * 3, upper)
        shapes.append(outer.flipped())
    walls = joined(*shapes).mesh("walls", "grey")
    places = CELL_BULB, (-0.5, 0.6, 0.5)
    scenes = [dl.Scene([walls], [grey()], [dl.PointLight("bulb", at, BULB)]) for at in places]
    return Case(*scenes, *_in_room((0, 0, 0), (1, 1, 1), CELL_BULB, near=0.08))


@cache
def rooms_case() -> Case:
    """The left one of the two rooms: light in it, or in the right one."""
    scenes = two_rooms("left", "bulb"), two_rooms("right", "bulb")
    return Case(*scenes, *_in_room((-3, 0, 0), (0, HIGH, DEPTH), ROOM_BULB, near=0.15))


@cache
def _in_room(
    low: tuple[float, ...], high: tuple[float, ...], bulb: tuple[float, ...], near: float
) -> tuple[dl.Samples, np.ndarray, dict[str, np.ndarray]]:
    """Samples on a convex room's sides, most of them near its edges; irradiance; places."""
    room = box(low, high)
    points, normals = room.points(6000, seed=5)
    to_sides = np.sort(np.concatenate([points - low, high - points], axis=1), axis=1)
    edge, corner = to_sides[:, 1] < near, to_sides[:, 2] < near  # the nearest side is the sample's own
    keep = edge | (np.arange(len(points)) % 8 == 0)
    points, normals, edge, corner = points[keep], normals[keep], edge[keep], corner[keep]

    def direct(at: np.ndarray, normal: np.ndarray) -> np.ndarray:
        return cf.point_irradiance(bulb, BULB, at, normal)[:, 0]

    reference = ConvexRoom(room.rectangles(), GREY, direct, cells=12).irradiance(points, normals)
    places = {"flats": ~edge, "edges": edge & ~corner, "corners": corner}
    return dl.Samples(points, normals), reference, places


def wall_places(walls: Shape, most: int = 400) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Points and normals on a furnace's walls: in their middle, within 2 cm of one edge, of a corner."""
    points, normals = walls.points(400_000, seed=2)
    near = np.sort(1 - np.abs(points), axis=1)  # the first is the point's own wall
    chosen = {
        "middle": near[:, 1] > 0.3,
        "edge": (near[:, 1] < 0.02) & (near[:, 2] > 0.3),
        "corner": near[:, 2] < 0.02,
    }
    rows = {name: np.flatnonzero(where)[:most] for name, where in chosen.items()}
    return {name: (points[which], normals[which]) for name, which in rows.items()}
