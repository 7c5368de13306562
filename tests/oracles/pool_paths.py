# SPDX-License-Identifier: Apache-2.0
"""Irradiance by path tracing that also finds the pools of narrow spots; rays by Mitsuba 3.

A path tracer meets a spot's pool of a hand's breadth once in a thousand paths. Here every vertex
of a path is also joined to a point where a ray of a spot lands; both ways to find a pool are
combined by the balance heuristic. Lamps are chosen by their unshadowed light at the vertex. All
surfaces are Lambertian.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from deltalux.scene import Scene, SpotLight
from numpy.typing import NDArray

from . import world
from .mitsuba_reference import Renderer

OFFSET = 4e-6  # of the scene's diagonal, between a surface and the rays that leave it
SLACK = 0.05  # a lamp's part may be seen where its centre is not
ROULETTE = 3  # bounces before paths end by chance


class PoolRenderer(Renderer):
    """As `Renderer`, for Lambertian scenes with area lamps and spots."""

    def __init__(self, scene: Scene, *, threads: int = 1) -> None:
        super().__init__(scene, threads=threads)
        low, high = scene.bounds
        self._offset = OFFSET * float(np.linalg.norm(high - low))
        self._lamps = _lamp_table(self._mi, scene)
        self._spots = _spot_table(self._mi, scene)

    def _estimate(self, sampler: Any, here: Any) -> Any:
        """Sum over the vertices of a path: light of lamps and pools, times the reflectances so far."""
        return _walk(self, sampler, here)

    def sees(self, origin: Any, target: Any) -> Any:
        """Whether nothing lies between, both already off their surfaces."""
        mi = self._mi
        way = target - origin
        return ~self._scene.ray_test(mi.Ray3f(origin, way, 1 - 1e-6, 0.0, []))

    def next_hit(self, origin: Any, direction: Any, active: Any) -> tuple[Any, Any, Any]:
        """Surface interaction, the normal on the side that the ray comes from, reflectance."""
        import drjit as dr

        mi = self._mi
        hit = self._scene.ray_intersect(mi.Ray3f(origin, direction), active)
        active = active & hit.is_valid()
        normal = dr.select(dr.dot(hit.n, direction) > 0, -hit.n, hit.n)
        reflectance = hit.bsdf().eval_diffuse_reflectance(hit, active)
        return hit, normal, dr.select(active, reflectance, mi.Color3f(0))


def _lamp_table(mi: Any, scene: Scene) -> dict[str, Any]:
    """Luminous triangles: a corner, two edges, normal, area, radiance."""
    parts = [part for part in world.parts(scene) if part.material.emissive]
    sides = [(side, part.material.emission) for part in parts for side in world.emitting_sides(part)]
    corners = np.concatenate([side for side, _ in sides]) if sides else np.zeros((0, 3, 3))
    light = np.concatenate([np.tile(e, (len(side), 1)) for side, e in sides]) if sides else np.zeros((0, 3))
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    cross = np.cross(u, v)
    twice = np.linalg.norm(cross, axis=1)
    columns = {"corner": corners[:, 0], "u": u, "v": v, "normal": cross / twice[:, None], "light": light}
    return {"count": len(corners), "area": mi.Float(_single(0.5 * twice))} | _vectors(mi, columns)


def _spot_table(mi: Any, scene: Scene) -> dict[str, Any]:
    """Spots: place, axis, intensity, cosines of the cones, and the chance to be asked for its pool."""
    lights = world.lights(scene)
    assert all(isinstance(light, SpotLight) for light in lights), "spots are the only punctual lights here"
    spots = [light for light in lights if isinstance(light, SpotLight)]
    cosines = np.cos([(s.inner_angle, s.outer_angle) for s in spots]).reshape(-1, 2)
    caps = np.array([2 * np.sin(s.outer_angle / 2) ** 2 for s in spots])  # 1 - cosine, without its rounding
    power = caps * np.array([s.intensity.sum() for s in spots])
    columns = {
        "place": np.array([s.position for s in spots]).reshape(-1, 3),
        "axis": np.array([s.direction for s in spots]).reshape(-1, 3),
        "light": np.array([s.intensity for s in spots]).reshape(-1, 3),
    }
    numbers = {
        "inner": cosines[:, 0],
        "outer": cosines[:, 1],
        "cap": caps,
        "chance": power / power.sum() if len(spots) else power,
    }
    single = {name: mi.Float(_single(values)) for name, values in numbers.items()}
    return {"count": len(spots), "sums": np.cumsum(numbers["chance"])} | single | _vectors(mi, columns)


def _single(values: NDArray) -> NDArray:
    return np.ascontiguousarray(values, np.float32)


def _vectors(mi: Any, columns: dict[str, NDArray]) -> dict[str, Any]:
    return {name: mi.Vector3f(_single(values.T)) for name, values in columns.items() if len(values)}


def _falloff(dr: Any, cosine: Any, inner: Any, outer: Any) -> Any:
    """Share of a spot's intensity (KHR_lights_punctual)."""
    return dr.square(dr.clip((cosine - outer) / (inner - outer), 0, 1))


def _walk(renderer: PoolRenderer, sampler: Any, here: Any) -> Any:
    import drjit as dr

    mi = renderer._mi
    lanes, count = dr.width(here), sampler.sample_count()
    lane, side = dr.arange(mi.UInt32, lanes) % count, int(np.sqrt(count))

    def step(sampler, total, carried, place, normal, found, lane, depth, active):  # type: ignore[no-untyped-def]
        total += carried * _lamps_at(renderer, sampler, place, normal, found, depth)
        total += carried * _pool_at(renderer, sampler, place, normal)
        jitter = sampler.next_2d()
        strata = (mi.Point2f(lane % side, lane // side) + jitter) / side
        first = (depth == 0) & (lane < side * side)
        local = mi.warp.square_to_cosine_hemisphere(dr.select(first, strata, jitter))
        direction = mi.Frame3f(mi.Normal3f(normal)).to_world(local)
        hit, other, reflectance = renderer.next_hit(place, direction, active)
        carried = carried * reflectance
        # By area, how densely such rays find the new vertex.
        found = local.z * dr.abs(dr.dot(other, direction)) * dr.inv_pi / dr.square(hit.t)
        place, normal = mi.Point3f(hit.p + renderer._offset * other), mi.Vector3f(other)
        keep = dr.select(depth + 1 >= ROULETTE, dr.minimum(dr.max(carried), 0.95), 1)
        active = active & hit.is_valid() & (sampler.next_1d() < keep)
        carried = carried / dr.maximum(keep, 1e-6)
        return sampler, total, carried, place, normal, found, lane, depth + 1, active

    state = (
        sampler, dr.zeros(mi.Color3f, lanes), dr.ones(mi.Color3f, lanes), mi.Point3f(here.p),
        mi.Vector3f(here.n), dr.zeros(mi.Float, lanes), lane, dr.zeros(mi.UInt32, lanes),
        dr.full(mi.Bool, True, lanes),
    )  # fmt: skip
    return dr.while_loop(state, lambda *state: state[-1], step)[1]


def _lamps_at(renderer: PoolRenderer, sampler: Any, place: Any, normal: Any, found: Any, depth: Any) -> Any:
    """Light of one lamp or spot, chosen by its unshadowed light.

    A spot's light at later vertices is shared with `_pool_at` by the balance heuristic.
    """
    import drjit as dr

    mi, lamps, spots = renderer._mi, renderer._lamps, renderer._spots
    u, sample = sampler.next_1d(), sampler.next_2d()
    all_weights, weight, chosen = mi.Float(0), mi.Float(0), mi.UInt32(0)
    for i in range(lamps["count"] + spots["count"]):
        own = _lamp_weight(renderer, i, place, normal)
        all_weights += own
        share = dr.select(own > 0, own / all_weights, 0)
        take = u < share
        u = dr.select(take, u / share, (u - share) / dr.maximum(1 - share, 1e-6))
        weight, chosen = dr.select(take, own, weight), dr.select(take, i, chosen)
    scale = dr.select(weight > 0, all_weights / weight, 0)
    light, target = mi.Color3f(0), mi.Point3f(place)
    if lamps["count"]:
        is_lamp = chosen < lamps["count"]
        root = dr.sqrt(sample.x)
        a, b = root * (1 - sample.y), root * sample.y

        def of(name: str, kind: Any = mi.Vector3f) -> Any:
            return dr.gather(kind, lamps[name], chosen, is_lamp)

        lamp_normal = of("normal")
        spot_on = of("corner") + a * of("u") + b * of("v") + renderer._offset * lamp_normal
        way = spot_on - place
        cosines = dr.maximum(dr.dot(normal, way), 0) * dr.maximum(-dr.dot(lamp_normal, way), 0)
        radiance = mi.Color3f(of("light"))
        light = dr.select(
            is_lamp, radiance * of("area", mi.Float) * cosines / dr.square(dr.squared_norm(way)), 0
        )
        target = dr.select(is_lamp, spot_on, target)
    if spots["count"]:
        is_spot = chosen >= lamps["count"]
        index = chosen - lamps["count"]

        def spot(name: str, kind: Any = mi.Float) -> Any:
            return dr.gather(kind, spots[name], index, is_spot)

        origin = spot("place", mi.Vector3f)
        way = origin - place
        squared = dr.squared_norm(way)
        cosine = dr.maximum(dr.dot(normal, way), 0) * dr.rsqrt(squared)
        along = -dr.dot(way, spot("axis", mi.Vector3f)) * dr.rsqrt(squared)
        share = _falloff(dr, along, spot("inner"), spot("outer"))
        pool = spot("chance") / (2 * dr.pi * spot("cap")) * cosine / squared
        mine = dr.select(depth == 0, 1, found / (found + pool))
        own = mi.Color3f(spot("light", mi.Vector3f)) * share * cosine / squared * mine
        light = dr.select(is_spot, own, light)
        target = dr.select(is_spot, mi.Point3f(origin), target)
    lit = (scale > 0) & (dr.max(light) > 0)
    return dr.select(lit & renderer.sees(place, target), light * scale, mi.Color3f(0))


def _lamp_weight(renderer: PoolRenderer, i: int, place: Any, normal: Any) -> Any:
    """Unshadowed light of the i-th lamp's centre, or of the spot; above 0 wherever there may be any."""
    import drjit as dr

    mi, lamps, spots = renderer._mi, renderer._lamps, renderer._spots

    def one(table: dict[str, Any], name: str, number: int) -> Any:
        return mi.Vector3f(*(float(table[name][k][number]) for k in range(3)))

    if i < lamps["count"]:
        area, normal_there = float(lamps["area"][i]), one(lamps, "normal", i)
        way = one(lamps, "corner", i) + (one(lamps, "u", i) + one(lamps, "v", i)) / 3 - place
        squared = dr.maximum(dr.squared_norm(way), area)
        inverse = dr.rsqrt(squared)
        here = dr.maximum(dr.dot(normal, way) * inverse, 0) + SLACK
        there = dr.maximum(-dr.dot(normal_there, way) * inverse, 0) + SLACK
        return float(np.sum([lamps["light"][k][i] for k in range(3)])) * area * here * there / squared
    i -= lamps["count"]
    way = one(spots, "place", i) - place
    squared = dr.squared_norm(way)
    cosine = dr.maximum(dr.dot(normal, way), 0) * dr.rsqrt(squared)
    along = -dr.dot(way, one(spots, "axis", i)) * dr.rsqrt(squared)
    share = _falloff(dr, along, float(spots["inner"][i]), float(spots["outer"][i]))
    return float(np.sum([spots["light"][k][i] for k in range(3)])) * share * cosine / squared


def _pool_at(renderer: PoolRenderer, sampler: Any, place: Any, normal: Any) -> Any:
    """Light that a spot's pool sends here, by a ray from a spot; shared with the path's next ray."""
    import drjit as dr

    mi, spots = renderer._mi, renderer._spots
    if not spots["count"]:
        return mi.Color3f(0)
    u, sample = sampler.next_1d(), sampler.next_2d()
    index = mi.UInt32(0)
    for bound in spots["sums"][:-1]:
        index += dr.select(u >= float(bound), 1, 0)

    def spot(name: str, kind: Any = mi.Float) -> Any:
        return dr.gather(kind, spots[name], index)

    cap, axis = spot("cap"), mi.Normal3f(spot("axis", mi.Vector3f))
    down = sample.x * cap  # 1 - cosine, uniform over the cone
    sine = dr.sqrt(down * (2 - down))
    angle = 2 * dr.pi * sample.y
    direction = mi.Frame3f(axis).to_world(mi.Vector3f(sine * dr.cos(angle), sine * dr.sin(angle), 1 - down))
    origin = mi.Point3f(spot("place", mi.Vector3f))
    hit, other, reflectance = renderer.next_hit(origin, direction, mi.Bool(True))
    target = hit.p + renderer._offset * other
    way = target - place
    squared = dr.squared_norm(way)
    cosines = dr.maximum(dr.dot(normal, way), 0) * dr.maximum(-dr.dot(other, way), 0) / squared
    cone = 2 * dr.pi * cap / spot("chance")
    pool = dr.abs(dr.dot(other, direction)) / (cone * dr.square(hit.t))
    by_path = cosines * dr.inv_pi / squared
    power = (
        mi.Color3f(spot("light", mi.Vector3f)) * _falloff(dr, 1 - down, spot("inner"), spot("outer")) * cone
    )
    light = power * reflectance * by_path * pool / (pool + by_path)
    lit = hit.is_valid() & (dr.max(light) > 0)
    return dr.select(lit & renderer.sees(place, target), light, mi.Color3f(0))
