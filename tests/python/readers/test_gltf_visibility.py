# SPDX-License-Identifier: Apache-2.0
"""KHR_node_visibility: hidden objects and lamps are not there, whatever is below them; cameras stay."""

from __future__ import annotations

import dataclasses

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import GltfBuilder

HIDDEN = {"KHR_node_visibility": {"visible": False}}
SHOWN = {"KHR_node_visibility": {"visible": True}}
TOLD = "hidden objects and lamps are left out"


@dataclasses.dataclass
class Room:
    """A visible floor with one lamp; `node` adds what a test hides."""

    builder: GltfBuilder = dataclasses.field(default_factory=GltfBuilder)

    def __post_init__(self) -> None:
        self.builder.use("KHR_node_visibility", required=True)
        self.grey = self.builder.material(name="grey", colour=(0.5, 0.5, 0.5))
        self.node("floor", mesh=True)
        self.node("lamp", light=True)

    def node(self, name: str, *, mesh=False, light=False, visibility=None, **fields) -> int:
        extensions = dict(visibility or {})
        if light:
            extensions |= self.builder.light(name=name, type="point", intensity=10.0)
        if mesh:
            fields["mesh"] = self.builder.quad(self.grey)
        return self.builder.node(name=name, extensions=extensions, **fields)

    def load(self, folder, **options) -> dl.Scene:
        return dl.load(self.builder.write(folder), **options)


def check_only_the_room(scene: dl.Scene, *told: str) -> None:
    assert [m.name for m in scene.meshes] == ["floor"]
    assert [light.name for light in scene.lights] == ["lamp"]
    assert scene.groups == ("lamp",)
    notes = [w for w in scene.warnings if TOLD in w]
    assert notes == ([f"{TOLD} ({', '.join(told)})"] if told else [])
    assert not any("not honoured" in w for w in scene.warnings)


def test_hidden_objects_and_lamps_are_not_there(tmp_path):
    room = Room()
    room.node("old wall", mesh=True, visibility=HIDDEN)
    room.node("old lamp", light=True, visibility=HIDDEN)
    room.node("both", mesh=True, light=True, visibility=HIDDEN)
    check_only_the_room(room.load(tmp_path), "old wall", "old lamp", "both")


@pytest.mark.parametrize("depth", [1, 2, 40])
@pytest.mark.parametrize("visibility", [None, SHOWN, HIDDEN])
def test_what_is_below_a_hidden_node_is_hidden_whatever_it_says(tmp_path, depth, visibility):
    room = Room()
    child = room.node("deep", mesh=True, light=True, visibility=visibility, root=False)
    for i in range(depth):
        last = i == depth - 1
        child = room.node(f"above {i}", visibility=HIDDEN if last else SHOWN, children=[child], root=last)
    check_only_the_room(room.load(tmp_path), "deep")


@pytest.mark.parametrize("visibility", [SHOWN, {"KHR_node_visibility": {}}])
def test_visible_nodes_below_visible_ones_stay(tmp_path, visibility):
    room = Room()
    child = room.node("shelf", mesh=True, light=True, visibility=visibility, root=False)
    room.node("group", visibility=visibility, children=[child])
    scene = room.load(tmp_path)
    assert [m.name for m in scene.meshes] == ["floor", "shelf"]
    assert len(scene.lights) == 2
    assert not any(TOLD in w for w in scene.warnings)


def test_cameras_see_from_hidden_nodes(tmp_path):
    room = Room()
    room.builder.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
    room.node("view", visibility=HIDDEN, camera=0, translation=[0, 1, 2])
    scene = room.load(tmp_path)
    check_only_the_room(scene)
    (camera,) = scene.cameras
    np.testing.assert_allclose(camera.pose[:3, 3], (0, 1, 2))


def test_hidden_movables_and_parts_of_movables(tmp_path):
    room = Room()
    room.node("MOVE_gone", mesh=True, visibility=HIDDEN)
    drawer = room.node("drawer", mesh=True, light=True, visibility=HIDDEN, root=False)
    room.node("desk", mesh=True, children=[drawer])
    scene = room.load(tmp_path, movable=["desk"])
    assert scene.movable == ("desk",)
    assert len(scene.mesh("desk").triangles) == 2
    assert len(scene.lights) == 1
    with pytest.raises(dl.OptionError, match='movable "MOVE_gone": found a node with neither mesh nor light'):
        room.load(tmp_path, movable=["MOVE_gone"])


def test_names_of_hidden_objects_are_free(tmp_path):
    room = Room()
    room.builder.json["scenes"][0]["nodes"].insert(
        0, room.node("floor", mesh=True, visibility=HIDDEN, root=False)
    )
    check_only_the_room(room.load(tmp_path), "floor")


def test_hidden_instances(tmp_path):
    room = Room()
    places = room.builder.accessor(np.zeros((5, 3), np.float32))
    instanced = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}
    room.node("trees", mesh=True, visibility=HIDDEN | instanced)
    check_only_the_room(room.load(tmp_path), "trees")


@pytest.mark.parametrize("value", ["false", 0, None, [], {}])
def test_anything_else_than_true_or_false_is_refused(tmp_path, value):
    room = Room()
    room.node("wall", mesh=True, visibility={"KHR_node_visibility": {"visible": value}})
    if value is None:  # as absent
        assert len(room.load(tmp_path).meshes) == 2
        return
    with pytest.raises(dl.FormatError, match=r"visible: found .*, expected true or false"):
        room.load(tmp_path)
