# SPDX-License-Identifier: Apache-2.0
"""The path tracer that finds the pools of narrow spots: closed forms, and Mitsuba's own path tracer."""

import numpy as np
import pytest
from deltalux.scene import Material, Mesh, Scene
from deltalux.scene.lights import SpotLight, spot_solid_angle
from deltalux.scenes.shapes import box, room
from oracles import closed_forms as cf
from oracles import mitsuba_reference, world
from oracles.pool_paths import PoolRenderer

pytestmark = pytest.mark.slow  # the tracer is written for the variant that needs LLVM

PAINT = Material("paint", (0.7, 0.5, 0.3))
LAMP = np.array([(0.3, 0.999, 0.3), (0.7, 0.999, 0.3), (0.7, 0.999, 0.7), (0.3, 0.999, 0.7)])
POWER = 10.0


def spot(degrees):
    """A spot of that full angle; together with its intensity of POWER watts a channel."""
    outer = np.radians(degrees / 2)
    intensity = np.full(3, POWER / spot_solid_angle(0.5 * outer, outer))
    return SpotLight("spot", (0.35, 0.9, 0.6), (0.1, -1, -0.2), intensity, 0.5 * outer, outer)


def scene(*lights, lamp=False, block=False):
    """A cube of 1 m with its corner at the origin."""
    meshes = [room(1, 1, 1, ["paint"] * 6).moved(0.5, 0, 0.5).mesh("walls")]
    if lamp:
        meshes.append(Mesh("lamp", LAMP, [(0, 1, 2), (0, 2, 3)], "lamp"))
    if block:
        meshes.append(box(0.3, 0.4, 0.2, "paint").turned(20).mesh("block", at=(0.6, 1e-3, 0.4)))
    return Scene(meshes, [PAINT, Material("lamp", (0.4, 0.4, 0.4), (5, 7, 9))], lights)


def rendered(kind, where, points, normals, samples, passes):
    try:
        return kind(where).irradiance(points, normals, samples, passes=passes)
    except mitsuba_reference.Unavailable as reason:
        pytest.skip(str(reason))


def test_direct_light_of_spots_and_of_lamps():
    """Black walls: closed forms, each point within 5 standard errors; a spot alone has no noise."""
    points, normals = world.area_points(scene(), 60, 2)
    black = Material("paint", (0, 0, 0))
    light = spot(60)
    dark = Scene(scene().meshes, [black], [light])
    expected = cf.spot_irradiance(
        light.position,
        light.direction,
        light.intensity,
        light.inner_angle,
        light.outer_angle,
        points,
        normals,
    )
    found = rendered(PoolRenderer, dark, points, normals, 16, 2)
    assert found.mean == pytest.approx(expected, rel=1e-3, abs=1e-2)
    lamp = Material("lamp", (0, 0, 0), (5, 7, 9))
    found = rendered(PoolRenderer, Scene(scene(lamp=True).meshes, [black, lamp]), points, normals, 4096, 64)
    lit = cf.polygon_irradiance(points, normals, LAMP, lamp.emission)
    assert (np.abs(found.mean - lit) <= 5 * found.standard_error + 2e-3 * lit.mean()).all()


@pytest.mark.parametrize("degrees", [3, 30])
def test_a_spot_s_light_is_kept(degrees):
    """Mean over the walls, where every surface reflects alike: within 4 standard errors and 0.5 %."""
    walls = scene(spot(degrees))
    points, normals = world.area_points(walls, 3000, 3)
    dark = Scene(walls.meshes, [Material("paint", (0, 0, 0))], walls.lights)
    found = rendered(PoolRenderer, walls, points, normals, 64, 2).mean
    reflected = found - rendered(PoolRenderer, dark, points, normals, 4, 1).mean
    expected = cf.enclosure_mean(POWER, 6.0, PAINT.reflectance) * PAINT.reflectance
    noise = reflected.std(axis=0) / np.sqrt(len(points))
    assert (np.abs(reflected.mean(axis=0) - expected) <= 4 * noise + 5e-3 * expected).all()
    assert (noise < 0.03 * expected).all()


def test_mitsuba_s_path_tracer_agrees():
    """Lamp, wide spot, block: points within 5 standard errors and 1 % of the mean, together within 4.

    The allowance is for points in the slit under the block, where few paths carry all the light.
    """
    where = scene(spot(50), lamp=True, block=True)
    points, normals = world.area_points(where, 80, 4)
    found = rendered(PoolRenderer, where, points, normals, 2048, 32)
    other = rendered(mitsuba_reference.Renderer, where, points, normals, 8192, 32)
    difference = found.mean - other.mean
    apart = np.sqrt(found.standard_error**2 + other.standard_error**2)
    assert (np.abs(difference) <= 5 * apart + 0.01 * other.mean.mean()).all()
    assert (np.abs(difference.sum(axis=0)) <= 4 * np.sqrt((apart**2).sum(axis=0))).all()
    assert found.standard_error.mean() < 1.2 * other.standard_error.mean()
