# SPDX-License-Identifier: Apache-2.0
"""Local-linear fits on exact densities and at their limits; tests/contract has their slow reference."""

from __future__ import annotations

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


# ---- limits ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def in_furnace():
    scene, walls = furnace()
    return scene, dl.trace(scene, paths=5000, seed=1), walls.samples(300, seed=2)


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
