# SPDX-License-Identifier: Apache-2.0
"""A small room with a lamp and a bulb against Mitsuba 3 and Radiance, before and after a move.

Both are run here. Larger scenes are compared with answers that are stored (`test_office_accuracy.py`), and in
benchmarks/peers.
"""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene import Material, Scene
from oracles import mitsuba_reference, radiance_reference, world
from rooms import box, translation
from test_oracles import CORNERS, FACES, GREY, quad, strata

MOVED = (0.0, 0.0, 0.35)  # metres
PATCH = [(0.3, 0.98, 0.3), (0.7, 0.98, 0.3), (0.7, 0.98, 0.7), (0.3, 0.98, 0.7)]  # faces down


def small_room() -> Scene:
    """A cube of 1 m with a lamp, a bulb, and a block in a corner."""
    faces = [quad(name, CORNERS[list(index)], "grey") for name, index in FACES.items()]
    lamp = Material("lamp", (0, 0, 0), (5, 4, 3), two_sided=True)
    block = dl.Mesh("block", *box((0.3, 0.3, 0.3)), "grey", pose=translation(0.25, 0.2, 0.3), movable=True)
    bulb = dl.PointLight("bulb", (0.75, 0.5, 0.8), (0.3, 0.3, 0.3))
    return Scene([*faces, quad("lamp", PATCH, "lamp"), block], [GREY, lamp], [bulb])


def by_mitsuba(scene, points, normals):
    renderer = mitsuba_reference.Renderer(scene, variant=mitsuba_reference.SCALAR)
    return renderer.irradiance(points, normals, 256, passes=32)


def by_radiance(scene, points, normals):
    settings = radiance_reference.Settings(ad=4)
    return radiance_reference.Renderer(scene).irradiance(points, normals, settings, passes=32)


FILM = dl.PaneSurface(coverage=0.5, transmission=0)
GLASS = dl.PaneSurface(index=1.5, faces=2)


@pytest.mark.parametrize("surface", [pytest.param(FILM, id="film"), pytest.param(GLASS, id="glass")])
def test_panes(surface):
    """The room without its bulb, which Mitsuba's glass would hide, and with a shelf and a partition.

    Null hypothesis: equal means of the walls' points, within 4 standard errors and 1 %, which is for what
    Mitsuba's glass says of both polarisations; rate 2e-4. The same for points, within 6 and 4 %.
    """
    room = small_room()
    sheets = [
        quad(
            "shelf",
            np.array([(0.05, 0.6, 0.05), (0.05, 0.6, 0.95), (0.95, 0.6, 0.95), (0.95, 0.6, 0.05)]),
            "p",
        ),
        quad(
            "partition",
            np.array([(0.5, 0.05, 0.1), (0.5, 0.05, 0.9), (0.5, 0.55, 0.9), (0.5, 0.55, 0.1)]),
            "p",
        ),
    ]
    pane = Material("p", (0.7, 0.7, 0.7) if surface is FILM else (0, 0, 0), surface=surface)
    scene = Scene([*room.meshes, *sheets], [*room.materials, pane])
    points, normals = strata(4)
    with dl.Session(scene, dl.Samples(points, normals), paths=300_000, gather=512, seed=1) as session:
        session.bake()
        irradiance, own = session.irradiance, session.standard_error
    other = by_mitsuba(scene, points, normals)
    noise = np.hypot(own, other.standard_error)
    mean = other.mean.mean(axis=0)
    assert (np.abs(irradiance - other.mean) <= 6 * noise + 0.04 * mean).all()
    together = np.sqrt((noise**2).mean(axis=0) / len(points))
    assert (np.abs((irradiance - other.mean).mean(axis=0)) <= 4 * together + 0.01 * mean).all()
    assert (together < 0.025 * mean).all()


@pytest.fixture(scope="module")
def light():
    """Points and normals; by state, irradiance and its standard error of a session that is updated."""
    scene = small_room()
    points, normals = strata(4)
    found = {}
    with dl.Session(scene, dl.Samples(points, normals), paths=200_000, gather=512, seed=1) as session:
        session.bake()
        found["before"] = session.irradiance, session.standard_error
        session.move("block", world.moved(scene, "block", MOVED).mesh("block").pose)
        session.update()
        found["after"] = session.irradiance, session.standard_error
    return points, normals, found


@pytest.mark.parametrize("state", ["before", "after"])
@pytest.mark.parametrize("renderer", [by_mitsuba, by_radiance])
def test_a_small_room(light, renderer, state):
    """Null hypothesis: equal expectations, of 96 points and three channels, and of their means.

    Points within 6 standard errors and 1 % of the mean, which is for the joints of the walls that the
    renderers' offsets shift; Student's t with 31 degrees of freedom, rate 4e-4. Means within 4 standard
    errors and 1 %: rate 2e-4.
    """
    points, normals, found = light
    scene = small_room()
    scene = world.moved(scene, "block", MOVED) if state == "after" else scene
    other = renderer(scene, points, normals)
    irradiance, own = found[state]
    difference = irradiance - other.mean
    noise = np.hypot(own, other.standard_error)
    allowed = 0.01 * other.mean.mean(axis=0)
    assert (np.abs(difference) <= 6 * noise + allowed).all()
    together = np.sqrt((noise**2).mean(axis=0) / len(points))
    assert (np.abs(difference.mean(axis=0)) <= 4 * together + allowed).all()
    assert (together < 0.025 * other.mean.mean(axis=0)).all()
