# SPDX-License-Identifier: Apache-2.0
"""Kinds of lights: what is known of each, and what becomes of one that others do not know."""

from __future__ import annotations

from dataclasses import dataclass

import deltalux as dl
import numpy as np
import pygltflib as gl
import pytest
from deltalux import _core, outputs
from deltalux.outputs.of_session import baked_of
from deltalux.scene import replace_scene
from deltalux.scene.lights import KINDS, Light, PointLight
from rooms import room, samples_in


@dataclass(frozen=True, eq=False, init=False)
class Laser(PointLight):
    """A kind that neither the core nor session files know."""

    kind = "laser"


@dataclass(frozen=True, eq=False, init=False)
class Candle(PointLight):
    """A point light that glTF has no kind for."""

    def gltf(self) -> None:
        """Nothing."""


def with_light(light: Light) -> dl.Scene:
    return replace_scene(room(), lights=[light])


def test_a_light_of_an_unknown_kind_is_refused() -> None:
    scene, known = with_light(Laser("x", (0, 1, 0))), ", ".join(f'"{kind}"' for kind in KINDS)
    with pytest.raises(dl.SceneError, match=f'kind of light: found "laser", expected one of {known}$'):
        dl.Session(scene, samples_in(scene))


def test_the_core_has_every_kind() -> None:
    for kind in KINDS:
        _core.Scene().add_light("x", kind, (0, 0, 0), (0, -1, 0), (1, 1, 1), (), -1, 0)


def test_a_light_says_what_it_has() -> None:
    point = dl.PointLight("p", (1, 2, 3), (3, 2, 1))
    spot = dl.SpotLight("s", (1, 2, 3), (0, -2, 0), (3, 2, 1), 0.1, 0.2)
    sun = dl.SunLight("u", (0, -2, 0), (5, 6, 7))
    assert [light.place is None for light in (point, spot, sun)] == [False, False, True]
    assert [light.axis is None for light in (point, spot, sun)] == [True, False, False]
    assert np.array_equal(sun.strength, (5, 6, 7))
    assert np.array_equal(spot.strength, (3, 2, 1))
    assert np.array_equal(spot.axis, (0, -1, 0))
    assert np.allclose(spot.parameters(), (1 - np.cos(0.1), 1 - np.cos(0.2)))
    assert point.parameters() == sun.parameters() == ()
    assert sun.power() is None


def test_what_gltf_has_no_kind_for_is_left_out(tmp_path) -> None:
    names = []
    for light in (Candle("candle", (0.5, 1, 0)), dl.PointLight("bulb", (0.5, 1, 0))):
        scene = with_light(light)
        with dl.Session(scene, dl.Samples.on_vertices(scene, 1.0), paths=200, gather="off") as session:
            session.bake()
            outputs.write(tmp_path / "lit.glb", baked_of(session, "test"))
        document = gl.GLTF2().load(str(tmp_path / "lit.glb"))
        lights = document.extensions.get("KHR_lights_punctual", {"lights": []})["lights"]
        names.append([one["name"] for one in lights])
    assert names == [[], ["bulb"]]
