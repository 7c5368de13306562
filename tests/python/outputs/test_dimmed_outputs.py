# SPDX-License-Identifier: Apache-2.0
"""Outputs of a session show its lights as they are dimmed: lamps, luminous surfaces, of one material, too."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from deltalux.outputs import images, write
from deltalux.outputs.of_session import baked_of, present_display, present_scene
from deltalux.rendering import render_session
from meshes_for_tests import box, quad
from thoroughness import slow

RADIANCE = 700.0
PANELS = {"left": -1.5, "middle": 0.0, "right": 1.5}


def scene(groups: str | None = None) -> dl.Scene:
    """Three panels of one material, each a group by its name unless it is of `groups`; a bulb and a sun."""
    walls = box("room", (-3, 0, -2), (3, 3, 2), material="wall")
    walls = dl.Mesh("room", walls.vertices, walls.triangles[:, ::-1], "wall")
    panels = []
    for name, x in PANELS.items():
        corners = [(x - 0.5, 2.5, -0.5), (x + 0.5, 2.5, -0.5), (x + 0.5, 2.5, 0.5), (x - 0.5, 2.5, 0.5)]
        shape = quad(name, *corners)
        panels.append(dl.Mesh(name, shape.vertices, shape.triangles, "glow"))
    materials = [
        dl.Material("wall", (0.5, 0.4, 0.3)),
        dl.Material("glow", (0.2, 0.2, 0.2), (RADIANCE, RADIANCE / 2, 0), groups, two_sided=True),
    ]
    lights = [
        dl.PointLight("bulb", (0, 1, 0), (40, 40, 20)),
        dl.SunLight("sun", (0, -1, 0), (9, 9, 9)),
    ]
    return dl.Scene([walls, *panels], materials, lights, unit="lux")


def session_with(own: dl.Scene, factors: dict[str, float]) -> dl.Session:
    session = dl.Session(own, dl.Samples.on_vertices(own, spacing=1.0), paths=3000, gather=16, seed=5)
    session.bake()
    for name, factor in factors.items():
        session.dim(name, factor)
    session.update()
    return session


FACTORS = [
    {},
    slow({"left": 0.0}),
    {"left": 0.0, "middle": 0.25, "right": 3.0, "bulb": 0.0, "sun": 0.5},
    slow({"left": 0.5, "middle": 0.5, "right": 0.5, "bulb": 2.0}),
]


def gltf(path: Path) -> tuple[dict, bytes]:
    data = path.read_bytes()
    size = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def colours(document: dict, blob: bytes, name: str, attribute: str) -> np.ndarray:
    """(n, 3) values of a node's vertices, of colours times the base colour."""
    node = next(n for n in document["nodes"] if n["name"] == name)
    (primitive,) = document["meshes"][node["mesh"]]["primitives"]
    accessor = document["accessors"][primitive["attributes"][attribute]]
    start = document["bufferViews"][accessor["bufferView"]]["byteOffset"] + accessor.get("byteOffset", 0)
    kind, scale = {5126: ("<f4", 1), 5123: ("<u2", 65535)}[accessor["componentType"]]
    width = {"VEC3": 3, "VEC4": 4}[accessor["type"]]
    values = np.frombuffer(blob, kind, accessor["count"] * width, start).reshape(-1, width)[:, :3] / scale
    if attribute == "COLOR_0":
        base = document["materials"][primitive["material"]]["pbrMetallicRoughness"]["baseColorFactor"]
        values = values * base[:3]
    return values


@pytest.mark.parametrize("factors", FACTORS, ids=str)
def test_colours_and_lights_of_glb_files(tmp_path: Path, factors: dict[str, float]):
    own, path = scene(), tmp_path / "lit.glb"
    with session_with(own, factors) as session:
        write(path, baked_of(session, "a script"))
    document, blob = gltf(path)
    exposure = document["asset"]["extras"]["exposure"]
    for name in PANELS:
        light = colours(document, blob, name, "_IRRADIANCE")
        glow = np.pi * factors.get(name, 1.0) * np.array([RADIANCE, RADIANCE / 2, 0])
        expected = np.clip(exposure * (0.2 * light + glow), 0, 1)
        found = colours(document, blob, name, "COLOR_0")
        full = np.isclose(found, 0.2) & (glow == 0)  # a vertex colour of 1, the most there is
        np.testing.assert_allclose(found, np.where(full, np.minimum(expected, 0.2), expected), atol=3e-5)
    lights = {n["name"]: n for n in document["extensions"]["KHR_lights_punctual"]["lights"]}
    assert lights["bulb"]["intensity"] == pytest.approx(40 * factors.get("bulb", 1.0))
    assert lights["sun"]["intensity"] == pytest.approx(9 * factors.get("sun", 1.0))


@pytest.mark.parametrize("factors", FACTORS, ids=str)
@pytest.mark.parametrize("per_pixel", [False, True])
def test_pictures(factors: dict[str, float], per_pixel: bool):
    """A panel's radiance in a picture from below, less what it reflects, is its dimmed emission."""
    with session_with(scene(), factors) as session:
        for name, x in PANELS.items():
            pose = np.array([[1.0, 0, 0, x], [0, 0, -1, 1.0], [0, 1, 0, 0], [0, 0, 0, 1]])
            camera = dl.Camera("up", pose, vertical_fov=0.2)
            glow = factors.get(name, 1.0) * np.array([RADIANCE, RADIANCE / 2, 0])
            if per_pixel:
                picture = render_session(session, camera=camera, size=(4, 4))
                assert picture.seen.hit.all()
                np.testing.assert_allclose(picture.seen.emission, np.tile(glow, (len(picture.seen.hit), 1)))
                continue
            baked = baked_of(session, "a script")
            made = images.render(
                baked.scene, baked.display, baked.result.irradiance, camera=camera, size=(4, 4), exposure=1e-4
            )
            unlit = scene_without(baked.scene)
            dark = images.render(
                unlit, baked.display, baked.result.irradiance, camera=camera, size=(4, 4), exposure=1e-4
            )
            brighter = made.pixels.astype(int).sum() > dark.pixels.astype(int).sum()
            assert brighter == bool(glow.any())


def scene_without(own: dl.Scene) -> dl.Scene:
    """The same, of which nothing shines."""
    materials = [dl.Material(m.name, m.reflectance) for m in own.materials]
    return dl.scene.replace_scene(own, materials=materials)


def test_a_group_of_several_meshes_keeps_its_material():
    with session_with(scene("ceiling"), {"ceiling": 0.25}) as session:
        present = present_scene(session)
        assert [m.name for m in present.materials] == ["wall", "glow"]
        np.testing.assert_allclose(present.material("glow").emission, (RADIANCE / 4, RADIANCE / 8, 0))


def test_materials_keep_their_numbers_and_reflectances():
    own = scene()
    with session_with(own, {"right": 0.5}) as session:
        session.set_reflectance("glow", (0.6, 0.1, 0.1))
        session.update()
        present = present_scene(session)
        display = present_display(session.samples.display, own, present)
    assert [m.name for m in present.materials] == ["wall", "glow", "glow at 0.5"]
    for material in present.materials[1:]:
        np.testing.assert_allclose(material.reflectance, (0.6, 0.1, 0.1))
    for index, name in enumerate(["room", *PANELS]):
        used = np.unique(display.triangle_material[display.triangle_mesh == index])
        assert used.tolist() == [{"room": 0, "right": 2}.get(name, 1)]
