# SPDX-License-Identifier: Apache-2.0
"""Lights added to a scene: their light in closed form, their names, and a place that the program chooses."""

import math

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene import Material, Mesh, Scene, with_lamp, with_sun
from deltalux.scene.adding import NO_LIGHT
from deltalux.solid_places import open_place

QUADS = [[0, 1, 2], [0, 2, 3]]


def box(name, low, high, *, inwards=False, open_top=False):
    """A box of twelve triangles, whose fronts look outwards unless `inwards`."""
    (a, b, c), (d, e, f) = low, high
    corners = np.array([[x, y, z] for x in (a, d) for y in (b, e) for z in (c, f)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    sides = [s for s in sides if not (open_top and s == (2, 3, 7, 6))]
    triangles = np.array([[s[i] for i in t] for s in sides for t in QUADS])
    return Mesh(name, corners, triangles[:, ::-1] if inwards else triangles, "grey")


def scene_of(*meshes, unit="lux"):
    return Scene(meshes, [Material("grey", (0.5, 0.5, 0.5))], unit=unit, warnings=[NO_LIGHT, "another"])


def floor_light(scene, places):
    floor = dl.Samples(places, [(0, 1, 0)])
    with dl.Session(scene, floor, paths=20_000, seed=3, max_bounces=1, direct="sampled") as session:
        session.bake()
        return session.irradiance[:, 0]


FLOOR = box("floor", (-2, -0.1, -2), (2, 0, 2))


def test_light_of_a_lamp_of_known_power():
    lit = with_lamp(scene_of(FLOOR), (0, 2, 0), 1000)
    found = floor_light(lit, [(0, 0, 0), (1.5, 0, 0)])
    down = 2 / np.hypot(2, [0, 1.5])
    expected = 1000 / (4 * math.pi) * down / (2**2 + np.square([0, 1.5]))
    assert found == pytest.approx(expected, rel=1e-3)


def test_light_of_the_sun():
    lit = with_sun(scene_of(FLOOR), 90, 30, 50_000)
    assert floor_light(lit, [(0, 0, 0)]) == pytest.approx(25_000, rel=1e-3)
    assert lit.lights[0].direction == pytest.approx((-math.cos(math.pi / 6), -0.5, 0))
    assert with_sun(lit, 0, 0).lights[1].direction == pytest.approx((0, 0, -1))


def test_usual_brightness():
    lamp = with_lamp(scene_of(FLOOR), (0, 2, 0)).lights[0]
    assert lamp.power() == pytest.approx(300 * 16 / 0.5)  # 300 lx on 4 m x 4 m, half of the light arriving
    watts = scene_of(FLOOR, unit="W/m2")
    assert with_lamp(watts, (0, 2, 0)).lights[0].power() == pytest.approx(1 * 16 / 0.5)
    assert with_sun(watts, 0, 45).lights[0].irradiance == pytest.approx(800)


def test_names_are_free_and_the_warning_goes():
    scene = scene_of(FLOOR)
    for _ in range(3):
        scene = with_lamp(scene, (0, 2, 0))
    scene = with_sun(with_sun(scene, 0, 45), 90, 45)
    assert [light.name for light in scene.lights] == ["lamp", "lamp 2", "lamp 3", "sun", "sun 2"]
    assert scene.warnings == ("another",)
    assert len(scene.groups) == 5


@pytest.mark.parametrize("power", [-1, math.nan, math.inf])
def test_powers_that_no_lamp_has(power):
    with pytest.raises(dl.OptionError, match="lamp: found a power of"):
        with_lamp(scene_of(FLOOR), (0, 2, 0), power)


@pytest.mark.parametrize(
    "values", [(math.nan, 0, 1), (0, 91, 1), (0, math.nan, 1), (0, 0, -1), (0, 0, math.inf)]
)
def test_suns_that_there_are_not(values):
    with pytest.raises(dl.OptionError, match="sun: found azimuth"):
        with_sun(scene_of(FLOOR), *values)


@pytest.mark.parametrize("inwards", [True, False])
def test_the_place_is_high_in_the_widest_room(inwards):
    """Whichever way the walls of the hall look."""
    hall = box("hall", (0, 0, 0), (8, 3, 6), inwards=inwards)
    closet = box("closet", (8.2, 0, 0), (9.4, 3, 6), inwards=inwards)
    cupboard = box("cupboard", (3.5, 0, 2.5), (4.5, 2.9, 3.5))  # in the middle
    place = open_place(scene_of(hall, closet, cupboard))
    assert ((place > (0.5, 1.5, 0.5)) & (place < (7.5, 2.8, 5.5))).all()
    assert not ((place > (3.5, 0, 2.5)) & (place < (4.5, 2.9, 3.5))).all()


def test_the_place_in_a_room_without_a_ceiling_is_inside():
    place = open_place(scene_of(box("room", (0, 0, 0), (5, 3, 4), inwards=True, open_top=True)))
    assert ((place > (1, 1.5, 1)) & (place < (4, 3, 3))).all()


def test_the_place_beside_a_solid_thing_is_above_it():
    statue = box("statue", (0, 0, 0), (1, 2, 1))
    assert open_place(scene_of(statue))[1] > 2
    assert np.isfinite(open_place(scene_of())).all()


def test_a_narrow_gap_is_no_place():
    plates = box("one", (0, 0, 0), (2, 2, 0.01)), box("two", (0, 0, 0.05), (2, 2, 0.06))
    assert open_place(scene_of(*plates))[1] > 2


def test_pillars_far_apart_enclose_nothing():
    pillars = box("one", (0, 0, 0), (0.2, 2, 0.2)), box("two", (4.8, 0, 4.8), (5, 2, 5))
    assert open_place(scene_of(*pillars))[1] > 2
