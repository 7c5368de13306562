# SPDX-License-Identifier: Apache-2.0
"""Files that Deltalux lit, loaded as scenes: their vertex colours are light, not reflectance."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD_TRIANGLES, GltfBuilder, png
from deltalux.outputs import write
from deltalux.outputs.of_session import baked_of
from deltalux.texels import srgb_to_linear
from meshes_for_tests import box, quad
from thoroughness import slow

TOLD = "lit by Deltalux: its vertex colours are light, not reflectance"


def lit(folder: Path, scene: dl.Scene, **edits) -> Path:
    path = folder / "lit.glb"
    samples = dl.Samples.on_vertices(scene, spacing=0.7)
    with dl.Session(scene, samples, paths=2000, gather=16, seed=3) as session:
        session.bake()
        for name, values in edits.items():
            session.set_reflectance(name, values)
        session.update()
        write(path, baked_of(session, "a script"))
    return path


def edited_json(path: Path, change) -> Path:
    """The file after `change` of its JSON."""
    data = path.read_bytes()
    size = struct.unpack("<I", data[12:16])[0]
    root = json.loads(data[20 : 20 + size])
    change(root)
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    path.write_bytes(head + struct.pack("<II", len(text), 0x4E4F534A) + text + rest)
    return path


def room(reflectance: float, lamp: float = 0.3) -> dl.Scene:
    walls = box("room", (0, 0, 0), (3, 2.5, 4), material="wall")
    walls = dl.Mesh("room", walls.vertices, walls.triangles[:, ::-1], "wall")
    shade = quad("shade", (1, 2, 1), (2, 2, 1), (2, 2, 2), (1, 2, 2))
    shade = dl.Mesh("shade", shade.vertices, shade.triangles, "lamp")
    materials = [
        dl.Material("wall", (reflectance, reflectance / 2, 0.1)),
        dl.Material("lamp", (lamp, lamp, 0.2), (900,) * 3, two_sided=True),
    ]
    return dl.Scene([walls, shade], materials, [dl.PointLight("bulb", (1, 1, 1), (50,) * 3)], unit="lux")


def strip_attribute(root: dict) -> None:
    for mesh in root["meshes"]:
        for primitive in mesh["primitives"]:
            del primitive["attributes"]["_IRRADIANCE"]


def rename_generator(root: dict) -> None:
    root["asset"] = {"version": "2.0", "generator": "another program"}


@pytest.mark.parametrize(
    "change",
    [None, strip_attribute, rename_generator],
    ids=["as written", "without attribute", "of another program"],
)
@pytest.mark.parametrize("reflectance", [0.25, slow(0.75)])
def test_reflectances_are_those_of_the_scene(tmp_path: Path, reflectance: float, change):
    path = lit(tmp_path, room(reflectance))
    scene = dl.load(path if change is None else edited_json(path, change))
    found = {m.name: m for m in scene.materials}
    assert set(found) == {"wall", "lamp"}
    np.testing.assert_allclose(found["wall"].reflectance, (reflectance, reflectance / 2, 0.1), rtol=1e-6)
    np.testing.assert_allclose(found["lamp"].reflectance, (0.3, 0.3, 0.2), rtol=1e-6)
    assert not found["lamp"].emissive
    assert [light.name for light in scene.lights] == ["bulb"]
    (told,) = [w for w in scene.warnings if TOLD in w]
    assert "surfaces that shone are dark" in told
    assert not any("vertex colours count" in w for w in scene.warnings)


def test_textures_with_an_edited_reflectance(tmp_path: Path):
    """Brighter than the texture can show by its factor: the rest was in the vertex colours."""
    builder = GltfBuilder()
    pixels = np.full((8, 8, 3), 120, np.uint8)
    info = {"index": builder.texture(png(pixels))}
    material = builder.material(
        name="cloth", pbrMetallicRoughness={"baseColorTexture": info, "metallicFactor": 0}
    )
    corners = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], np.float32)
    attributes = {
        "POSITION": builder.accessor(corners),
        "TEXCOORD_0": builder.accessor(corners[:, :2] / 2),
    }
    primitive = {"attributes": attributes, "indices": builder.accessor(QUAD_TRIANGLES), "material": material}
    builder.node(name="cloth", mesh=builder.mesh(primitive))
    builder.node(name="bulb", translation=[1, 1, 1], extensions=builder.light(type="point", intensity=40.0))
    scene = dl.load(builder.write(tmp_path))
    again = dl.load(lit(tmp_path, scene))
    mean = float(srgb_to_linear(np.array(120 / 255)))
    np.testing.assert_allclose(again.material("cloth").reflectance, (mean,) * 3, rtol=1e-6)
    bright = dl.load(lit(tmp_path, scene, cloth=(0.5, 0.4, 0.3)))
    np.testing.assert_allclose(bright.material("cloth").reflectance, (0.5, 0.4, 0.3), rtol=1e-6)


def test_colours_of_other_programs_are_reflectance_as_before(tmp_path: Path):
    builder = GltfBuilder()
    colours = builder.accessor(np.full((4, 3), 0.25, np.float32))
    mesh = builder.quad(builder.material(name="paint", colour=(1, 1, 1)))
    builder.json["meshes"][mesh]["primitives"][0]["attributes"]["COLOR_0"] = colours
    builder.node(mesh=mesh)
    scene = dl.load(builder.write(tmp_path))
    np.testing.assert_allclose(scene.materials[0].reflectance, 0.25)
    assert not any(TOLD in w for w in scene.warnings)


@pytest.mark.parametrize(
    "value", [[0.1, 0.2], [2, 0, 0], [-1, 0, 0], "grey", [True, 0, 0], {"r": 1}, [float("nan")] * 3]
)
def test_extras_of_other_types_mean_nothing(tmp_path: Path, value):
    builder = GltfBuilder()
    material = builder.material(name="paint", colour=(0.5, 0.5, 0.5), extras={"deltalux_reflectance": value})
    builder.node(mesh=builder.quad(material))
    if value != value or (isinstance(value, list) and any(v != v for v in value)):
        with pytest.raises(dl.FormatError):
            dl.load(builder.write(tmp_path))
        return
    np.testing.assert_allclose(dl.load(builder.write(tmp_path)).materials[0].reflectance, 0.5)
