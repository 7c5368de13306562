# SPDX-License-Identifier: Apache-2.0
"""Local-linear fits against a slow reference, on exact densities, and at their limits."""

from __future__ import annotations

from copy import copy

import deltalux as dl
import numpy as np
import pytest
from scenes_for_tests import furnace, grey, joined, quad, sphere

BULB = dl.PointLight("bulb", (0, 3, 0))


def rain(points, power, toward=(0.0, -1.0, 0.0)):
    """Parallel flights of 1 m that end at `points`."""
    toward = np.broadcast_to(np.asarray(toward, float), points.shape)
    return dl.Segments(points - toward, toward, np.ones(len(points)), power)


def floor_scene(*shapes):
    return dl.Scene([joined(*shapes).mesh("floor", "grey")], [grey()], [BULB])


SQUARE = quad((-1, 0, -1), (0, 0, 2), (2, 0, 0))


def even(step=0.002):
    """Points of the square at the middles of its cells."""
    at = np.arange(-1, 1, step) + step / 2
    x, z = (a.ravel() for a in np.meshgrid(at, at))
    return np.stack([x, 0 * x, z], axis=1)


# ---- exactness --------------------------------------------------------------------------------------


@pytest.mark.parametrize("kernel", ["epanechnikov", "constant"])
def test_linear_irradiance_comes_out_exactly(kernel):
    """In the middle, at edges and in corners, but for the grain of the hits."""
    points = even()
    irradiance = 1 + 0.3 * points[:, 0] - 0.2 * points[:, 2]
    segments = rain(points, irradiance * 4 / len(points))
    at = np.array([(0, 0, 0), (0.99, 0, 0), (0.99, 0, 0.985), (-0.999, 0, 0.5), (0.9, 0, -0.95), (1, 0, 1)])
    samples = dl.Samples(at, (0, 1, 0))
    found = dl.estimate.local_linear(segments, samples, floor_scene(SQUARE), bandwidth=0.2, kernel=kernel)
    expected = 1 + 0.3 * at[:, 0] - 0.2 * at[:, 2]
    np.testing.assert_allclose(found.irradiance[:, 0], expected, atol=3e-3)


@pytest.mark.parametrize("kernel", ["epanechnikov", "constant"])
def test_equals_the_reference(kernel):
    """An L-shaped floor of six triangles, random hits. The reference takes the kernel's moments from a fine
    grid instead of a closed form, and solves the fit's normal equations by a library."""
    rng = np.random.default_rng(3)
    shape = joined(*(quad((x, 0, z), (0, 0, 1), (1, 0, 0)) for x, z in ((-1, -1), (0, -1), (-1, 0))))

    def on_floor(x, z):
        return (abs(x) < 1) & (abs(z) < 1) & ((x < 0) | (z < 0))

    at = rng.uniform(-1, 1, (4000, 2))
    at = at[on_floor(*at.T)]
    hits = np.stack([at[:, 0], 0 * at[:, 0], at[:, 1]], axis=1)
    power = rng.exponential(1, len(hits))
    where = np.array([(-0.5, -0.5), (0.02, -0.03), (-0.02, 0.9), (0.95, -0.95), (-0.99, -0.99), (0.4, -0.01)])
    samples = dl.Samples(np.stack([where[:, 0], 0 * where[:, 0], where[:, 1]], axis=1), (0, 1, 0))
    width = 0.3
    segments = rain(hits, power)
    found = dl.estimate.local_linear(segments, samples, floor_scene(shape), bandwidth=width, kernel=kernel)
    quadrature = (np.arange(1500) + 0.5) / 750 - 1
    gu, gv = np.meshgrid(quadrature, quadrature)

    def weight(u, v):
        inside = u * u + v * v < 1
        return inside * (1 / np.pi if kernel == "constant" else 2 / np.pi * (1 - u * u - v * v))

    for i, (x, z) in enumerate(where):
        k = weight(gu, gv) * on_floor(x + width * gu, z + width * gv) / 750**2
        basis = np.stack([np.ones_like(gu), gu, gv])
        moments = np.einsum("auv,buv,uv->ab", basis, basis, k)
        fit = np.linalg.solve(moments, (1, 0, 0))
        u, v = ((hits[:, c] - o) / width for c, o in ((0, x), (2, z)))
        expected = (power * weight(u, v) * (fit[0] + fit[1] * u + fit[2] * v)).sum() / width**2
        np.testing.assert_allclose(found.irradiance[i, 0], max(0, expected), rtol=5e-3)


def test_a_smooth_surface_is_one():
    """A sphere of 512 facets in even light: facets differ by their hits' noise only, creases do not show."""
    ball = sphere(8)
    scene = dl.Scene([ball.mesh("ball", "grey")], [grey()], [dl.PointLight("bulb", (0, 0, 0))])
    at, _ = ball.points(60_000, seed=1)
    outward = at / np.linalg.norm(at, axis=1, keepdims=True)
    length = np.linalg.norm(at, axis=1)
    segments = dl.Segments(np.zeros_like(at), outward, length, ball.area / len(at))
    samples = dl.Samples(ball.vertices, -ball.vertices)
    found = dl.estimate.local_linear(segments, samples, scene, bandwidth=0.25).irradiance[:, 0]
    # Null hypothesis: mean 1. A sample has some 900 hits, so means of 258 samples scatter by 0.004 (they
    # share hits: no less than sqrt(1 / 60,000)); the bound is 5 of those, a false-alarm rate of 1e-6.
    assert abs(found.mean() - 1) < 0.02
    assert found.std() < 0.08


def test_surfaces_do_not_mix():
    """A dark shelf 1 cm above a lit floor."""
    shelf = quad((-0.5, 0.01, -0.5), (0, 0, 1), (1, 0, 0))
    points = even(0.01)
    scene = dl.Scene([SQUARE.mesh("floor", "grey"), shelf.mesh("shelf", "grey")], [grey()], [BULB])
    samples = dl.Samples([(0, 0, 0), (0, 0.01, 0)], (0, 1, 0))
    found = dl.estimate.local_linear(rain(points, 1.0), samples, scene, bandwidth=0.2).irradiance[:, 0]
    assert found[0] > 0
    assert found[1] == 0


def test_the_bandwidth_follows_the_hits():
    """100 expected hits in a disc: some 100 are found in the middle of an even floor."""
    rng = np.random.default_rng(0)
    for count in (1000, 16_000):
        hits = np.insert(rng.uniform(-1, 1, (count, 2)), 1, 0, axis=1)
        found = dl.estimate.local_linear(
            rain(hits, 1.0), dl.Samples([(0, 0, 0)], (0, 1, 0)), floor_scene(SQUARE)
        )
        # Null hypothesis: Poisson with mean 100; five standard deviations, a false-alarm rate of 1e-6.
        assert abs(found.stats["hits"] - 100) < 50


# ---- order, threads, limits ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def in_furnace():
    scene, walls = furnace()
    return scene, dl.trace(scene, paths=5000, seed=1), walls.samples(300, seed=2)


def test_order_does_not_matter(in_furnace):
    scene, segments, samples = in_furnace
    rng = np.random.default_rng(5)
    expected = dl.estimate.local_linear(segments, samples, scene).irradiance
    shuffled = segments.select(rng.permutation(len(segments)))
    np.testing.assert_array_equal(dl.estimate.local_linear(shuffled, samples, scene).irradiance, expected)
    order = rng.permutation(len(samples))
    other = copy(samples)
    other.points, other.normals = samples.points[order], samples.normals[order]
    np.testing.assert_array_equal(
        dl.estimate.local_linear(segments, other, scene).irradiance, expected[order]
    )


def test_threads_do_not_matter(in_furnace):
    scene, segments, samples = in_furnace
    one, two, four = (dl.estimate.local_linear(segments, samples, scene, threads=n) for n in (1, 2, 4))
    for other in (two, four):
        np.testing.assert_array_equal(other.irradiance, one.irradiance)
        assert other.stats == one.stats


def test_nothing_gives_nothing(in_furnace):
    scene, segments, samples = in_furnace
    nowhere = dl.Samples(np.zeros((0, 3)), np.zeros((0, 3)))
    for light, at in ((segments.select([]), samples), (segments, nowhere), (segments.select([]), nowhere)):
        found = dl.estimate.local_linear(light, at, scene)
        assert found.irradiance.shape == (len(at), 3)
        assert not found.irradiance.any()


def test_samples_off_all_surfaces_have_nothing(in_furnace):
    scene, segments, _ = in_furnace
    off = dl.Samples([(0, 0, 0), (0, -1, 0), (5, -1, 0)], [(0, 1, 0), (0, -1, 0), (0, 1, 0)])
    assert not dl.estimate.local_linear(segments, off, scene).irradiance.any()


def test_one_hit_spreads_over_its_surface():
    found = dl.estimate.local_linear(
        rain(np.array([(0.1, 0, 0.2)]), 3.0), dl.Samples([(0, 0, 0)], (0, 1, 0)), floor_scene(SQUARE)
    )
    assert np.isfinite(found.irradiance).all()
    np.testing.assert_allclose(found.irradiance[0], 3 / 4, rtol=0.1)


def test_slivers_are_fitted_by_a_constant_across():
    """A strip 2 mm wide under a kernel of 0.2 m."""
    strip = quad((-1, 0, -0.001), (0, 0, 0.002), (2, 0, 0))
    x = np.random.default_rng(1).uniform(-1, 1, 20_000)
    hits = np.stack([x, 0 * x, np.random.default_rng(2).uniform(-0.001, 0.001, len(x))], axis=1)
    samples = dl.Samples([(0, 0, 0), (0.999, 0, 0.0009)], (0, 1, 0))
    found = dl.estimate.local_linear(rain(hits, 0.004 / len(x)), samples, floor_scene(strip), bandwidth=0.2)
    # Null hypothesis: 1. About 2,000 and 1,000 hits: noise of 3 and 8 %; four times that.
    assert (abs(found.irradiance[:, 0] - 1) < (0.12, 0.32)).all()


def test_first_bounce_leaves_direct_light_out(in_furnace):
    scene, segments, samples = in_furnace
    later = segments.select(segments.bounce >= 1)
    for bandwidth in (None, 0.3):
        one = dl.estimate.local_linear(segments, samples, scene, first_bounce=1, bandwidth=bandwidth)
        two = dl.estimate.local_linear(later, samples, scene, bandwidth=bandwidth)
        np.testing.assert_array_equal(one.irradiance, two.irradiance)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"bandwidth": 0}, "bandwidth: found 0"),
        ({"bandwidth": np.nan}, "bandwidth: found nan"),
        ({"kernel": "cone"}, "kernel: found 'cone'"),
        ({"threads": 0}, "threads"),
    ],
)
def test_wrong_options_are_refused(in_furnace, options, words):
    scene, segments, samples = in_furnace
    with pytest.raises(dl.OptionError, match=words):
        dl.estimate.local_linear(segments, samples, scene, **options)


def test_a_scene_is_wanted(in_furnace):
    _, segments, samples = in_furnace
    with pytest.raises(dl.OptionError, match="scene: found None"):
        dl.estimate.local_linear(segments, samples, None)
    with pytest.raises(dl.OptionError, match="no triangle"):
        dl.estimate.local_linear(segments, samples, dl.Scene([], [grey()]))


def test_a_callback_stops_it(in_furnace):
    scene, segments, _ = in_furnace
    many = furnace()[1].samples(300_000, seed=1)
    with pytest.raises(dl.Cancelled):
        dl.estimate.local_linear(segments, many, scene, progress=lambda stage, share: False)
