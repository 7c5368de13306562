# SPDX-License-Identifier: Apache-2.0
"""Lights and directions at the edge of what numbers hold are right, or refused: none is dropped silently."""

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene.lights import MIN_CONE, spot_solid_angle
from deltalux.vectors import versine

HEIGHT = 1.3
FLOOR = dl.Mesh("floor", [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], [(0, 2, 1), (0, 3, 2)], "grey")
CONES = [(0, MIN_CONE), (0.5e-4, 1e-4), (0, 1e-3), (0, 0.3), (0.5, 0.5 + 1e-12)]


def baked(light, points, radius, direct):
    scene = dl.Scene([FLOOR], [dl.Material("grey")], [light])
    session = dl.Session(scene, dl.Samples(points, (0, 1, 0), radius), paths=5000, threads=1, direct=direct)
    session.bake()
    return session


def spot(inner, outer, intensity=(2, 2, 2), direction=(0, -1, 0)):
    return dl.SpotLight("spot", (0, HEIGHT, 0), direction, intensity, inner, outer)


@pytest.mark.parametrize(("inner", "outer"), CONES)
def test_all_light_of_a_narrow_spot_arrives(inner, outer):
    session = baked(spot(inner, outer), [(0, 0, 0)], 0.9, "paths")
    arrived = session.irradiance[0, 0] * np.pi * 0.9**2
    assert arrived == pytest.approx(2 * spot_solid_angle(inner, outer), rel=1e-5)


@pytest.mark.parametrize(("inner", "outer"), CONES)
def test_a_narrow_beam_has_its_falloff(inner, outer):
    across = HEIGHT * np.tan(outer * np.array([0, 0.3, 0.6, 0.9, 1.1, 2]))
    session = baked(spot(inner, outer), [(x, 0, 0) for x in across], 0.01, "sampled")
    angle = np.arctan(across / HEIGHT)
    ramp = [(versine(outer) - versine(a)) / (versine(outer) - versine(inner)) for a in angle]
    expected = 2 * np.clip(ramp, 0, 1) ** 2 * np.cos(angle) ** 3 / HEIGHT**2
    np.testing.assert_allclose(session.irradiance[:, 0], expected, rtol=1e-5, atol=1e-9)


def test_narrower_spots_are_refused():
    text = r'light "spot": found inner angle 0, outer angle 9e-06; expected .* outer from 1e-05 to pi/2'
    with pytest.raises(dl.SceneError, match=text):
        spot(0, 9e-6)


@pytest.mark.parametrize("length", [1e300, 1e-300])
def test_the_length_of_a_direction_does_not_matter(length):
    assert spot(0, 0.3, direction=(0, -length, length)).direction == pytest.approx((0, -(0.5**0.5), 0.5**0.5))


@pytest.mark.parametrize(
    "light",
    [
        dl.PointLight("weak", (0, 1, 0), (1e-46, 0, 0)),
        dl.SpotLight("weak", (0, 1, 0), (0, -1, 0), (1e-300, 1e-300, 1e-300)),
        dl.SunLight("weak", (0, -1, 0), (1e-40, 1e-40, 1e-40)),
        dl.PointLight("strong", (0, 1, 0), (0, 1e31, 0)),
        dl.SpotLight("strong", (0, 1, 0), (0, -1, 0), (1e300, 1, 1)),
        dl.SunLight("strong", (0, -1, 0), (1e37, 1e37, 1e37)),
    ],
)
def test_lights_beyond_single_precision_are_refused(light):
    text = (
        rf'light "{light.name}": intensity: found \[.*\], expected 0, or 1.2e-38 to 1e\+30, .* another unit'
    )
    with pytest.raises(dl.SceneError, match=text):
        dl.Session(dl.Scene([FLOOR], [dl.Material("grey")], [light]))


@pytest.mark.parametrize("emission", [1e-46, 2e30])
def test_surfaces_beyond_single_precision_are_refused(emission):
    odd = dl.Material("grey", emission=(0, emission, 0))
    with pytest.raises(dl.SceneError, match='material "grey": emission: found'):
        dl.Session(dl.Scene([FLOOR], [odd]))


@pytest.mark.parametrize("unit", [1e-37, 1e30])
def test_light_near_the_limits_is_that_of_one(unit):
    """A gather reads, and adds up, what single precision holds of it."""
    found = []
    for strength in (1, unit):
        scene = dl.Scene([FLOOR], [dl.Material("grey")], [dl.PointLight("bulb", (0, 1, 0), (strength,) * 3)])
        with dl.Session(scene, dl.Samples([(0, 0.5, 0)], [(0, -1, 0)]), paths=2000, gather=64) as session:
            session.bake()
            found.append(np.concatenate([session.irradiance, session.standard_error]) / strength)
    assert (found[0][0] > 0).all()
    np.testing.assert_allclose(found[1], found[0], rtol=1e-3)


def test_the_length_of_a_samples_normal_does_not_matter():
    normals = [(0, 1e300, 0), (0, 1e-300, 0), (0, 3, 4), (1e-320, 0, 0)]
    samples = dl.Samples([(0, 0, 0)] * 4, normals)
    np.testing.assert_allclose(samples.normals, [(0, 1, 0), (0, 1, 0), (0, 0.6, 0.8), (1, 0, 0)], atol=1e-15)
