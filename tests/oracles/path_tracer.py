# SPDX-License-Identifier: Apache-2.0
"""Irradiance by a slow, unbiased path tracer in NumPy that shares no code with the core.

At each vertex of a path, E = (light of punctual lights) + integral of L cos. The radiance that needs no
further bounce (emission, and what punctual lights send by one reflection) is found in two ways that the
balance heuristic combines (Veach & Guibas 1995): a ray to one of the `hints`, and the ray on which the path
goes on, distributed by the cosine or through one of the `portals`. Hints and portals are parallelograms that
say where light may come from; they change the noise, never the mean.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .tracer_world import Array, Frames, Geometry, Primitives, primitives

LIFT = 1e-6  # metres between a surface and the rays that leave it
TOGETHER = 1 << 16  # paths
LONGEST = 4000  # bounces: beyond it something is wrong
THROUGH = (0.5, 0.5, 0.25, 0.25)  # share of paths that go on through portals, at the first vertices
EVEN = 0.3  # of the rays to targets, whatever their size
AT_FIRST = 2  # rays to targets at a path's first vertex
LATER = 0.1  # that share at all others: each time it adds variance


@dataclass(frozen=True)
class Bulb:
    """Punctual light: a position and an intensity."""

    position: Array
    intensity: float


@dataclass(frozen=True)
class Sun:
    """Parallel light: direction of travel, of unit length, and irradiance of a plane that faces it."""

    direction: Array
    irradiance: float


@dataclass(frozen=True)
class Target:
    """A parallelogram that directions are drawn towards."""

    corner: Array
    u: Array
    v: Array


@dataclass(frozen=True, eq=False)
class World:
    """What is lit, and where light may come from."""

    surfaces: Primitives
    bulbs: tuple[Bulb, ...] = ()
    suns: tuple[Sun, ...] = ()
    hints: tuple[Target, ...] = ()
    portals: tuple[Target, ...] = ()


@dataclass(frozen=True)
class Found:
    """(n,) means over the paths and their standard errors; paths of each point."""

    mean: Array
    standard_error: Array
    paths: int

    def joined(self, other: Found) -> Found:
        """Both together, which are independent."""
        a, b = self.paths, other.paths
        error = np.sqrt((a * self.standard_error) ** 2 + (b * other.standard_error) ** 2) / (a + b)
        return Found((a * self.mean + b * other.mean) / (a + b), error, a + b)


class _Targets:
    """Directions towards parallelograms that have a corner above the horizon, the larger ones oftener."""

    def __init__(self, targets: tuple[Target, ...]) -> None:
        own = primitives(*(np.array([getattr(t, part) for t in targets]) for part in ("corner", "u", "v")))
        self._own, self._frames, self._areas = own, Frames(own), own.areas
        self._corners = own.corner[:, None] + np.stack([0 * own.u, own.u, own.v, own.u + own.v], axis=1)
        self._centres = self._corners.mean(axis=1)

    def shares(self, points: Array, normals: Array) -> Array:
        """(rays, targets) probabilities; all 0 for points from which none can be seen."""
        heights = (
            np.einsum("ri,tci->rtc", normals, self._corners) - (points * normals).sum(axis=1)[:, None, None]
        )
        highest = np.maximum(heights.max(axis=2), 0)
        away = ((points[:, None] - self._centres) ** 2).sum(axis=2) + self._areas
        up, solid = (highest > 0).astype(np.float64), highest * self._areas / away**1.5
        even, large = (w / np.maximum(w.sum(axis=1, keepdims=True), 1e-300) for w in (up, solid))
        return EVEN * even + (1 - EVEN) * large

    def draw(self, points: Array, shares: Array, rng: np.random.Generator) -> Array:
        """Unit directions to a uniform point of one target each."""
        u = rng.random((len(points), 3))
        chosen = (np.cumsum(shares, axis=1) < u[:, :1]).sum(axis=1).clip(max=shares.shape[1] - 1)
        own = self._own
        there = own.corner[chosen] + u[:, 1:2] * own.u[chosen] + u[:, 2:] * own.v[chosen]
        return _unit(there - points)

    def density(self, points: Array, directions: Array, shares: Array) -> Array:
        """Probability of these directions, per steradian."""
        t, height = self._frames.crossings(points, directions)
        with np.errstate(all="ignore"):
            each = shares * t**2 / (self._areas * abs(height))
        return np.where(np.isfinite(t) & (shares > 0), each, 0.0).sum(axis=1)


class Tracer:
    """Irradiance in one world."""

    def __init__(self, world: World) -> None:
        self._world, self._geometry = world, Geometry(world.surfaces)
        self._normals = world.surfaces.normals
        self._hints = _Targets(world.hints) if world.hints else None
        self._portals = _Targets(world.portals) if world.portals else None

    def irradiance(self, points: Array, normals: Array, paths: int, seed: int) -> Found:
        """Of `paths` paths from each point; points off their surfaces, normals of unit length."""
        rng = np.random.default_rng(seed)
        points, normals = np.asarray(points, np.float64), np.asarray(normals, np.float64)
        total, squares = np.zeros((2, len(points)))
        rounds = _shared_out(paths, max(1, TOGETHER // len(points)))
        for count in rounds:
            light = self._walk(np.repeat(points, count, axis=0), np.repeat(normals, count, axis=0), rng)
            light = light.reshape(len(points), count)
            total += light.sum(axis=1)
            squares += (light**2).sum(axis=1)
        mean = total / paths
        variance = np.maximum(squares / paths - mean**2, 0) * paths / (paths - 1)
        direct = self.punctual(points, normals)  # the same for all paths of a point
        return Found(mean + direct, np.sqrt(variance / paths), paths)

    def punctual(self, points: Array, normals: Array) -> Array:
        """Direct irradiance by bulbs and suns."""
        light = np.zeros(len(points))
        for bulb in self._world.bulbs:
            way = bulb.position - points
            square = (way**2).sum(axis=1)
            cosine = (way * normals).sum(axis=1) / np.sqrt(square)
            light += self._unless_hidden(points, way, bulb.intensity * cosine / square, 1.0)
        for sun in self._world.suns:
            way = np.broadcast_to(-sun.direction, points.shape)
            light += self._unless_hidden(points, way, sun.irradiance * (normals @ -sun.direction), np.inf)
        return light

    def _unless_hidden(self, points: Array, way: Array, light: Array, reach: float) -> Array:
        found, lit = np.zeros(len(points)), np.flatnonzero(light > 0)
        free = self._geometry.free(points[lit], way[lit], np.full(len(lit), reach))
        found[lit[free]] = light[lit[free]]
        return found

    def _walk(self, points: Array, normals: Array, rng: np.random.Generator) -> Array:
        """What one path from each point brings, without the punctual light of the first vertex."""
        total, alive, weight = np.zeros(len(points)), np.arange(len(points)), np.ones(len(points))
        for bounce in range(LONGEST):
            share = 0.0 if self._portals is None else THROUGH[bounce] if bounce < len(THROUGH) else LATER
            vertex = _Vertex(self, points, normals, share, 1 if bounce else AT_FIRST)
            total[alive] += weight * vertex.towards_hints(rng)
            step = vertex.onwards(rng)
            total[alive[step.rays]] += weight[step.rays] * step.light
            # Light paths go on as often as the surface reflects: one that has come through a portal weighs
            # little, and if few such paths went on, they would bring much each.
            weight = weight[step.rays] * step.weight
            chance = np.minimum(step.reflectance * np.maximum(weight, 1.0), 1.0)
            survives = rng.random(len(weight)) < chance
            weight = weight[survives] * step.reflectance[survives] / chance[survives]
            alive = alive[step.rays][survives]
            points, normals = step.points[survives], step.normals[survives]
            if not len(alive):
                return total
        raise RuntimeError(f"path tracer: {len(alive)} paths go on after {LONGEST} bounces")

    def seen(self, points: Array, directions: Array) -> _Seen:
        """First hits along the rays; only those that hit something."""
        t, index = self._geometry.nearest(points, directions)
        rays = np.flatnonzero(index >= 0)
        index = index[rays]
        inwards = (self._normals[index] * directions[rays]).sum(axis=1)
        normals = np.where((inwards > 0)[:, None], -1.0, 1.0) * self._normals[index]
        places = points[rays] + t[rays, None] * directions[rays] + LIFT * normals
        own = self._world.surfaces
        emitted = own.radiance[index] * ((inwards < 0) | own.both[index])
        reflectance = own.reflectance[index]
        radiance = emitted + reflectance / np.pi * self.punctual(places, normals)
        return _Seen(rays, places, normals, reflectance, radiance)


@dataclass(frozen=True)
class _Seen:
    """Rays that hit something: where, normal on their side, reflectance, radiance of no further bounce."""

    rays: NDArray[np.int64]
    points: Array
    normals: Array
    reflectance: Array
    radiance: Array


@dataclass(frozen=True)
class _Step:
    """What the next ray of paths brought, where they go on, and by how much their weight changes.

    The weight does not contain the reflectance as yet.
    """

    rays: NDArray[np.int64]
    points: Array
    normals: Array
    reflectance: Array
    light: Array
    weight: Array


@dataclass(eq=False)
class _Vertex:
    """Vertices of many paths, and both ways to find light there."""

    tracer: Tracer
    points: Array
    normals: Array
    share: float  # of rays that go on through portals
    count: int  # of rays to hints
    _to_hints: Array | None = field(init=False, default=None)
    _to_portals: Array | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        if self.tracer._hints is not None:
            self._to_hints = self.tracer._hints.shares(self.points, self.normals)
        if self.tracer._portals is not None:
            self._to_portals = self.tracer._portals.shares(self.points, self.normals)

    def towards_hints(self, rng: np.random.Generator) -> Array:
        """Light that rays to hints bring."""
        return sum((self._towards_hint(rng) for _ in range(self.count)), np.zeros(len(self.points)))

    def _towards_hint(self, rng: np.random.Generator) -> Array:
        light = np.zeros(len(self.points))
        if self._to_hints is None:
            return light
        assert self.tracer._hints is not None
        directions = self.tracer._hints.draw(self.points, self._to_hints, rng)
        cosine = (directions * self.normals).sum(axis=1)
        useful = np.flatnonzero((cosine > 0) & (self._to_hints.sum(axis=1) > 0))
        seen = self.tracer.seen(self.points[useful], directions[useful])
        bright = seen.radiance > 0
        rays = useful[seen.rays[bright]]
        both = self._hint_density(rays, directions[rays]) + self._onward_density(rays, directions[rays])
        light[rays] = cosine[rays] * seen.radiance[bright] / both
        return light

    def onwards(self, rng: np.random.Generator) -> _Step:
        """The next ray of each path."""
        directions = _cosine_directions(self.normals, rng)
        if self._to_portals is not None:
            assert self.tracer._portals is not None
            other = (rng.random(len(self.points)) < self.share) & (self._to_portals.sum(axis=1) > 0)
            through = np.flatnonzero(other)
            drawn = self.tracer._portals.draw(self.points[through], self._to_portals[through], rng)
            directions[through] = drawn
        cosine = (directions * self.normals).sum(axis=1)
        useful = np.flatnonzero(cosine > 0)
        seen = self.tracer.seen(self.points[useful], directions[useful])
        rays = useful[seen.rays]
        on = self._onward_density(rays, directions[rays])
        light, bright = np.zeros(len(rays)), np.flatnonzero(seen.radiance > 0)
        both = on[bright] + self._hint_density(rays[bright], directions[rays[bright]])
        light[bright] = cosine[rays[bright]] * seen.radiance[bright] / both
        return _Step(rays, seen.points, seen.normals, seen.reflectance, light, cosine[rays] / on / np.pi)

    def _hint_density(self, rays: NDArray[np.int64], directions: Array) -> Array:
        if self._to_hints is None:
            return np.zeros(len(rays))
        assert self.tracer._hints is not None
        return self.count * self.tracer._hints.density(self.points[rays], directions, self._to_hints[rays])

    def _onward_density(self, rays: NDArray[np.int64], directions: Array) -> Array:
        cosine = np.maximum((directions * self.normals[rays]).sum(axis=1), 0) / np.pi
        if self._to_portals is None:
            return cosine
        assert self.tracer._portals is not None
        shares = self._to_portals[rays]
        some = self.share * (shares.sum(axis=1) > 0)
        return (1 - some) * cosine + some * self.tracer._portals.density(
            self.points[rays], directions, shares
        )


def _shared_out(whole: int, most: int) -> list[int]:
    return [min(most, whole - first) for first in range(0, whole, most)]


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _cosine_directions(normals: Array, rng: np.random.Generator) -> Array:
    """A uniform point of the unit sphere about the tip of each normal (a cosine distribution)."""
    z, turn = rng.uniform(-1, 1, len(normals)), rng.uniform(0, 2 * np.pi, len(normals))
    ring = np.sqrt(1 - z**2)
    return _unit(normals + np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1))
