# SPDX-License-Identifier: Apache-2.0
"""Bias of the photon map and of local-linear fits: furnaces, edges, very small surfaces.

Each test of a mean has the null hypothesis that the mean over samples and runs has the expectation stated.
Runs (seeds) are independent, so their own spread gives the standard error; four of those are allowed, by
Student's t with 15 degrees of freedom a false-alarm rate of 1.2e-3 a test. Seeds are fixed: what passes
always passes.
"""

from __future__ import annotations

from functools import cache

import deltalux as dl
import numpy as np
import pytest
from scenes_for_tests import furnace, grey, joined, quad, wall_places
from thoroughness import slow

RUNS = 16
EXACT = np.pi / (1 - 0.5)  # irradiance in the furnace


@cache
def scene():
    return furnace()[0]


@cache
def traced(seed):
    return dl.trace(scene(), paths=20_000, seed=seed, threads=1)


@cache
def places():
    """Samples in the middle of the walls, within 2 cm of one edge, and within 2 cm of a corner."""
    found = {name: dl.Samples(*place) for name, place in wall_places(furnace()[1]).items()}
    assert min(map(len, found.values())) >= 100
    return found


def means(place, estimate):
    """Mean irradiance over a place's samples by seed, in units of the exact one; its error."""
    values = [estimate(traced(seed), places()[place]).irradiance[:, 0].mean() / EXACT for seed in range(RUNS)]
    return np.mean(values), np.std(values, ddof=1) / np.sqrt(RUNS)


def assert_is(found, expected):
    mean, error = found
    assert error < 0.02, "too noisy to say anything"
    assert abs(mean - expected) < 4 * error, f"{mean:.4f} ± {error:.4f}, expected {expected:.4f}"


# ---- interior ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("kernel", ["constant", slow("cone"), "epanechnikov"])
@pytest.mark.parametrize("k", [slow(5), 50])
def test_unbiased_forms_are_unbiased(kernel, k):
    assert_is(means("middle", lambda s, at: dl.estimate.photon_map(s, at, k=k, kernel=kernel)), 1)


@pytest.mark.parametrize("k", [5, 20])
def test_the_plain_form_overestimates(k):
    found = means("middle", lambda s, at: dl.estimate.photon_map(s, at, k=k, unbiased=False))
    assert_is(found, k / (k - 1))
    assert found[0] - 1 > 4 * found[1]  # so that the test above could have failed


def test_epanechnikov_gives_the_farthest_photon_no_weight():
    plain, unbiased = (
        dl.estimate.photon_map(traced(0), places()["middle"], kernel="epanechnikov", unbiased=u).irradiance
        for u in (False, True)
    )
    np.testing.assert_array_equal(plain, unbiased)


@pytest.mark.parametrize("kernel", [slow("constant"), "epanechnikov"])
@pytest.mark.parametrize(("place", "bandwidth"), [slow("middle", None), ("edge", None), ("corner", 0.4)])
def test_local_linear_fits_are_unbiased_up_to_the_corners(kernel, place, bandwidth):
    """In corners with more hits than by default: a fit is noisy there."""

    def estimate(segments, samples):
        return dl.estimate.local_linear(segments, samples, scene(), kernel=kernel, bandwidth=bandwidth)

    assert_is(means(place, estimate), 1)


# ---- edges and corners ------------------------------------------------------------------------------


@pytest.mark.parametrize(("place", "most"), [("edge", 0.85), ("corner", 0.75)])
def test_discs_are_dark_at_edges(place, most):
    """Of a disc at an edge half is behind the wall, of one in a corner three quarters; the neighbouring
    walls lend those of their photons that also come from the front."""
    mean, error = means(place, lambda s, at: dl.estimate.photon_map(s, at))
    assert mean + 4 * error < most
    flat = means(place, lambda s, at: dl.estimate.photon_map(s, at, compression=20))
    assert flat[0] + 4 * flat[1] < mean


@pytest.mark.parametrize("kernel", [slow("constant"), slow("cone"), "epanechnikov"])
@pytest.mark.parametrize("place", ["edge", "corner"])
def test_the_surfaces_area_repairs_edges(place, kernel):
    found = means(
        place, lambda s, at: dl.estimate.photon_map(s, at, kernel=kernel, area="surface", scene=scene())
    )
    assert_is(found, 1)


@pytest.mark.parametrize("compression", [1.0, 4.0])
def test_the_surfaces_area_is_exact(compression):
    """A triangular floor and a ramp that starts at z = 0; light falls straight down, evenly.

    The region's area is what the irradiance divides by. It is compared with a fine sum over the triangles,
    whose error is below 0.3 %.
    """
    floor = quad((-1, 0, -2), (0, 0, 2), (2, 0, 0))
    ramp = quad((-1, 0, 0), (0, 0.5, 1), (2, 0, 0))
    both = dl.Scene(
        [joined(floor, ramp).mesh("floor", "grey", smooth_angle=5)], [grey()],
        [dl.PointLight("bulb", (0, 3, 0))],
    )  # fmt: skip
    rng = np.random.default_rng(4)
    at = rng.uniform(-1, 1, (4000, 2))
    end = np.stack([at[:, 0], np.maximum(0, at[:, 1]) * 0.5, at[:, 1]], axis=1)
    segments = dl.Segments(end + np.array([0, 1, 0]), [(0, -1, 0)] * 4000, [1.0] * 4000, 1.0)
    points = np.array([(0.0, 0, -0.5), (0.9, 0, -0.1), (0.3, 0, 0.0), (0.99, 0, -0.99)])
    samples = dl.Samples(points, (0, 1, 0))
    k = 400
    found = dl.estimate.photon_map(
        segments, samples, k=k, area="surface", scene=both, compression=compression
    ).irradiance[:, 0]
    step = 1 / 512
    u, v = np.meshgrid(np.arange(-1, 1, step) + step / 2, np.arange(-2, 1, step) + step / 2)
    surface = np.stack([u, np.maximum(0, v) * 0.5, v], axis=-1).reshape(-1, 3)
    area = step**2 * np.where(surface[:, 2] > 0, np.sqrt(1.25), 1)

    def distance(where, point):
        gap = where - point
        return np.sqrt((gap**2).sum(axis=1) + (compression**2 - 1) * gap[:, 1] ** 2)

    for i, point in enumerate(points):
        radius = np.sort(distance(end, point))[k - 1]
        inside = area[distance(surface, point) < radius].sum()
        np.testing.assert_allclose(found[i], (k - 1) / inside, rtol=3e-3)


# ---- very small surfaces ------------------------------------------------------------------------------

PLATE = 0.04  # metres


@cache
def with_plate():
    """The furnace with a small plate of its own material in the middle: the irradiance is the same."""
    glowing = dl.Material("glowing", (0.5,) * 3, (1.0,) * 3, "walls", two_sided=True)
    plate = quad((-PLATE / 2, 0, -PLATE / 2), (0, 0, PLATE), (PLATE, 0, 0))
    return dl.Scene([furnace()[1].mesh("walls", "glowing"), plate.mesh("plate", "glowing")], [glowing])


@pytest.mark.slow
def test_very_small_surfaces():
    """Too few photons on a plate of 4 cm (paper 1.2): k nearest reach for the walls, a metre away.

    Its own irradiance is that of the walls. Discs that segments cross (DETP) find it, and local-linear fits.
    """
    plate = dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=0.1)
    values = {"map": [], "surface": [], "disc": [], "linear": []}
    runs = 2 * RUNS  # local-linear fits vary by two thirds
    for seed in range(runs):
        segments = dl.trace(with_plate(), paths=20_000, seed=seed, threads=1)
        values["map"].append(dl.estimate.photon_map(segments, plate, k=50))
        values["surface"].append(
            dl.estimate.photon_map(segments, plate, k=50, area="surface", scene=with_plate())
        )
        lifted = dl.Samples([(0, 1e-3, 0)], [(0, 1, 0)], radius=0.1)
        values["disc"].append(dl.estimate.disc_index(segments, lifted, segment_end="first"))
        values["linear"].append(dl.estimate.local_linear(segments, plate, with_plate()))
    ratio = {name: np.array([e.irradiance[0, 0] for e in found]) / EXACT for name, found in values.items()}
    mean = {name: found.mean() for name, found in ratio.items()}
    error = {name: found.std(ddof=1) / np.sqrt(runs) for name, found in ratio.items()}
    assert mean["map"] + 4 * error["map"] < 0.1
    for name in ("surface", "disc", "linear"):
        assert error[name] < 0.15
        assert abs(mean[name] - 1) < 4 * error[name], f"{name}: {mean[name]:.3f} ± {error[name]:.3f}"
