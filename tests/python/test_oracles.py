# SPDX-License-Identifier: Apache-2.0
"""The closed forms agree with numerical integration, and the other renderers with the closed forms."""

import numpy as np
import pytest
from deltalux.scene import spot_solid_angle
from oracles import closed_forms as cf
from scipy import integrate

UP = np.array([[0.0, 1.0, 0.0]])


def integrated_factor(point, normal, corner, u, v, tolerance=1e-8):
    """Factor to the parallelogram corner + s u + t v, by adaptive quadrature."""
    facing = np.cross(u, v)

    def integrand(t, s):
        to = corner + s * u + t * v - point
        r2 = to @ to
        return max(to @ normal, 0.0) * max(-to @ facing, 0.0) / (np.pi * r2 * r2)

    return integrate.dblquad(integrand, 0, 1, 0, 1, epsabs=tolerance, epsrel=tolerance)[0]


def disc_factor(normal, height, offset, radius):
    """Factor from an element at (offset, 0, 0) to a disc around the axis in the plane y = height."""

    def integrand(phi, r):
        to = np.array([r * np.cos(phi) - offset, height, r * np.sin(phi)])
        r2 = to @ to
        return r * max(to @ normal, 0.0) * abs(height) / (np.pi * r2 * r2)

    return integrate.dblquad(integrand, 0, radius, 0, 2 * np.pi, epsabs=1e-10)[0]


@pytest.mark.parametrize("offset", [0.0, 0.3, 1.0, 2.5])
def test_parallel_disc(offset):
    expected = disc_factor(UP[0], 0.7, offset, 0.9)
    assert cf.element_to_parallel_disc(0.7, offset, 0.9) == pytest.approx(expected, rel=1e-7)


def test_parallel_disc_on_its_axis():
    assert cf.element_to_parallel_disc(2.0, 0.0, 1.5) == pytest.approx(1.5**2 / (2.0**2 + 1.5**2))


@pytest.mark.parametrize("offset", [1.0, 1.4, 3.0])
def test_perpendicular_disc(offset):
    expected = disc_factor(np.array([-1.0, 0.0, 0.0]), 0.7, offset, 0.9)
    assert cf.element_to_perpendicular_disc(0.7, offset, 0.9) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize(("a", "b", "distance"), [(1, 1, 1), (0.2, 3, 0.5), (4, 0.7, 2)])
def test_rectangles(a, b, distance):
    point, z = np.zeros(3), np.array([0.0, 0.0, 1.0])
    parallel = integrated_factor(
        point, z, np.array([0, 0, distance]), np.array([0.0, b, 0]), np.array([a, 0, 0.0])
    )
    assert cf.element_to_parallel_rectangle(a, b, distance) == pytest.approx(parallel, rel=1e-6)
    standing = integrated_factor(
        point, z, np.array([distance, 0, 0]), np.array([0, 0, float(a)]), np.array([0, float(b), 0])
    )
    assert cf.element_to_perpendicular_rectangle(a, b, distance) == pytest.approx(standing, rel=1e-6)


def test_polygon_agrees_with_the_rectangle_forms():
    corner = np.array([[0, 0, 2.0], [0, 0.7, 2], [1.5, 0.7, 2], [1.5, 0, 2]])
    factor = cf.polygon_factor(np.zeros((1, 3)), [[0, 0, 1]], corner)
    assert factor[0] == pytest.approx(cf.element_to_parallel_rectangle(1.5, 0.7, 2.0), rel=1e-12)


def test_polygon_with_the_horizon_across_it():
    """Random attitudes; a third of the pairs have the polygon partly below the horizon."""
    rng = np.random.default_rng(4)
    cut = 0
    for _ in range(24):
        corner, u = rng.normal(size=3) + np.array([0, 0, 1.0]), rng.normal(size=3)
        v = rng.normal(size=3)
        polygon = np.array([corner, corner + u, corner + u + v, corner + v])
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        height = polygon @ normal
        if abs(corner @ np.cross(u, v)) / np.linalg.norm(np.cross(u, v)) < 0.3:
            continue  # nearly edge-on and close: the quadrature, not the formula, gives up
        cut += bool(height.min() < 0 < height.max())
        expected = integrated_factor(np.zeros(3), normal, corner, u, v, tolerance=1e-6)
        found = cf.polygon_factor(np.zeros((1, 3)), normal[None], polygon)[0]
        assert found == pytest.approx(expected, abs=2e-6)
    assert cut >= 5


def test_polygon_sees_nothing_from_behind_or_below():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])  # front towards +z
    points = np.array([[0.5, 0.5, 1], [0.5, 0.5, -1], [0.5, 0.5, 1.0]])
    normals = np.array([[0, 0, -1], [0, 0, 1], [0, 0, 1.0]])
    factor = cf.polygon_factor(points, normals, square)
    assert factor[0] > 0.2
    assert factor[1] == 0
    assert factor[2] == 0


def test_closed_box_of_polygons_gives_the_furnace():
    """From anywhere inside a cube, in any attitude, the six faces' factors add up to 1."""
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.45, 0.45, (200, 3))
    normals = rng.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    floor = np.array([[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5], [0.5, 0.5, -0.5], [-0.5, 0.5, -0.5]])
    ceiling = (floor * [1, 1, -1])[::-1]
    faces = [np.roll(face, axis, axis=1) for face in (floor, ceiling) for axis in range(3)]
    total = sum(cf.polygon_factor(points, normals, face) for face in faces)
    assert total == pytest.approx(np.ones(200), abs=1e-12)


def test_polygon_irradiance_scales_by_pi_and_radiance():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    point, normal = [[0.5, 0.5, 1e-6]], [[0, 0, -1]]
    found = cf.polygon_irradiance(point, normal, square, (1, 2, 3))
    assert found[0] == pytest.approx(np.pi * np.array([1, 2, 3]), rel=1e-4)


def test_point_light_through_a_cube():
    """By Gauss, each face of a cube around the light gets a sixth of its 4 pi I."""

    def irradiance(x, z):
        return cf.point_irradiance([0, 1, 0], [1, 2, 4], [[x, 0, z]], UP)[0, 2]

    flux = integrate.dblquad(irradiance, -1, 1, -1, 1)[0]
    assert flux == pytest.approx(4 * np.pi * 4 / 6, rel=1e-6)


def test_point_light_behind_gives_nothing():
    assert not cf.point_irradiance([0, -1, 0], [1, 1, 1], [[0.2, 0, 0.1]], UP).any()


def test_spot_light_over_a_plane():
    inner, outer, height = 0.3, 0.9, 1.7

    def on_ring(r):
        value = cf.spot_irradiance([0, height, 0], [0, -2, 0], [1, 1, 1], inner, outer, [[r, 0, 0]], UP)
        return 2 * np.pi * r * value[0, 0]

    edges = np.tan([inner, outer]) * height
    flux = integrate.quad(on_ring, 0, edges[1], points=[edges[0]])[0]
    assert flux == pytest.approx(spot_solid_angle(inner, outer), rel=1e-8)
    assert on_ring(edges[1] * 1.001) == 0
    centre = cf.spot_irradiance([0, height, 0], [0, -1, 0], [1, 1, 1], inner, outer, [[0, 0, 0]], UP)
    assert centre[0, 0] == pytest.approx(1 / height**2)


def test_sun_follows_the_cosine_law():
    slant = np.array([[np.sin(0.4), np.cos(0.4), 0], [0, -1, 0]])
    found = cf.sun_irradiance([0, -3, 0], [5, 5, 5], slant)
    assert found[:, 0] == pytest.approx([5 * np.cos(0.4), 0])


def test_enclosures_agree_with_each_other():
    """Direct plus indirect light of a sphere is the mean of any enclosure; so is the furnace's."""
    rho, radius, power = np.array([0.1, 0.5, 0.8]), 1.3, 7.0
    area = 4 * np.pi * radius**2
    direct = power / area
    mean = cf.enclosure_mean(power, area, rho)
    assert direct + cf.sphere_cavity_indirect(power, rho, radius) == pytest.approx(mean)
    assert cf.furnace_irradiance(2.0, rho) == pytest.approx(cf.enclosure_mean(2.0 * np.pi * area, area, rho))


def test_sphere_cavity_by_bounces():
    """Each bounce: every point gets rho times the mean of the last, as dA / 4 pi R^2 is the form factor."""
    light, rho, radius = 3.0, 0.6, 0.7
    bounce, total = light / (4 * np.pi * radius**2), 0.0
    for _ in range(200):
        bounce *= rho
        total += bounce
    assert cf.sphere_cavity_indirect(light, rho, radius) == pytest.approx(total)
