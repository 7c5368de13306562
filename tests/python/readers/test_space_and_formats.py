# SPDX-License-Identifier: Apache-2.0
"""Units of length, upward axes, questions about odd sizes, and files of other programs."""

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import GltfBuilder

QUESTION = "are its numbers metres?"


def furnished():
    """A floor in the plane z = 0 of a file, a movable above it with a spot below, a sun, two cameras."""
    builder = GltfBuilder()
    builder.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]
    builder.node(mesh=builder.quad(), name="floor", scale=[8, 6, 1])
    spot = builder.light(type="spot", intensity=300)
    inner = builder.node(root=False, name="spot", extensions=spot, translation=[0, 0, 0.5])
    turn = [0, 0, np.sin(0.3), np.cos(0.3)]
    quad = builder.quad(builder.material(name="glow", emissiveFactor=[1, 1, 1]))
    builder.node(mesh=quad, name="MOVE_lamp", children=[inner], translation=[2, 1, 3], rotation=turn)
    builder.node(name="sun", extensions=builder.light(type="directional", intensity=1e4))
    builder.node(name="view", camera=0, translation=[4, 3, 2])
    return builder


def turned(points, scale):
    """Of (n, 3) points with Z up: metres, with Y up."""
    x, y, z = scale * np.asarray(points, float).T
    return np.stack([x, z, -y], axis=-1)


@pytest.mark.parametrize(
    ("unit", "metres"), [("mm", 0.001), ("cm", 0.01), ("in", 0.0254), ("ft", 0.3048), (2.5, 2.5)]
)
def test_the_whole_scene_is_scaled_and_turned(tmp_path, unit, metres):
    path = furnished().write(tmp_path)
    plain, scene = dl.load(path), dl.load(path, unit=unit, up="z")
    for mesh, before in zip(scene.meshes, plain.meshes, strict=True):
        np.testing.assert_allclose(mesh.world_vertices, turned(before.world_vertices, metres), rtol=1e-6)
        np.testing.assert_array_equal(mesh.triangles, before.triangles)
    np.testing.assert_allclose(scene.meshes[0].pose, np.eye(4))
    lamp, before = scene.mesh("MOVE_lamp"), plain.mesh("MOVE_lamp")
    np.testing.assert_allclose(lamp.pose[:3, 3], turned(before.pose[None, :3, 3], metres)[0])
    spot, sun = scene.lights
    np.testing.assert_allclose(spot.position, (0, 0, 0.5 * metres), atol=1e-12)
    np.testing.assert_allclose(lamp.pose[:3, :3] @ spot.direction, (0, -1, 0), atol=1e-12)
    np.testing.assert_allclose(sun.direction, (0, -1, 0), atol=1e-12)
    np.testing.assert_array_equal(spot.intensity, plain.lights[0].intensity)  # candela are candela
    (camera,) = scene.cameras
    np.testing.assert_allclose(camera.pose[:3, 3], turned([(4, 3, 2)], metres)[0])
    np.testing.assert_allclose(camera.pose[:3, 2], (0, 1, 0), atol=1e-12)  # it looks down
    area = {light["kind"]: light for light in scene.info()["lights"]}["area"]
    assert area["power"] == pytest.approx(np.pi * metres**2, rel=1e-6)


def test_node_records_still_restore_the_geometry(tmp_path):
    scene = dl.load(furnished().write(tmp_path), unit="cm", up="z")
    worlds = []
    for node in scene.nodes:
        worlds.append(worlds[node.parent] @ node.matrix if node.parent >= 0 else node.matrix)
    floor = next(k for k, node in enumerate(scene.nodes) if node.name == "floor")
    quad = np.array([[0, 0, 0, 1], [1, 0, 0, 1], [1, 1, 0, 1], [0, 1, 0, 1]])
    np.testing.assert_allclose((quad @ worlds[floor].T)[:, :3], scene.mesh("floor").world_vertices, atol=1e-9)


def test_metres_and_y_are_the_default_to_the_bit(tmp_path):
    path = furnished().write(tmp_path)
    plain, same = dl.load(path), dl.load(path, unit="m", up="y")
    for a, b in zip(plain.meshes, same.meshes, strict=True):
        assert a.vertices.tobytes() == b.vertices.tobytes()
        assert a.pose.tobytes() == b.pose.tobytes()


@pytest.mark.parametrize(("size", "asked"), [(0.5, True), (1.0, False), (300.0, False), (556.0, True)])
def test_an_odd_size_is_asked_about(tmp_path, size, asked):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(), scale=[size, size / 2, 1])
    path = builder.write(tmp_path)
    questions = [w for w in dl.load(path).warnings if QUESTION in w]
    assert len(questions) == asked
    if asked:
        assert f"measures {size:g} × {size / 2:g} × 0 m" in questions[0]
    assert not [w for w in dl.load(path, unit="m").warnings if QUESTION in w]  # answered


@pytest.mark.parametrize("unit", ["mile", 0.0, -1.0, float("nan"), float("inf")])
def test_unknown_units_are_refused(tmp_path, unit):
    path = furnished().write(tmp_path)
    with pytest.raises(dl.OptionError, match=r"unit: found .*, expected one of mm, cm, m, in, ft, or metres"):
        dl.load(path, unit=unit)
    with pytest.raises(dl.OptionError, match="up: found 'x', expected one of y, z"):
        dl.load(path, up="x")


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("house.usdz", "USD files are not read: import it into Blender"),
        ("house.FBX", "FBX files are not read: import it into Blender and export glTF"),
        ("house.blend", "Blender's files are not read: export glTF 2.0"),
        ("house.ifc", "IFC files are not read: convert it with IfcOpenShell's IfcConvert"),
        ("house.txt", 'found suffix ".txt", expected one of .gltf, .glb, .obj$'),
    ],
)
def test_files_of_other_programs_are_told_how_to_export(tmp_path, name, remedy):
    (tmp_path / name).write_bytes(b"?")
    with pytest.raises(dl.OptionError, match=remedy):
        dl.load(tmp_path / name)


def test_glass_is_told_to_be_dark(tmp_path):
    builder = GltfBuilder()
    for name, fields in {
        "pane": {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.1}}},
        "net": {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 0.9]}},
        "wall": {"alphaMode": "OPAQUE"},
    }.items():
        builder.node(mesh=builder.quad(builder.material(name=name, **fields)))
    path = builder.write(tmp_path)
    told = "windows let no daylight in (pane, net)"
    assert any(w.endswith(told) for w in dl.load(path, glass="opaque").warnings)
    assert not any("daylight" in w for w in dl.load(path).warnings)
