# SPDX-License-Identifier: Apache-2.0
"""Irradiance against closed forms, with direct light from paths and from shadow rays."""

from __future__ import annotations

from dataclasses import dataclass

import deltalux as dl
import numpy as np
import pytest
from oracles import closed_forms as cf
from scenes_for_tests import (
    BULB,
    Shape,
    bowl_case,
    box,
    disc,
    furnace,
    grey,
    joined,
    plane_under,
    quad,
    sphere,
)
from statistics_for_tests import BY_SIZE, MODES, assert_each_sample, assert_mean, bake, runs
from thoroughness import slow

BY_MODE = pytest.mark.parametrize("direct", MODES)
SEEDS = range(1, 17)
LIFT = 0.03  # of the radius: discs lie above their samples by so much


def disc_means(function, samples: dl.Samples, radius: float) -> np.ndarray:
    """Mean over each sample's lifted disc of `function` (points, normals) -> (n,): what paths estimate."""
    rings, spokes = 6, 12
    u = np.cross(samples.normals, np.eye(3)[np.abs(samples.normals).argmin(axis=1)])
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(samples.normals, u)
    lifted = samples.points + LIFT * radius * samples.normals
    total = 0.0
    for k in range(rings * spokes):
        r, turn = radius * np.sqrt((k // spokes + 0.5) / rings), 2 * np.pi * (k + 0.5) / spokes
        total = total + function(lifted + r * (np.cos(turn) * u + np.sin(turn) * v), samples.normals)
    return total / (rings * spokes)


def on_faces(walls: Shape, cells: int):
    """A function of a seed: jittered points on each side of a box, whose mean is the mean over the area."""

    def samples(seed: int) -> dl.Samples:
        rng = np.random.default_rng(seed)
        points, normals = [], []
        for corner, u, v in walls.rectangles():
            grid = np.stack(np.meshgrid(np.arange(cells), np.arange(cells)), axis=-1).reshape(-1, 2)
            a, b = ((grid + rng.random(grid.shape)) / cells).T[:, :, None]
            points.append(corner + a * u + b * v)
            normals.append(np.broadcast_to(np.cross(u, v), points[-1].shape))
        return dl.Samples(np.concatenate(points), np.concatenate(normals), 0.05)

    return samples


# ---- enclosures ------------------------------------------------------------------------------------


@BY_MODE
@BY_SIZE
def test_furnace_at_each_sample_and_on_average(direct, size):
    """Null hypothesis: E = pi Le / (1 - rho) at each of 1,000 points of the walls. Rates 1e-3 twice."""
    emission, reflectance, count = 2.0, 0.5, round(1000 * size)
    scene, walls = furnace(emission, reflectance)
    expected = np.full(count, cf.furnace_irradiance(emission, reflectance))
    found = runs(scene, walls.samples(count, seed=3), SEEDS, paths=round(50_000 * size), direct=direct)
    assert_each_sample(found, expected)
    assert_mean(found, expected)


@BY_MODE
@BY_SIZE
@pytest.mark.parametrize("reflectance", [slow(0.0), 0.8])
def test_furnace_of_other_reflectances(direct, size, reflectance):
    """Null hypothesis: E = pi Le / (1 - rho) on average over the area. Rate 1e-3."""
    scene, walls = furnace(1.0, reflectance)
    samples = walls.samples(round(500 * size), seed=3)
    found = runs(scene, samples, SEEDS, paths=round(20_000 * size), direct=direct)
    if direct != "paths" and reflectance == 0:
        assert found.mean == pytest.approx(np.pi, rel=1e-5)
    else:
        assert_mean(found, cf.furnace_irradiance(1.0, reflectance))


@pytest.mark.parametrize(
    ("direct", "place", "seeds"),
    [
        *((direct, "edges", 1) for direct in MODES),
        ("gather", "corners", 1),
        *(slow(direct, "corners", 12) for direct in MODES),
    ],
)
def test_furnace_at_edges_and_corners(direct, place, seeds):
    """The mean over the display mesh's samples there is within 2 %, at default settings.

    One bake knows the mean over edges to 0.2 %, over the 24 corners to 2.2 %, 12 bakes to 0.64 %. Rate 2e-3.
    One that gathers knows that over the corners to 0.05 %.
    """
    scene, _ = furnace()
    every = dl.Samples.on_vertices(scene)
    near = (np.abs(every.points) > 1 - every.spacing / 2).sum(axis=1)
    here = near == 2 if place == "edges" else near == 3
    samples = dl.Samples(every.points[here], every.normals[here])
    assert len(samples) >= 24
    found = runs(scene, samples, range(1, seeds + 1), direct=direct).mean[:, 0]
    assert found.mean() == pytest.approx(cf.furnace_irradiance(1.0, 0.5), rel=0.02)


@BY_MODE
@BY_SIZE
def test_sphere_cavity(direct, size):
    """Null hypothesis: direct light of the bulb plus rho Phi / (4 pi R^2 (1 - rho)) at each vertex.

    The sphere is a polyhedron, whose area is the indirect part's denominator. Rates 1e-3 twice.
    """
    radius, rho, at = 1.5, 0.6, np.array([0.3, -0.2, 0.4])
    shape = sphere(round(32 * np.sqrt(size)), radius)
    scene = dl.Scene([shape.mesh("sphere", "grey")], [grey(rho)], [dl.PointLight("bulb", at, BULB)])
    normals = -shape.vertices / radius
    chosen = slice(None, None, 4)
    samples = dl.Samples(shape.vertices[chosen], normals[chosen], 0.08)
    indirect = cf.sphere_cavity_indirect(4 * np.pi, rho, np.sqrt(shape.area / (4 * np.pi)))

    def expected(points, normals):
        return cf.point_irradiance(at, BULB, points, normals)[:, 0] + indirect

    found = runs(scene, samples, SEEDS, paths=round(50_000 * size), direct=direct)
    if direct == "paths":
        reference = disc_means(expected, samples, 0.08)
    else:
        reference = expected(samples.points, samples.normals)
    assert_each_sample(found, reference)
    assert_mean(found, reference)


def _cube_with(emitter: str) -> tuple[dl.Scene, Shape, float]:
    """Scene, all surfaces that take light, and the emitter's power."""
    rho, walls = 0.5, box((0, 0, 0), (2, 2, 2))
    glowing = dl.Material("glowing", (rho,) * 3, (3, 3, 3))
    if emitter == "bulb":
        bulb = dl.PointLight("bulb", (0.8, 1.1, 0.7), BULB)
        return dl.Scene([walls.mesh("walls", "grey")], [grey(rho)], [bulb]), walls, 4 * np.pi
    if emitter == "wall":
        rest = box((0, 0, 0), (2, 2, 2), ("left", "right", "floor", "back", "front"))
        lit = box((0, 0, 0), (2, 2, 2), ("ceiling",))
        meshes = [rest.mesh("walls", "grey"), lit.mesh("lamp", "glowing")]
        return dl.Scene(meshes, [grey(rho), glowing]), walls, 3 * np.pi * 4
    # A panel in the room: both of its sides take light, so both count as area.
    panel = quad((0.6, 1.5, 0.7), (0.8, 0, 0), (0, 0, 0.6))
    meshes = [walls.mesh("walls", "grey"), panel.mesh("panel", "glowing")]
    surfaces = joined(walls, panel, quad((0.6, 1.5, 0.7), (0, 0, 0.6), (0.8, 0, 0)))
    return dl.Scene(meshes, [grey(rho), glowing]), surfaces, 3 * np.pi * 0.48


@BY_MODE
@BY_SIZE
@pytest.mark.parametrize("emitter", [slow("bulb"), slow("wall"), "panel"])
def test_mean_over_a_cube(direct, size, emitter):
    """Null hypothesis: mean E = Phi / (S (1 - rho)), S = all surfaces that take light. Rate 1e-3.

    The points are drawn anew for each run, so that the spread over the runs has their share of the error.
    Sides are weighted by area: of the panel, by that of its two faces.
    """
    scene, surfaces, power = _cube_with(emitter)
    cells = round(20 * np.sqrt(size))
    found = runs(scene, on_faces(surfaces, cells), SEEDS, paths=round(100_000 * size), direct=direct)
    areas = np.array([np.linalg.norm(np.cross(u, v)) for _, u, v in surfaces.rectangles()])
    weight = np.repeat(areas / areas.mean(), cells * cells)
    weighted = type(found)(found.irradiance * weight[:, None], found.standard_error)
    assert_mean(weighted, cf.enclosure_mean(power, surfaces.area, 0.5))


# ---- direct light over a black floor ---------------------------------------------------------------

BULB_AT = np.array([0.1, 1.0, -0.2])
SPOT = {"direction": (0.3, -1.0, 0.2), "inner_angle": 0.3, "outer_angle": 0.7}
COLOUR = (1.0, 2.0, 3.0)


def _point(points, normals):
    return cf.point_irradiance(BULB_AT, COLOUR, points, normals)


def _spot(points, normals):
    return cf.spot_irradiance(
        BULB_AT, SPOT["direction"], COLOUR, SPOT["inner_angle"], SPOT["outer_angle"], points, normals
    )


def _sun(points, normals):
    return cf.sun_irradiance((1, -2, 0.5), COLOUR, normals)


LAMPS = {
    "point": (dl.PointLight("lamp", BULB_AT, COLOUR), _point),
    "spot": (dl.SpotLight("lamp", BULB_AT, intensity=COLOUR, **SPOT), _spot),
    "sun": (dl.SunLight("lamp", (1, -2, 0.5), COLOUR), _sun),
}


@pytest.mark.parametrize("kind", LAMPS)
def test_lamp_over_a_floor_by_shadow_rays(kind):
    """No randomness: each sample, each channel, to 1e-3 of the value there or of the mean."""
    light, exact = LAMPS[kind]
    scene, floor = plane_under(light)
    samples = floor.samples(2000, seed=4)
    session = bake(scene, samples, paths=1000, direct="sampled")
    expected = exact(samples.points, samples.normals)
    assert session.irradiance == pytest.approx(expected, rel=1e-3, abs=1e-3 * expected.mean())
    assert not session.standard_error.any()


@pytest.mark.parametrize("kind", LAMPS)
@BY_SIZE
def test_lamp_over_a_floor_by_paths(kind, size):
    """Null hypothesis: each sample has the mean of the closed form over its disc. Rates 1e-3 twice."""
    light, exact = LAMPS[kind]
    scene, floor = plane_under(light)
    points, normals = floor.points(round(800 * size), seed=4)
    samples = dl.Samples(0.9 * points, normals, 0.1)  # whole discs only
    found = runs(scene, samples, SEEDS, paths=round(50_000 * size), direct="paths")
    expected = disc_means(lambda p, n: exact(p, n)[:, 0], samples, 0.1)
    # On the rim of a spot's cone a few paths are expected, or none: no normal distribution.
    clear = (expected == 0) | (expected > 0.02 * expected.max())
    assert_each_sample(found.at(clear), expected[clear])
    assert_mean(found, expected)
    assert found.irradiance[..., 2] == pytest.approx(3 * found.irradiance[..., 0])


@dataclass(frozen=True)
class AreaLamp:
    """A polygon that shines, and elements whose configuration factors to it are known."""

    shape: Shape
    rim: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    factors: np.ndarray


def _disc_lamp() -> AreaLamp:
    """A disc that faces down, as a regular polygon of its area; elements face it, or stand upright."""
    shape, height, radius = disc((0, 1.2, 0), 0.9, corners=128), 1.2, 0.9
    near, far = np.linspace(0, 2.4, 30), np.linspace(1.0, 2.4, 30)
    offsets = np.concatenate([near, far])
    return AreaLamp(
        shape,
        shape.vertices[:128],
        np.stack([offsets, 0 * offsets, 0 * offsets], axis=1),
        np.repeat([[0, 1.0, 0], [-1, 0, 0]], 30, axis=0),
        np.concatenate(
            [
                cf.element_to_parallel_disc(height, near, radius),
                cf.element_to_perpendicular_disc(height, far, radius),
            ]
        ),
    )


def _rectangle_lamp() -> AreaLamp:
    """A rectangle that faces down; elements below its corner face it, or its plane from the side."""
    shape, depths = quad((0, 2.5, 0), (0.8, 0, 0), (0, 0, 1.1)), np.linspace(0.4, 2.4, 30)
    below = np.stack([0 * depths, 2.5 - depths, 0 * depths], axis=1)
    return AreaLamp(
        shape,
        shape.vertices,
        np.concatenate([below, below]),
        np.repeat([[0, 1.0, 0], [1, 0, 0]], 30, axis=0),
        np.concatenate(
            [
                cf.element_to_parallel_rectangle(0.8, 1.1, depths),
                cf.element_to_perpendicular_rectangle(0.8, 1.1, depths),
            ]
        ),
    )


@pytest.mark.parametrize("lamp", [_disc_lamp(), _rectangle_lamp()], ids=["disc", "rectangle"])
@BY_MODE
def test_configuration_factors(direct, lamp):
    """E = pi L F. Shadow rays: each sample to 1e-3. Paths: the null hypothesis is the mean over the disc.

    That mean is taken over Lambert's polygon, which is compared with the catalogue. Rates 1e-3 twice.
    """
    radiance, radius = 2.0, 0.04
    materials = [dl.Material("glowing", (0, 0, 0), (radiance,) * 3), grey(0.0)]
    # Remote specks keep the border of the world, where flights end, away from the samples.
    specks = joined(*(quad((x, x, x), (0.01, 0, 0), (0, 0.01, 0)) for x in (-3, 4)))
    scene = dl.Scene([lamp.shape.mesh("lamp", "glowing"), specks.mesh("specks", "grey")], materials)
    samples = dl.Samples(lamp.points, lamp.normals, radius)

    def exact(points, normals):
        return np.pi * radiance * cf.polygon_factor(points, normals, lamp.rim)

    assert exact(lamp.points, lamp.normals) == pytest.approx(np.pi * radiance * lamp.factors, rel=1e-3)
    if direct != "paths":
        found = bake(scene, samples, paths=1000, direct=direct)
        assert found.irradiance[:, 0] == pytest.approx(np.pi * radiance * lamp.factors, rel=1e-3)
        return
    found = runs(scene, samples, SEEDS, paths=100_000, direct=direct)
    expected = disc_means(exact, samples, radius)
    assert_each_sample(found, expected)
    assert_mean(found, expected)


@BY_SIZE
def test_floor_at_the_border_of_the_world(size):
    """Null hypothesis: under a sun each disc has the sun's irradiance, also where it overhangs the scene.

    A flight that hits nothing ends at the border of the world, so discs must not reach beyond. Rates 1e-3.
    """
    light, exact = LAMPS["sun"]
    scene, floor = plane_under(light)
    samples = floor.samples(round(1500 * size), seed=6)
    outer = np.abs(samples.points).max(axis=1) > 1.9
    assert outer.sum() > 100 * size
    found = runs(scene, samples, SEEDS, paths=round(20_000 * size), direct="paths")
    expected = exact(samples.points, samples.normals)[:, 0]
    assert_each_sample(found, expected)
    assert_mean(found.at(outer), expected[outer])


def test_automatic_radius_does_not_collapse_on_a_concave_mesh():
    """On a vertex of a bowl with smooth normals, the faces around it are no surroundings."""
    coarse, fine = (bowl_case(smooth=True, cells=cells) for cells in (12, 40))
    radii = [np.median(bake(c.lit, c.samples, paths=1000).radius) for c in (coarse, fine)]
    assert radii[0] > 0.5 * radii[1]


# ---- shadow ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("lamp", ["point", "sun", "area"])
@BY_MODE
def test_umbra_is_black(direct, lamp):
    """Behind an occluder the light is exactly 0, not merely small; beside it, it is not."""
    floor = quad((-2, 0, -2), (0, 0, 4), (4, 0, 0))
    screen = quad((-0.8, 0.7, -0.8), (0, 0, 1.6), (1.6, 0, 0))
    black = dl.Material("black", (0, 0, 0))
    meshes, lights = [floor.mesh("floor", "black"), screen.mesh("screen", "black")], []
    if lamp == "area":
        meshes.append(quad((-0.3, 1.6, -0.3), (0.6, 0, 0), (0, 0, 0.6)).mesh("lamp", "glowing"))
    elif lamp == "point":
        lights.append(dl.PointLight("lamp", (0, 1.5, 0), BULB))
    else:
        lights.append(dl.SunLight("lamp", (0, -1, 0), BULB))
    scene = dl.Scene(meshes, [black, dl.Material("glowing", (0, 0, 0), (5, 5, 5))], lights)
    turn = np.linspace(0, 2 * np.pi, 40)
    ring = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    radii = np.concatenate([r * ring for r in (0.0, 0.2, 0.4, 0.6)])
    samples = dl.Samples(np.concatenate([radii, 1.9 * ring]), (0, 1, 0), 0.1)
    found = bake(scene, samples, paths=50_000, direct=direct).irradiance
    assert (found[:160] == 0).all()
    assert found[160:].mean() > 0.01


# ---- energy ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("paths", [3_000, slow(30_000)])
def test_energy_is_counted_to_the_unit(paths):
    """Emitted = absorbed + escaped in the session's integers, and again from the segments alone.

    The room lacks its ceiling. A path has escaped where its last flight ends on the border of the world,
    which stands off the walls; each landing absorbs what the next flight does not carry.
    """
    walls = box((0, 0, 0), (2, 1.5, 1), ("left", "right", "floor", "back", "front"))
    panel = quad((0.5, 1.2, 0.3), (0.4, 0, 0), (0, 0, 0.4))
    brick = dl.Material("brick", (0.7, 0.4, 0.2))
    lamp = dl.Material("lamp", (0.3,) * 3, (3, 2, 1), two_sided=True)
    lights = [dl.PointLight("bulb", (1.5, 0.7, 0.5), (0.5, 0.7, 0.9)), dl.SunLight("sun", (0.3, -1, 0.2))]
    scene = dl.Scene([walls.mesh("walls", "brick"), panel.mesh("panel", "lamp")], [brick, lamp], lights)
    options = {"paths": paths, "seed": 7}
    place = dl.Samples([[1, 0, 0.5]], [[0, 1, 0]], 0.1)
    session = bake(scene, place, **options)
    emitted, absorbed, escaped = (np.array(session.energy[k]) for k in ("emitted", "absorbed", "escaped"))
    assert (emitted == absorbed + escaped).all()
    assert (absorbed > 0).all() and (escaped > 0).all()

    segments = dl.trace(scene, samples=place, threads=1, **options)
    assert segments.quantum == session.energy["quantum"]
    quanta = segments.quanta.astype(np.int64)
    order = np.lexsort((segments.bounce, segments.path))
    path, bounce, quanta = segments.path[order], segments.bounce[order], quanta[order]
    last = np.r_[path[1:] != path[:-1], True]
    assert ((bounce == 0) == np.r_[True, last[:-1]]).all()
    assert (np.diff(bounce.astype(int))[~last[:-1]] == 1).all()
    ends = (segments.origin + segments.length[:, None] * segments.direction.astype(np.float64))[order]
    low, high = scene.bounds
    outside = ((ends < low - 1e-3) | (ends > high + 1e-3)).any(axis=1)
    assert not outside[~last].any()
    left = quanta.copy()
    left[~last] -= quanta[1:][~last[:-1]]
    assert (left >= 0).all()
    assert (quanta[bounce == 0].sum(axis=0) == emitted).all()
    assert (quanta[outside].sum(axis=0) == escaped).all()
    assert (left[~outside].sum(axis=0) == absorbed).all()
