# SPDX-License-Identifier: Apache-2.0
"""Scenes of parallelograms and triangles, built once for Deltalux and for the path tracer of the oracles.

Everything is grey: light has one channel. Lengths in metres, +Y up.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import deltalux as dl
import numpy as np
from numpy.typing import ArrayLike, NDArray
from oracles.path_tracer import Bulb, Sun, Target, Tracer, World
from oracles.tracer_world import Primitives

Array = NDArray[np.float64]
Hole = tuple[float, float, float, float]  # along u from, to; along v from, to; metres

ABOVE = 1e-3  # of points over the surface that they are drawn on
SIDES = ("left", "right", "floor", "ceiling", "back", "front")  # -x, +x, -y, +y, -z, +z


def vector(values: ArrayLike) -> Array:
    return np.asarray(values, np.float64)


@dataclass(frozen=True)
class Paint:
    """A material: reflectance, radiance of the front, and whether the back is as luminous."""

    reflectance: float
    radiance: float = 0.0
    both: bool = False


@dataclass(frozen=True, eq=False)
class Piece:
    """A parallelogram or triangle of a mesh; `measured`: points are drawn on its front."""

    mesh: str
    paint: str
    corner: Array
    u: Array
    v: Array
    triangle: bool = False
    measured: bool = False


@dataclass(frozen=True, eq=False)
class Truth:
    """A scene twice, and where its light is asked for.

    Parameters
    ----------
    dimmed : light groups that are switched off after the bake; they are dark in `world`
    dark : irradiance that is as good as none
    """

    kind: str
    about: dict[str, Any]
    scene: dl.Scene
    world: World
    points: Array
    normals: Array
    dimmed: tuple[str, ...]
    dark: float

    def measured(self, **options: Any) -> Measured:
        """Bake it with these options of a session, and dim what is dimmed after the bake."""
        start = time.process_time()
        with dl.Session(self.scene, dl.Samples(self.points, self.normals), **options) as session:
            session.bake()
            seconds = time.process_time() - start
            for group in self.dimmed:
                session.dim(group, 0.0)
            session.update()
            light, error = session.read()
            asked = session.at(self.points, self.normals)
        return Measured(light[:, 1], error[:, 1], asked[:, 1], seconds)


@dataclass(frozen=True, eq=False)
class Measured:
    """(n,) irradiance of samples, its claimed error, `Session.at` of their places; seconds of the bake."""

    light: Array
    error: Array
    asked: Array
    seconds: float


@dataclass(eq=False)
class Draft:
    """Collects pieces, lights, and what the path tracer should know of them."""

    about: dict[str, Any] = field(default_factory=dict)
    paints: dict[str, Paint] = field(default_factory=dict)
    pieces: list[Piece] = field(default_factory=list)
    movable: set[str] = field(default_factory=set)
    bulbs: dict[str, tuple[Array, float]] = field(default_factory=dict)
    suns: dict[str, tuple[Array, float]] = field(default_factory=dict)
    hints: list[Target] = field(default_factory=list)
    portals: list[Target] = field(default_factory=list)
    planes: list[Target] = field(default_factory=list)  # where points are drawn besides measured pieces
    solids: list[tuple[Array, Array, float]] = field(default_factory=list)  # centre, half size, turn
    dimmed: list[str] = field(default_factory=list)
    dark: float = 0.0
    centred: bool = False  # stays where it is drafted

    # ---- shapes -----------------------------------------------------------------------------------

    def quad(
        self, mesh: str, paint: str, corner: ArrayLike, u: ArrayLike, v: ArrayLike, measured: bool = False
    ) -> None:
        """One parallelogram that shows u x v."""
        self.pieces.append(Piece(mesh, paint, vector(corner), vector(u), vector(v), measured=measured))

    def wall(
        self, mesh: str, paint: str, face: Target, holes: Sequence[Hole] = (), measured: bool = False
    ) -> None:
        """A rectangle with holes that lie side by side along u."""
        lengths = np.linalg.norm(face.u), np.linalg.norm(face.v)
        along, up = face.u / lengths[0], face.v / lengths[1]

        def part(a: float, b: float, c: float, d: float) -> None:
            if b - a > 1e-9 and d - c > 1e-9:
                self.quad(
                    mesh, paint, face.corner + a * along + c * up, (b - a) * along, (d - c) * up, measured
                )

        last = 0.0
        for a, b, c, d in sorted(holes):
            part(last, a, 0, lengths[1]), part(a, b, 0, c), part(a, b, d, lengths[1])
            last = b
        part(last, lengths[0], 0, lengths[1])

    def box(
        self,
        mesh: str,
        paint: str,
        low: ArrayLike,
        high: ArrayLike,
        turn: float = 0.0,
        sides: Sequence[str] = SIDES,
        measured: Sequence[str] = (),
    ) -> None:
        """A box seen from outside, turned about the vertical through its centre."""
        faces, centre = box_faces(low, high), (vector(low) + vector(high)) / 2
        matrix = turned(turn)
        for side in sides:
            f = faces[side]
            self.quad(
                mesh,
                paint,
                centre + matrix @ (f.corner - centre),
                matrix @ f.v,
                matrix @ f.u,
                side in measured,
            )

    def solid(self, mesh: str, paint: str, low: ArrayLike, high: ArrayLike, turn: float = 0.0) -> None:
        """A box that no point may lie in; points are drawn on its top."""
        self.box(mesh, paint, low, high, turn, measured=("ceiling",))
        low, high = vector(low), vector(high)
        self.solids.append(((low + high) / 2, (high - low) / 2, turn))

    def panel(self, mesh: str, paint: str, corner: ArrayLike, u: ArrayLike, v: ArrayLike) -> None:
        """A luminous parallelogram, which the path tracer seeks."""
        self.quad(mesh, paint, corner, u, v)
        self.hints.append(Target(vector(corner), vector(u), vector(v)))

    def triangles(self, mesh: str, paint: str, corners: Array, measured: bool = False) -> None:
        for a, b, c in corners:
            self.pieces.append(Piece(mesh, paint, a, b - a, c - a, True, measured))

    def opening(self, hole: Target) -> None:
        """A hole that light comes through."""
        self.portals.append(hole)
        self.hints.append(hole)

    def patches(self, holes: Sequence[Target], faces: Sequence[Target]) -> None:
        """Let the path tracer seek the parts of `faces` that punctual lights reach through holes."""
        for hole in holes:
            corners = hole.corner + np.array([0 * hole.u, hole.u, hole.v, hole.u + hole.v])
            ways = [np.broadcast_to(direction, (4, 3)) for direction, _ in self.suns.values()]
            ways += [corners - position for position, _ in self.bulbs.values()]
            for way in ways:
                self.hints += [p for face in faces if (p := _projected(corners, way, face)) is not None]

    def unmeasure(self) -> None:
        """Draw points on `planes` alone."""
        self.pieces = [replace(piece, measured=False) for piece in self.pieces]

    # ---- results ----------------------------------------------------------------------------------

    def finished(self, kind: str, rng: np.random.Generator, count: int) -> Truth:
        """Turned and moved somewhere, with `count` points that no sun lights directly."""
        shift = vector((0, 0, 0)) if self.centred else rng.uniform(-20, 20, 3)
        matrix = np.eye(3) if self.centred else turned(rng.uniform(0, 2 * np.pi))
        place = _Place(matrix, shift)
        world = self._world(place)
        points, normals = self._points(place, world, rng, count)
        return Truth(
            kind, self.about, self._scene(place), world, points, normals, tuple(self.dimmed), self.dark
        )

    def _world(self, place: _Place) -> World:
        paints = [self.paints[piece.paint] for piece in self.pieces]
        dark = np.array([piece.mesh in self.dimmed for piece in self.pieces])
        surfaces = Primitives(
            place.points(np.array([p.corner for p in self.pieces])),
            place.vectors(np.array([p.u for p in self.pieces])),
            place.vectors(np.array([p.v for p in self.pieces])),
            np.array([p.triangle for p in self.pieces]),
            np.array([p.reflectance for p in paints]),
            np.where(dark, 0.0, [p.radiance for p in paints]),
            np.array([p.both for p in paints]),
        )
        lit = lambda lights: [value for name, value in lights.items() if name not in self.dimmed]  # noqa: E731
        return World(
            surfaces,
            tuple(Bulb(place.points(position), intensity) for position, intensity in lit(self.bulbs)),
            tuple(Sun(place.vectors(direction), irradiance) for direction, irradiance in lit(self.suns)),
            tuple(place.target(hint) for hint in self.hints),
            tuple(place.target(portal) for portal in self.portals),
        )

    def _scene(self, place: _Place) -> dl.Scene:
        meshes = []
        for name in dict.fromkeys(piece.mesh for piece in self.pieces):
            own = [piece for piece in self.pieces if piece.mesh == name]
            meshes.append(_mesh(name, own, place, name in self.movable))
        materials = [
            dl.Material(name, (p.reflectance,) * 3, (p.radiance,) * 3, two_sided=p.both)
            for name, p in self.paints.items()
        ]
        lights: list[Any] = [
            dl.PointLight(name, place.points(position), (intensity,) * 3, group=name)
            for name, (position, intensity) in self.bulbs.items()
        ]
        lights += [
            dl.SunLight(name, place.vectors(direction), (irradiance,) * 3, group=name)
            for name, (direction, irradiance) in self.suns.items()
        ]
        return dl.Scene(meshes, materials, lights, unit="lux")

    def _points(
        self, place: _Place, world: World, rng: np.random.Generator, count: int
    ) -> tuple[Array, Array]:
        targets = [Target(p.corner, p.u, p.v) for p in self.pieces if p.measured and not p.triangle]
        targets += self.planes
        cross = np.array([np.cross(t.u, t.v) for t in targets])
        areas = np.linalg.norm(cross, axis=1)
        tracer = Tracer(World(world.surfaces, suns=world.suns))
        points, normals = np.zeros((2, 0, 3))
        while len(points) < count:
            chosen = rng.choice(len(targets), 4 * count, p=areas / areas.sum())
            along = rng.uniform(0.02, 0.98, (len(chosen), 2, 1))
            own = [np.array([getattr(targets[k], part) for k in chosen]) for part in ("corner", "u", "v")]
            normal = cross[chosen] / areas[chosen, None]
            there = own[0] + along[:, 0] * own[1] + along[:, 1] * own[2] + ABOVE * normal
            keep = ~self._in_solids(there)
            there, normal = place.points(there[keep]), place.vectors(normal[keep])
            shade = tracer.punctual(there, normal) == 0
            points, normals = np.r_[points, there[shade]], np.r_[normals, normal[shade]]
        return points[:count], normals[:count]

    def _in_solids(self, points: Array) -> NDArray[np.bool_]:
        inside = np.zeros(len(points), bool)
        for centre, half, turn in self.solids:
            inside |= (abs((points - centre) @ turned(turn)) < half + ABOVE / 2).all(axis=1)
        return inside


@dataclass(frozen=True)
class _Place:
    """Where a draft is put."""

    matrix: Array
    shift: Array

    def points(self, points: Array) -> Array:
        return points @ self.matrix.T + self.shift

    def vectors(self, vectors: Array) -> Array:
        return vectors @ self.matrix.T

    def target(self, target: Target) -> Target:
        return Target(self.points(target.corner), self.vectors(target.u), self.vectors(target.v))


def turned(angle: float) -> Array:
    """Rotation about +Y, radians."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([(cos, 0, sin), (0, 1, 0), (-sin, 0, cos)])


def box_faces(low: ArrayLike, high: ArrayLike) -> dict[str, Target]:
    """The sides of a box, seen from inside."""
    low, high = vector(low), vector(high)
    x, y, z = np.diag(high - low)
    corners = {
        "left": (low, y, z), "right": (low + x, z, y), "floor": (low, z, x), "ceiling": (low + y, x, z),
        "back": (low, x, y), "front": (low + z, y, x),
    }  # fmt: skip
    return {side: Target(*corners[side]) for side in SIDES}


def hole_target(face: Target, hole: Hole) -> Target:
    """The hole in the plane of its wall."""
    along, up = face.u / np.linalg.norm(face.u), face.v / np.linalg.norm(face.v)
    a, b, c, d = hole
    return Target(face.corner + a * along + c * up, (b - a) * along, (d - c) * up)


def _projected(corners: Array, ways: Array, face: Target) -> Target | None:
    """The part of a rectangle that holds the shadows of `corners` along `ways`; None if there is none."""
    normal = np.cross(face.u, face.v)
    steep = ways @ normal
    if (steep > -1e-6 * np.linalg.norm(normal)).any():
        return None
    far = (face.corner - corners) @ normal / steep
    if (far <= 1e-9).any():
        return None
    there = corners + far[:, None] * ways - face.corner
    a, b = (np.clip(there @ edge / (edge @ edge), 0, 1) for edge in (face.u, face.v))
    if np.ptp(a) <= 0 or np.ptp(b) <= 0:
        return None
    return Target(face.corner + a.min() * face.u + b.min() * face.v, np.ptp(a) * face.u, np.ptp(b) * face.v)


def _mesh(name: str, own: list[Piece], place: _Place, movable: bool) -> dl.Mesh:
    vertices, triangles, paints = [], [], []
    used = list(dict.fromkeys(piece.paint for piece in own))
    for piece in own:
        first = sum(map(len, vertices))
        corners = [0 * piece.u, piece.u, piece.v] if piece.triangle else [
            0 * piece.u, piece.u, piece.u + piece.v, piece.v
        ]  # fmt: skip
        vertices.append(piece.corner + np.array(corners))
        triangles += [(first, first + k - 1, first + k) for k in range(2, len(corners))]
        paints += [used.index(piece.paint)] * (len(corners) - 2)
    return dl.Mesh(
        name, place.points(np.concatenate(vertices)), triangles, tuple(used), paints, movable=movable
    )
