# SPDX-License-Identifier: Apache-2.0
"""The closed forms agree with numerical integration, and the other renderers with the closed forms."""

import numpy as np
import pytest
from deltalux.scene import Material, Mesh, Scene
from deltalux.scene.lights import PointLight, SpotLight, SunLight, spot_solid_angle
from oracles import closed_forms as cf
from oracles import metrics, mitsuba_reference, radiance_reference, world
from scipy import integrate
from thoroughness import slow

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


# The other renderers, held to the closed forms.

BLACK = Material("black", (0, 0, 0))
GREY = Material("grey", (0.8, 0.5, 0.2))
CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
FACES = {
    "floor": (0, 1, 5, 4), "ceiling": (2, 6, 7, 3), "left": (0, 2, 3, 1),
    "right": (4, 5, 7, 6), "back": (0, 4, 6, 2), "front": (1, 3, 7, 5),
}  # fmt: skip


def quad(name, corners, material):
    return Mesh(name, np.asarray(corners, float), [[0, 1, 2], [0, 2, 3]], material=material)


def cube(*lights, **materials):
    """A unit cube, seen from inside, of GREY faces; those named get another material."""
    used = {m.name: m for m in (GREY, *materials.values())}
    faces = [
        quad(name, CORNERS[list(index)], materials.get(name, GREY).name) for name, index in FACES.items()
    ]
    return Scene(faces, used.values(), lights)


def over_black_floor(*lights, lamp=None):
    floor = quad("floor", [(-5, 0, -5), (-5, 0, 5), (5, 0, 5), (5, 0, -5)], "black")
    if lamp is None:
        return Scene([floor], [BLACK], lights)
    return Scene([floor, quad("lamp", LAMP, "lamp")], [BLACK, lamp], lights)


LAMP = np.array([(0, 1, 0), (1, 1.3, 0), (1, 1.3, 1), (0, 1, 1.0)])  # front downwards, slanting
_rng = np.random.default_rng(3)
FLOOR_POINTS = np.c_[_rng.uniform(-2, 2, 60), np.full(60, 1e-4), _rng.uniform(-2, 2, 60)]
FLOOR_NORMALS = np.repeat(UP, 60, axis=0)


def made(scene, variant=mitsuba_reference.SCALAR):
    try:
        return mitsuba_reference.Renderer(scene, variant=variant)
    except mitsuba_reference.Unavailable as reason:
        pytest.skip(str(reason))


def mitsuba(scene, points, normals, samples=256, passes=16):
    return made(scene).irradiance(points, normals, samples, passes=passes)


def mitsuba_by_llvm(scene, points, normals, samples=256, passes=16):
    """More paths in the same time, and what the stored references are made with."""
    return made(scene, mitsuba_reference.LLVM).irradiance(points, normals, samples, passes=passes)


def radiance(scene, points, normals, samples=256, passes=16):
    """Of Radiance's samples per pass each is split again at every bounce."""
    try:
        renderer = radiance_reference.Renderer(scene)
    except radiance_reference.Unavailable as reason:
        pytest.skip(str(reason))
    settings = radiance_reference.Settings(ad=max(samples // passes, 4))
    return renderer.irradiance(points, normals, settings, passes=passes)


every_renderer = pytest.mark.parametrize("renderer", [mitsuba, slow(mitsuba_by_llvm), radiance])


@every_renderer
def test_renderers_on_lights_without_extent(renderer):
    """Radiance has a sphere of 0.1 mm for a point: seen from 1.5 m its place varies by 0.013 %."""
    spot = SpotLight("spot", (0.3, 1.5, 0), (0.2, -1, 0.1), (1, 2, 3), 0.2, 0.8)
    bulb = PointLight("bulb", (-0.4, 2.0, 0.7), (3, 2, 1))
    sun = SunLight("sun", (0.3, -1.5, 0), (1, 2, 3))
    cone = (spot.position, spot.direction, spot.intensity, spot.inner_angle, spot.outer_angle)
    expected = {
        spot: cf.spot_irradiance(*cone, FLOOR_POINTS, FLOOR_NORMALS),
        bulb: cf.point_irradiance(bulb.position, bulb.intensity, FLOOR_POINTS, FLOOR_NORMALS),
        sun: cf.sun_irradiance(sun.direction, sun.irradiance, FLOOR_NORMALS),
    }
    for light, irradiance in expected.items():
        found = renderer(over_black_floor(light), FLOOR_POINTS, FLOOR_NORMALS, 8, 2)
        assert found.mean == pytest.approx(irradiance, rel=2e-3, abs=1e-3)


@every_renderer
@pytest.mark.parametrize("two_sided", [False, True])
def test_renderers_on_a_lamp(renderer, two_sided):
    """Both sides of the lamp; each point within 5 standard errors, all together within 4."""
    lamp = Material("lamp", (0, 0, 0), (1, 2, 3), two_sided=two_sided)
    points = np.concatenate([FLOOR_POINTS, FLOOR_POINTS + 2 * UP])
    normals = np.concatenate([FLOOR_NORMALS, -FLOOR_NORMALS])
    found = renderer(over_black_floor(lamp=lamp), points, normals, passes=64)
    expected = cf.polygon_irradiance(points, normals, LAMP, lamp.emission)
    if two_sided:
        expected += cf.polygon_irradiance(points, normals, LAMP[::-1], lamp.emission)
    assert (expected[60:] > 0).any() == two_sided
    assert_unbiased(found, expected)


def assert_unbiased(found, expected):
    error = found.mean - expected
    assert (np.abs(error) <= 5 * found.standard_error + 1e-6).all()
    together = np.sqrt((found.standard_error**2).sum(axis=0))
    assert (np.abs(error.sum(axis=0)) <= 4 * together + 1e-6).all()


@pytest.mark.parametrize(("renderer", "samples"), [(mitsuba, 64), slow(mitsuba_by_llvm, 512), (radiance, 16)])
def test_renderers_keep_the_energy_of_a_cube(renderer, samples):
    """Many bounces, three reflectances, a punctual light: area mean within 4 standard errors and 0.1 %."""
    scene = cube(PointLight("bulb", (0.3, 0.6, 0.5), (1, 1, 1)))
    points, normals = strata(16)
    found = renderer(scene, points, normals, samples, 4)
    expected = cf.enclosure_mean(4 * np.pi, 6.0, GREY.reflectance)
    mean = found.mean.mean(axis=0)
    noise = np.sqrt((found.standard_error**2).mean(axis=0) / len(points))
    assert (np.abs(mean - expected) <= 4 * noise + 1e-3 * expected).all()
    assert (noise < 3e-3 * expected).all()


def strata(n):
    """The centres of n x n squares on each face of the cube, a little before it."""
    at = (np.arange(n) + 0.5) / n
    u, v = (a.ravel() for a in np.meshgrid(at, at))
    points, normals = [], []
    for axis in range(3):
        for side, sign in ((0.0, 1.0), (1.0, -1.0)):
            block = np.full((n * n, 3), side + sign * 1e-4)
            block[:, (axis + 1) % 3], block[:, (axis + 2) % 3] = u, v
            points.append(block)
            normals.append(np.repeat(sign * np.eye(3)[axis : axis + 1], n * n, axis=0))
    return np.concatenate(points), np.concatenate(normals)


@pytest.mark.parametrize(("renderer", "samples"), [(mitsuba, 128), slow(mitsuba_by_llvm, 1024)])
def test_mitsuba_on_the_furnace(renderer, samples):
    """Lamps that reflect, everywhere: E = pi L at every point, corners included."""
    glow = Material("glow", (0.8, 0.5, 0.2), (1, 2, 3))
    found = renderer(cube(**dict.fromkeys(FACES, glow)), *strata(6), samples=samples, passes=64)
    assert_unbiased(found, np.broadcast_to(cf.furnace_irradiance(glow.emission, glow.reflectance), (216, 3)))


@pytest.mark.parametrize(("renderer", "samples"), [(mitsuba, 64), slow(mitsuba_by_llvm, 1024)])
def test_renderers_agree_on_a_lamp_that_reflects(renderer, samples):
    """Radiance's lamps do not reflect; their share is given back through their emission.

    Null hypothesis: equal area means. Radiance's random numbers have no seed; over a hundred runs its
    means had standard deviations of 0.23, 0.18 and 0.11 %, those of four runs half of it; Mitsuba tells its
    own. Six of them: false alarm below one in a million.
    """
    lamp = Material("lamp", (0.9, 0.9, 0.9), (5, 5, 5))
    scene = cube()
    patch = quad("lamp", [(0.3, 0.999, 0.3), (0.7, 0.999, 0.3), (0.7, 0.999, 0.7), (0.3, 0.999, 0.7)], "lamp")
    scene = Scene([*scene.meshes, patch], [*scene.materials, lamp])
    points, normals = strata(8)
    other = renderer(scene, points, normals, samples)
    expected = other.mean.mean(axis=0)
    noise = np.sqrt((other.standard_error**2).mean(axis=0) / len(points)) / expected
    runs = [radiance(scene, points, normals, 16, 4).mean.mean(axis=0) for _ in range(4)]
    ratio = np.mean(runs, axis=0) / expected
    spread = np.hypot(np.array([0.0023, 0.0018, 0.0011]) / np.sqrt(len(runs)), noise)
    assert (np.abs(ratio - 1) < 6 * spread).all()  # without it 0.91, 0.97, 0.99


@pytest.mark.parametrize(
    ("variant", "samples"), [(mitsuba_reference.SCALAR, 64), slow(mitsuba_reference.LLVM, 256)]
)
def test_change_needs_few_samples(variant, samples):
    """Equal seeds: moving a small block changes most points not at all, to the bit."""
    room = cube(PointLight("bulb", (0.5, 0.8, 0.5), (1, 1, 1)))
    block = Mesh("block", CORNERS * 0.3 + [0.1, 0.001, 0.1], [
        t for i in FACES.values() for t in ((i[0], i[2], i[1]), (i[0], i[3], i[2]))
    ], material="grey", movable=True)  # fmt: skip
    before = room.with_mesh(block)
    after = world.moved(before, "block", (0.0, 0.0, 0.5))
    points, normals = strata(4)
    pair = [made(s, variant) for s in (before, after)]
    found = mitsuba_reference.change(*pair, points, normals, samples)
    apart = np.sqrt(sum(r.irradiance(points, normals, samples).standard_error ** 2 for r in pair))
    assert found.standard_error.mean() < 0.5 * apart.mean()
    assert found.mean.min() < -1  # a new shadow
    assert found.mean.max() > 1  # and an old one gone


def test_points_over_an_area_are_uniform_and_extend():
    scene = over_black_floor(lamp=Material("lamp", (0, 0, 0), (1, 1, 1)))
    points, normals = world.area_points(scene, 20000, seed=5)
    on_floor = points[:, 1] < 0.5
    share = 100 / (100 + np.linalg.norm(np.cross(LAMP[1] - LAMP[0], LAMP[3] - LAMP[0])))
    assert on_floor.mean() == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / 20000))
    assert (normals[on_floor] == UP).all()
    assert points[on_floor][:, 1] == pytest.approx(1e-4)
    assert points[on_floor][:, [0, 2]].mean(axis=0) == pytest.approx([0, 0], abs=0.1)
    fewer, _ = world.area_points(scene, 700, seed=5)
    assert (fewer == points[:700]).all()


def test_lamp_triangles_become_rectangles():
    square = CORNERS[list(FACES["floor"])]
    triangles = np.stack([square[[0, 1, 2]], square[[0, 2, 3]], square[[0, 1, 2]] + 2])
    faces = radiance_reference.merge_triangles(triangles)
    assert [len(face) for face in faces] == [4, 3]
    area = 0.5 * np.cross(faces[0][2] - faces[0][0], faces[0][3] - faces[0][1])
    assert area == pytest.approx([0, 1, 0])


# What the benchmark does with them.


def test_errors_do_not_count_the_reference_s_noise():
    rng = np.random.default_rng(2)
    truth = np.repeat(rng.uniform(0.5, 1.5, (4000, 1)), 3, axis=1)
    noise = np.full_like(truth, 0.04)
    reference = truth + 0.04 * rng.normal(size=truth.shape)
    assert metrics.relative_error(truth, reference, noise) == pytest.approx(0, abs=0.01)
    assert metrics.relative_error(truth, reference, 0 * noise) > 0.035
    assert metrics.relative_error(1.1 * reference, reference, 0 * noise) == pytest.approx(0.1)
    assert metrics.change_error(1.1 * reference, reference, 0 * noise) == pytest.approx(0.1)


def test_dark_points_count_against_a_tenth_of_the_mean():
    reference = np.ones((10, 3))
    reference[0] = 0
    found = reference.copy()
    found[0] = 0.09
    expected = np.sqrt((0.09 / (0.1 * 0.9)) ** 2 / 10)
    assert metrics.relative_error(found, reference, 0 * reference) == pytest.approx(expected)


def test_seconds_to_an_error():
    runs = [metrics.Run("", seconds, error) for seconds, error in ((1, 0.2), (4, 0.1), (9, 0.3), (16, 0.05))]
    assert metrics.seconds_to(0.1, runs) == pytest.approx(4)
    assert metrics.seconds_to(0.1 / np.sqrt(2), runs) == pytest.approx(8)  # error halves as time fourfolds
    assert metrics.seconds_to(0.5, runs) == 1
    assert metrics.seconds_to(0.025, runs) == pytest.approx(64)
    assert metrics.seconds_to(0.01, runs) is None
    assert metrics.seconds_to(0.1, []) is None
