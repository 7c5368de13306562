# SPDX-License-Identifier: Apache-2.0
"""Cameras: from glTF, to glTF and session files, and what an orthographic one sees."""

from __future__ import annotations

from pathlib import Path

import deltalux as dl
import numpy as np
from builders.gltf import GltfBuilder
from deltalux import outputs
from deltalux.mesh.display_mesh import refine
from deltalux.outputs.camera import look_at
from deltalux.outputs.view import camera_rays
from test_gltf_lights import DOWN
from written_results import Reader, result_for, shift

PLAN = {"xmag": 3, "ymag": -2, "znear": 0.5, "zfar": 40}
LENS = {"yfov": 0.8, "znear": 0.1, "zfar": 50, "aspectRatio": 1.5}
FIELDS = ("name", "vertical_fov", "height", "aspect", "near", "far")


def room_with(tmp_path: Path, *cameras: tuple[str, dict]) -> dl.Scene:
    builder = GltfBuilder()
    builder.node(mesh=builder.quad())
    builder.json["cameras"] = [camera for _, camera in cameras]
    inner = [
        builder.node(root=False, camera=i, name=cameras[i][0], rotation=DOWN) for i in range(len(cameras))
    ]
    builder.node(children=inner, translation=[1, 2, 3], scale=[2, 2, 2])
    return dl.load(builder.write(tmp_path))


def both(tmp_path: Path) -> dl.Scene:
    return room_with(
        tmp_path,
        ("eye", {"type": "perspective", "perspective": LENS}),
        ("plan", {"type": "orthographic", "orthographic": PLAN}),
        (
            "bare",
            {"type": "perspective", "perspective": {"yfov": 0.5, "znear": -1, "zfar": 0, "aspectRatio": 0}},
        ),
    )


def facts(camera: dl.Camera) -> tuple:
    return tuple(getattr(camera, name) for name in FIELDS)


def test_cameras_of_gltf(tmp_path: Path):
    scene = both(tmp_path)
    assert [facts(camera) for camera in scene.cameras] == [
        ("eye", 0.8, None, 1.5, 0.1, 50),
        ("plan", 0.9, 4, 1.5, 0.5, 40),
        ("bare", 0.5, None, None, 0.01, None),
    ]
    for camera in scene.cameras:
        np.testing.assert_allclose(camera.pose[:3, :3].T @ camera.pose[:3, :3], np.eye(3), atol=1e-12)
        np.testing.assert_allclose(-camera.pose[:3, 2], (0, -1, 0), atol=1e-12)
        np.testing.assert_allclose(camera.pose[:3, 3], (1, 2, 3))


def test_cameras_that_show_nothing_are_left_out(tmp_path: Path):
    scene = room_with(
        tmp_path,
        ("fish", {"type": "perspective", "perspective": {"yfov": 4, "znear": 0.1}}),
        ("flat", {"type": "orthographic", "orthographic": PLAN | {"ymag": 0}}),
        ("line", {"type": "orthographic", "orthographic": PLAN | {"xmag": 0}}),
        ("far", {"type": "orthographic", "orthographic": PLAN | {"ymag": 1e20}}),
        ("none", {"type": "perspective"}),
    )
    assert scene.cameras == ()
    assert any("field of view" in w and "fish" in w for w in scene.warnings)
    assert any("without a perspective" in w and "flat, line, far, none" in w for w in scene.warnings)


def test_glb_and_session_keep_them(tmp_path: Path):
    scene = both(tmp_path)
    display = refine(scene, 0.5)
    outputs.write(
        tmp_path / "a.glb", outputs.Baked(result_for(display.points, display.normals), scene, display)
    )
    with dl.Session(scene, dl.Samples([(0.5, 0.5, 0.1)], (0, 0, 1), radius=0.1), paths=10) as session:
        session.save(tmp_path / "a.dlx")
    with dl.Session.open(tmp_path / "a.dlx") as opened:
        for found in (dl.load(tmp_path / "a.glb").cameras, opened.scene.cameras):
            assert [facts(camera) for camera in found] == [facts(camera) for camera in scene.cameras]
            for one, other in zip(found, scene.cameras, strict=True):
                np.testing.assert_allclose(one.pose, other.pose, atol=1e-12)
    written = Reader(tmp_path / "a.glb").document.cameras
    assert [camera.type for camera in written] == ["perspective", "orthographic", "perspective"]


def test_cameras_and_lights_go_to_their_own_nodes(tmp_path: Path):
    """As they were read: nothing is there twice. What moved away from its node gets another."""
    builder = GltfBuilder()
    builder.json["cameras"] = [{"type": "perspective", "perspective": LENS}]
    eye = builder.node(root=False, camera=0, name="eye", rotation=DOWN)
    spot = builder.node(
        root=False, name="spot", extensions=builder.light(type="spot"), rotation=DOWN, scale=[2, 2, 2]
    )
    sun = builder.light(type="directional")
    builder.node(name="rig", children=[eye, spot], translation=[1, 2, 3], rotation=[0, 0.6, 0, 0.8])
    builder.node(name="sun", extensions=sun, translation=[9, 9, 9])
    builder.node(name="MOVE_bulb", mesh=builder.quad(), extensions=builder.light(type="point"))
    moving = builder.node(root=False, camera=0, name="follower")
    builder.node(name="MOVE_cart", mesh=builder.quad(), children=[moving])
    scene = dl.load(builder.write(tmp_path))
    display = refine(scene, 0.5)
    given = result_for(display.points, display.normals)
    for poses, nodes in (({}, 7), ({"MOVE_cart": shift(1, 0, 0), "MOVE_bulb": shift(3, 4, 5)}, 8)):
        outputs.write(tmp_path / "a.glb", outputs.Baked(given, scene, display, poses))
        document = Reader(tmp_path / "a.glb").document
        assert len(document.nodes) == nodes
        assert document.nodes[0].name == "rig"
        again = dl.load(tmp_path / "a.glb")
        for one, other in zip(scene.cameras, again.cameras, strict=True):
            assert one.name == other.name
            np.testing.assert_allclose(one.pose, other.pose, atol=1e-6)
        lights = {light.name: light for light in again.lights}
        np.testing.assert_allclose(
            lights["MOVE_bulb"].position, (0, 0, 0), atol=1e-6
        )  # in its movable's space
        for name in ("spot", "sun"):
            expected = next(light for light in scene.lights if light.name == name)
            np.testing.assert_allclose(lights[name].direction, expected.direction, atol=1e-6)


def test_an_orthographic_view_without_an_end_ends_behind_the_scene(tmp_path: Path):
    scene = both(tmp_path)
    view = dl.Camera("plan", look_at(np.array([0.5, 0.5, 70.0]), np.array([0.5, 0.5, 0])), height=3)
    scene = dl.scene.replace_scene(scene, cameras=[view])
    display = refine(scene, 0.5)
    outputs.write(
        tmp_path / "a.glb", outputs.Baked(result_for(display.points, display.normals), scene, display)
    )
    (written,) = Reader(tmp_path / "a.glb").document.cameras
    assert 70 < written.orthographic.zfar < 80
    assert (written.orthographic.xmag, written.orthographic.ymag) == (1.5, 1.5)


def test_parallel_rays():
    camera = dl.Camera("plan", look_at(np.array([1.0, 5.0, 2.0]), np.array([1.0, 0.0, 2.0])), height=4)
    x, y = np.array([0.0, 40, 20]), np.array([0.0, 20, 10])
    origins, directions = camera_rays(camera, (40, 20), x, y)
    np.testing.assert_allclose(directions, [(0, -1, 0)] * 3, atol=1e-15)
    np.testing.assert_allclose(origins[2], (1, 5, 2))
    # Four metres high and, by the picture's shape, eight wide.
    right, up = camera.pose[:3, 0], camera.pose[:3, 1]
    np.testing.assert_allclose(origins[0] - origins[2], -4 * right + 2 * up, atol=1e-12)
    np.testing.assert_allclose(origins[1] - origins[2], 4 * right - 2 * up, atol=1e-12)
    np.testing.assert_array_equal(camera.pixel_width(20, np.array([1.0, np.inf])), 0.2)
