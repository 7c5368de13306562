# SPDX-License-Identifier: Apache-2.0
"""The path tracer of the oracles, and its verdicts, against closed forms.

False-alarm rates: each comparison of a mean is within 5 of its standard errors, below 1e-6 by chance.
"""

from __future__ import annotations

import numpy as np
import pytest
from builders.truth_draft import box_faces
from oracles import closed_forms as cf
from oracles.path_tracer import Bulb, Found, Sun, Target, Tracer, World
from oracles.tracer_world import Frames, Geometry, primitives
from oracles.truth_verdict import judge
from scenes_for_tests import disc
from scipy import stats

UP = np.array([0.0, 1.0, 0.0])
FACES = tuple(box_faces((-1, -1, -1), (1, 1, 1)).values())
PANEL = Target(np.array([0.2, 1, -0.3]), np.array([0.7, 0, 0]), np.array([0, 0, 0.5]))  # faces down


def faces(targets, **more):
    return primitives(
        *(np.array([getattr(t, part) for t in targets]) for part in ("corner", "u", "v")), **more
    )


def floor_points(count, seed=1):
    points = np.random.default_rng(seed).uniform(-1.5, 1.5, (count, 3)) * (1, 0, 1)
    return points, np.tile(UP, (count, 1))


def assert_right(found, expected):
    """Null hypothesis: each value is right to its error, and so is their mean."""
    difference = found.mean - expected
    assert (abs(difference) <= 5 * found.standard_error + 1e-9).all()
    assert abs(difference.mean()) <= 5 * np.sqrt((found.standard_error**2).sum()) / len(difference) + 1e-9


@pytest.mark.parametrize("sought", [(), FACES[:1], FACES[1:4]])
def test_furnace(sought):
    """Whatever is sought: probabilities of directions must count everything once."""
    smaller = tuple(Target(0.5 * f.corner, 0.3 * f.u, 0.4 * f.v) for f in sought)
    world = World(faces(FACES, reflectance=0.5, radiance=1.0), hints=smaller, portals=smaller[:1])
    points = np.array([(0, -0.999, 0), (0.9, -0.999, 0.99), (0.1, 0.2, -0.3)])
    normals = np.array([UP, UP, (0.6, 0.8, 0)])
    found = Tracer(world).irradiance(points, normals, 8000, seed=1)
    assert_right(found, cf.furnace_irradiance(1.0, 0.5))
    assert (found.standard_error < 0.03 * found.mean).all()


@pytest.mark.parametrize("hints", [(), (PANEL,)])
@pytest.mark.parametrize("both", [False, True])
def test_rectangle(hints, both):
    """From below, and from above where only a lamp of two sides shines."""
    points, normals = floor_points(40)
    points, normals = np.r_[points, points + 2 * UP], np.r_[normals, -normals]
    world = World(faces([PANEL], radiance=3.0, both=both), hints=hints)
    found = Tracer(world).irradiance(points, normals, 3000, seed=2)
    corners = PANEL.corner + np.array([0 * PANEL.u, PANEL.u, PANEL.u + PANEL.v, PANEL.v])
    expected = 3 * np.pi * cf.polygon_factor(points, normals, corners)
    if both:
        expected += 3 * np.pi * cf.polygon_factor(points, normals, corners[::-1])
    assert_right(found, expected)


def test_disc_of_triangles():
    shape = disc((0, 1, 0), 0.5)
    a, b, c = shape.vertices[shape.triangles].transpose(1, 0, 2)
    world = World(primitives(a, b - a, c - a, triangle=True, radiance=2.0))
    points, normals = floor_points(20)
    found = Tracer(world).irradiance(points, normals, 5000, seed=3)
    factor = cf.element_to_parallel_disc(1.0, np.linalg.norm(points, axis=1), 0.5)
    assert_right(found, 2 * np.pi * factor)


@pytest.mark.parametrize("reflectance", [0.5, 0.9, 0.98])
def test_energy_of_a_cube(reflectance):
    """The mean over the faces is Phi / (S (1 - rho)); points by a sequence, whose own error is 0.2 %."""
    at = stats.qmc.Sobol(2, rng=1).random(64)
    points = np.concatenate([f.corner + at[:, :1] * f.u + at[:, 1:] * f.v for f in FACES])
    normals = np.repeat([np.cross(f.u, f.v) / 4 for f in FACES], len(at), axis=0)
    world = World(faces(FACES, reflectance=reflectance), (Bulb(np.array([0.3, 0.1, -0.2]), 2.0),))
    found = Tracer(world).irradiance(points + 1e-6 * normals, normals, 60, seed=4)
    noise = np.sqrt((found.standard_error**2).sum()) / len(points)
    expected = cf.enclosure_mean(8 * np.pi, 24.0, reflectance)
    assert abs(found.mean.mean() - expected) <= 5 * noise + 2e-3 * expected
    assert noise < 0.01 * expected


@pytest.mark.parametrize("width", [0.3, 0.01])
def test_gap(width):
    """A panel behind a wall with a gap: the part of it that is seen, by a fine midpoint rule."""
    gap = Target(np.array([0, 0, -width / 2]), np.array([0, 1.0, 0]), np.array([0, 0, width]))
    tall = np.array([0, 6.0, 0])
    walls = [
        Target(np.array([0, 0, -5.0]), tall, np.array([0, 0, 5 - width / 2])),
        Target(np.array([0, 0, width / 2]), tall, np.array([0, 0, 5.0])),
        Target(np.array([0, 1.0, -width / 2]), tall, np.array([0, 0, width])),
    ]
    panel = Target(np.array([-1.5, 1.5, -0.5]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]))
    radiance = np.array([0, 0, 0, 5.0])
    world = World(faces([*walls, panel], radiance=radiance), hints=(gap, panel), portals=(gap,))
    points = np.array([(0.5, 0, 0), (1.0, 0, 0.1), (2.0, 0, -0.2)])
    found = Tracer(world).irradiance(points, np.tile(UP, (3, 1)), 20_000, seed=5)
    steps = (np.arange(1000) + 0.5) / 1000
    a, b = (m.ravel()[:, None] for m in np.meshgrid(steps, steps))
    expected = []
    for point in points:
        way = panel.corner + a * panel.u + b * panel.v - point
        t = -point[0] / way[:, 0]
        seen = (t * way[:, 1] < 1) & (abs(point[2] + t * way[:, 2]) < width / 2)
        expected.append(5 * (seen * way[:, 1] ** 2 / (way**2).sum(axis=1) ** 2).mean())
    assert_right(found, np.array(expected))
    assert (found.standard_error < 0.02 * found.mean).all()


def test_what_is_sought_changes_the_noise_alone():
    """A room lit by sun through a window, with portals and hints and without: the same mean, less noise."""
    hole = Target(np.array([1, -0.2, -0.3]), np.array([0, 0, 0.6]), np.array([0, 0.4, 0]))
    wall = [
        Target(np.array([1, -1, -1.0]), np.array([0, 0, 2.0]), np.array([0, 0.8, 0])),
        Target(np.array([1, 0.2, -1.0]), np.array([0, 0, 2.0]), np.array([0, 0.8, 0])),
        Target(np.array([1, -0.2, -1.0]), np.array([0, 0, 0.7]), np.array([0, 0.4, 0])),
        Target(np.array([1, -0.2, 0.3]), np.array([0, 0, 0.7]), np.array([0, 0.4, 0])),
    ]
    land = Target(np.array([-9, -1.1, -9.0]), np.array([0, 0, 18.0]), np.array([18.0, 0, 0]))
    surfaces = faces([FACES[0], *FACES[2:], *wall, land], reflectance=0.6)
    sun = Sun(np.array([-0.8, -0.6, 0.0]), 1000.0)
    points = np.random.default_rng(1).uniform(-0.8, 0.8, (30, 3))
    normals = np.tile(UP, (30, 1)) * np.repeat([[1.0], [-1.0]], 15, axis=0)
    plain = Tracer(World(surfaces, (), (sun,))).irradiance(points, normals, 3000, seed=6)
    patch = Target(np.array([-1, -1, -0.3]), np.array([0, 0, 0.6]), np.array([1.5, 0, 0]))
    sought = World(surfaces, (), (sun,), (hole, patch), (hole,))
    found = Tracer(sought).irradiance(points, normals, 3000, seed=7)
    together = Found(found.mean - plain.mean, np.hypot(found.standard_error, plain.standard_error), 1)
    assert_right(together, 0.0)
    assert np.median(found.standard_error) < 0.7 * np.median(plain.standard_error)


def test_nearest_hit_is_that_of_all_pairs():
    """The tree of boxes changes nothing; primitives of 1 cm to 100 m."""
    rng = np.random.default_rng(8)
    size = 10.0 ** rng.uniform(-2, 2, (300, 1))
    own = primitives(
        rng.uniform(-5, 5, (300, 3)), size * rng.normal(size=(300, 3)), size * rng.normal(size=(300, 3)),
        triangle=rng.random(300) < 0.5,
    )  # fmt: skip
    origins, directions = rng.uniform(-6, 6, (5000, 3)), rng.normal(size=(5000, 3))
    directions[:100, 0] = 0  # along the boxes' faces
    every, _ = Frames(own).crossings(origins, directions)
    distance, index = Geometry(own).nearest(origins, directions)
    np.testing.assert_allclose(distance, every.min(axis=1), rtol=1e-12)
    np.testing.assert_array_equal(index, np.where(np.isfinite(distance), every.argmin(axis=1), -1))
    reach = rng.uniform(0, 3, 5000)
    np.testing.assert_array_equal(Geometry(own).free(origins, directions, reach), distance >= reach)


def test_own_error_is_the_spread():
    """Null hypothesis: variance over 40 seeds equals the claimed one; 24 points, within 35 %: below 1e-6."""
    world = World(faces(FACES, reflectance=0.5, radiance=np.arange(6.0)), hints=FACES[5:])
    points, normals = floor_points(24)
    tracer = Tracer(world)
    runs = [tracer.irradiance(points * 0.6, normals, 200, seed) for seed in range(40)]
    spread = np.var([run.mean for run in runs], axis=0, ddof=1).mean()
    claimed = np.mean([run.standard_error**2 for run in runs])
    assert claimed == pytest.approx(spread, rel=0.35)


# ---- verdicts --------------------------------------------------------------------------------------

TRUE = np.linspace(50, 200, 48)
SURE = Found(TRUE, 0.001 * TRUE, 1000)


def noise(share, seed=1):
    return 1 + share * np.random.default_rng(seed).normal(size=48)


def test_honest_noise_is_right_and_normal():
    verdict = judge(TRUE * noise(0.05), 0.05 * TRUE, SURE)
    assert not verdict.wrong
    assert verdict.over_normal(0.5) == pytest.approx(1, abs=0.5)


def test_errors_that_points_share_are_right():
    """All points 10 % too bright where 4 % are claimed: 2.5 errors, whatever the number of points."""
    assert not judge(1.1 * TRUE, 0.04 * TRUE, SURE).wrong


@pytest.mark.parametrize(
    ("light", "claimed", "lies"),
    [
        (1.1 * TRUE, 0.01 * TRUE, False),  # the mean
        (1.1 * TRUE, 0 * TRUE, True),
        (TRUE * np.where(np.arange(48) % 6 == 0, 1.3, 1), 0.001 * TRUE, False),  # an eighth of the points
        (TRUE * np.where(np.arange(48) % 2 == 0, 1.3, 0.7), 0 * TRUE, True),  # right in the mean
        (0 * TRUE, 0 * TRUE, True),
    ],
)
def test_wrong_light(light, claimed, lies):
    verdict = judge(light, claimed, SURE)
    assert verdict.wrong
    assert verdict.lies == lies


def test_two_per_cent_are_always_allowed():
    assert not judge(1.015 * TRUE, 0 * TRUE, SURE).wrong


def test_dark_places():
    dark = Found(0 * TRUE, 0 * TRUE, 1000)
    assert not judge(0 * TRUE, 0 * TRUE, dark).wrong
    assert not judge(0 * TRUE + 0.5, 0 * TRUE, dark, dark=1.0).wrong
    assert judge(0 * TRUE + 88, 0 * TRUE, dark, dark=1.0).lies
    assert judge(0 * TRUE + 1e-9, 0 * TRUE, dark).lies
