# SPDX-License-Identifier: Apache-2.0
"""Every group has paths enough to be seen alone, and what no path reached says so."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import box, translation
from thoroughness import slow

DIRECT = pytest.mark.parametrize("direct", ["auto", "paths", "sampled"])
PLACES = [(x, 0, z) for x in (-1.5, -0.5, 0.5, 1.5) for z in (-1, 0, 1)]
LAMP = dl.Mesh("lamp", *box((0.2, 0.2, 0.2)), "glow", pose=translation(0, 1.2, 0), movable=True)


def dark_room(*more: dl.Mesh) -> dl.Scene:
    """A closed room whose only light has no power, and names the group that lamps may join."""
    stool = dl.Mesh("stool", *box((0.2, 0.2, 0.2)), "wall", pose=translation(1.5, 0.5, 1), movable=True)
    return dl.Scene(
        [dl.Mesh("walls", *box((4, 2, 3), (0, 1, 0), inward=True), "wall"), stool, *more],
        [dl.Material("wall", (0.6,) * 3), dl.Material("glow", emission=(10,) * 3, group="desk")],
        [dl.PointLight("off", (0, 1.9, 0), (0, 0, 0), group="desk")],
    )


@DIRECT
def test_a_lamp_added_in_the_dark_is_as_good_as_one_baked(direct):
    samples = dl.Samples(PLACES, [(0, 1, 0)], radius=0.2)
    options = {"paths": 50_000, "direct": direct}
    with (
        dl.Session(dark_room(LAMP), samples, **options) as baked,
        dl.Session(dark_room(), samples, **options) as added,
    ):
        baked.bake()
        added.bake()
        assert (added.irradiance == 0).all()
        added.add(LAMP)
        added.update()
        assert added.statistics["paths"] == baked.statistics["paths"]
        error = np.hypot(baked.standard_error, added.standard_error)
        # Twelve places, of two independent estimates at most: beyond 5 of their errors once in 1e4.
        assert (np.abs(added.irradiance - baked.irradiance) <= 5 * 1.3 * error + 1e-12).all()
        digest = added.digest()
        added.recompute()
        assert added.digest() == digest


@DIRECT
def test_adding_in_the_dark_survives_saving(direct, tmp_path):
    samples = dl.Samples(PLACES, [(0, 1, 0)], radius=0.2)
    with dl.Session(dark_room(), samples, paths=2000, direct=direct) as session:
        session.bake()
        session.add(LAMP)
        session.update()
        session.add(dl.Mesh("second", *box((0.1,) * 3), "glow", pose=translation(1, 1, 1), movable=True))
        session.update()
        session.save(tmp_path / "lit.dlx")
        with dl.Session.open(tmp_path / "lit.dlx") as opened:
            assert opened.digest() == session.digest()
            for each in (session, opened):
                each.move("lamp", translation(-1, 1, 0.5))
                each.update()
            assert opened.digest() == session.digest()
            opened.recompute()
            assert opened.digest() == session.digest()


def sunlit(sun: float, bulb: float = 80.0) -> dl.Scene:
    floor = dl.Mesh("floor", [(-5, 0, -5), (5, 0, -5), (5, 0, 5), (-5, 0, 5)], [(0, 2, 1), (0, 3, 2)], "w")
    wall = dl.Mesh("wall", [(-5, 0, -5), (5, 0, -5), (5, 3, -5), (-5, 3, -5)], [(0, 1, 2), (0, 2, 3)], "w")
    lights = [dl.PointLight("bulb", (0, 1.9, 0), (bulb,) * 3)]
    if sun:
        lights.append(dl.SunLight("sun", (0, -1, -0.1), (sun,) * 3))
    return dl.Scene([floor, wall], [dl.Material("w", (0.6,) * 3)], lights, unit="lux")


@pytest.mark.parametrize("direct", ["auto", "paths"])
@pytest.mark.parametrize("sun", [slow(1e3), 1e5])
def test_a_bulb_is_right_once_the_sun_is_dimmed(sun, direct):
    points = [(x, 1.0, -4.99) for x in (-3, -2, -1, 0, 1, 2, 3)] + [(x, 0, 0) for x in (-2, 2, 3)]
    samples = dl.Samples(points, [(0, 0, 1)] * 7 + [(0, 1, 0)] * 3, radius=0.25)
    with dl.Session(sunlit(0), samples, paths=200_000, direct=direct) as alone:
        alone.bake()
        expected, own = alone.irradiance[:, 0], alone.standard_error[:, 0]
    with dl.Session(sunlit(sun), samples, paths=200_000, direct=direct) as session:
        session.bake()
        session.dim("sun", 0)
        session.update()
        found, error = session.irradiance[:, 0], session.standard_error[:, 0]
        paths = {light["group"]: light["paths"] for light in session.statistics["lights"]}
    assert min(paths.values()) >= 200_000 * 0.25 / 2
    z = (found - expected) / np.hypot(error, own)
    assert np.sqrt(np.mean(z**2)) < 2.5  # ten places; each variance is from 8 batches
    assert np.sqrt(np.mean((found / expected - 1) ** 2)) < 0.3


def test_what_no_path_reached_has_an_error_and_is_counted():
    """A closed box within the room: no light, and no proof that none can come."""
    room = dark_room(LAMP)
    safe = dl.Mesh("safe", *box((0.4, 0.4, 0.4), (-1.5, 0.5, 1)), "wall")
    scene = dl.Scene([*room.meshes, safe], room.materials, room.lights)
    samples = dl.Samples([(-1.5, 0.31, 1), (0.5, 0, 0)], [(0, 1, 0)], radius=0.05)
    with dl.Session(scene, samples, paths=50_000, direct="paths", gather="off") as session:
        session.bake()
        assert (session.irradiance[0] == 0).all()
        emitted = np.asarray(session.energy["emitted"]) * session.energy["quantum"]
        one_path = emitted / 50_000 / session._core.areas()[0]
        np.testing.assert_allclose(session.standard_error[0], one_path, rtol=1e-3)
        assert session.unreached == 1
        session.dim("desk", 0)
        session.update()
        assert (session.standard_error == 0).all()


def test_black_surfaces_scatter_nothing():
    """Direct light by shadow rays alone: exact, and no path could add anything."""
    scene = dl.Scene(
        [dl.Mesh("walls", *box((4, 2, 3), (0, 1, 0), inward=True), "black")],
        [dl.Material("black", (0, 0, 0))],
        [dl.PointLight("bulb", (0, 1.5, 0), (1, 1, 1))],
    )
    with dl.Session(scene, dl.Samples([(0, 0, 0)], [(0, 1, 0)]), paths=1000, direct="sampled") as session:
        session.bake()
        assert session.irradiance[0, 0] == pytest.approx(1 / 1.5**2, rel=1e-6)
        assert (session.standard_error == 0).all()
