# SPDX-License-Identifier: Apache-2.0
"""EXT_mesh_gpu_instancing: places, names, movables, lights, refusals."""

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD, GltfBuilder
from deltalux import outputs
from deltalux.outputs.of_session import baked_of
from scipy.spatial.transform import Rotation

EXTENSION = "EXT_mesh_gpu_instancing"
MOVES = np.array([[0, 0, 0], [4, 0, 0], [0, 5, 1]], np.float32)
TURNS = Rotation.from_euler("xyz", [[0, 0, 0], [90, 0, 0], [0, 30, 45]], degrees=True)
SCALES = np.array([[1, 1, 1], [2, 2, 2], [1, -1, 3]], np.float32)
PARENT = {"translation": [1, 2, 3], "scale": [2, 2, 2]}


def trees(builder, *, name="tree", material=None, **attributes):
    """Three instances of the quad on a node that is moved and scaled."""
    given = attributes or {
        "TRANSLATION": builder.accessor(MOVES),
        "ROTATION": builder.accessor(TURNS.as_quat().astype(np.float32)),
        "SCALE": builder.accessor(SCALES),
    }
    builder.use(EXTENSION, required=True)
    extensions = {EXTENSION: {"attributes": given}}
    builder.node(mesh=builder.quad(material), name=name, extensions=extensions, **PARENT)
    return builder


def placed(i):
    own = TURNS[i].apply(QUAD * SCALES[i]) + MOVES[i]
    return own * 2 + (1, 2, 3)


def test_each_instance_stands_where_it_should(tmp_path):
    scene = dl.load(trees(GltfBuilder()).write(tmp_path))
    assert [m.name for m in scene.meshes] == ["tree", "tree#2", "tree#3"]
    for i, mesh in enumerate(scene.meshes):
        np.testing.assert_allclose(mesh.world_vertices, placed(i), atol=1e-5)
    assert not [w for w in scene.warnings if EXTENSION in w]
    flipped = scene.meshes[2]
    a, b, c = (flipped.world_vertices[flipped.triangles[:, k]] for k in range(3))
    front = TURNS[2].apply(np.array((0, 0, 1)) / SCALES[2])  # a mirrored front is still the front
    assert (np.cross(b - a, c - a) @ front > 0).all()


def test_attributes_may_be_absent_or_quantised(tmp_path):
    builder = GltfBuilder()
    quarter = np.array([[0, 0, 23170, 23170], [0, 0, 0, 32767]], np.int16)
    scene = dl.load(trees(builder, ROTATION=builder.accessor(quarter, normalized=True)).write(tmp_path))
    assert len(scene.meshes) == 2
    turned = np.stack([-QUAD[:, 1], QUAD[:, 0], QUAD[:, 2]], axis=1) * 2 + (1, 2, 3)
    np.testing.assert_allclose(scene.meshes[0].world_vertices, turned, atol=1e-3)
    np.testing.assert_allclose(scene.meshes[1].world_vertices, QUAD * 2 + (1, 2, 3), atol=1e-6)


@pytest.mark.parametrize(
    ("word", "names"), [("tree", ["tree"]), ("tree#2", ["tree#2"]), ("tree#1", ["tree"])]
)
def test_all_or_one_can_move(tmp_path, word, names):
    scene = dl.load(trees(GltfBuilder()).write(tmp_path), movable=[word])
    assert list(scene.movable) == names
    mesh = scene.mesh(names[0])
    assert len(mesh.triangles) == (6 if word == "tree" else 2)
    expected = (
        np.concatenate([placed(i) for i in range(3)]) if word == "tree" else placed("12".find(word[-1]))
    )
    np.testing.assert_allclose(mesh.world_vertices, expected, atol=1e-5)


def test_what_hangs_on_the_node_is_there_once(tmp_path):
    builder = trees(GltfBuilder(), material=None)
    spot = builder.light(type="point", intensity=100)
    builder.json["nodes"][0]["extensions"].update(spot)
    child = builder.node(root=False, mesh=builder.quad(), name="sign")
    builder.json["nodes"][0]["children"] = [child]
    last = builder.node(root=False, mesh=builder.quad(), name="last")
    builder.node(name="shelf", children=[last])
    scene = dl.load(builder.write(tmp_path))
    assert [m.name for m in scene.meshes] == ["tree", "tree#2", "tree#3", "sign", "last"]
    (light,) = scene.lights
    np.testing.assert_allclose(light.position, (1, 2, 3))
    parents = {node.label: node.parent for node in scene.nodes}
    group = next(k for k, node in enumerate(scene.nodes) if node.lights)
    assert {parents[name] for name in ("tree", "tree#2", "sign")} == {group}
    assert scene.nodes[parents["last"]].name == "shelf"


def test_lit_file_keeps_them(tmp_path):
    """Outputs write the copies as plain nodes."""
    scene = dl.load(trees(GltfBuilder()).write(tmp_path))
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=1.0), paths=1000, gather="off") as session:
        session.bake()
        outputs.write_glb(tmp_path / "lit.glb", baked_of(session, "test"))
    lit = dl.load(tmp_path / "lit.glb")
    assert [node.name for node in lit.nodes].count("tree") == 4
    np.testing.assert_allclose(lit.bounds, scene.bounds, atol=1e-5)


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({}, "found none of its attributes, expected the same count of TRANSLATION, ROTATION, SCALE"),
        ({"TRANSLATION": MOVES, "SCALE": SCALES[:2]}, "found .*expected the same count of"),
        ({"ROTATION": MOVES}, "found type VEC3 of component type 5126, expected VEC4"),
        ({"ROTATION": np.zeros((3, 4), np.float32)}, r"instance 0\.rotation: found"),
        ({"TRANSLATION": MOVES * np.nan}, "at element 0, expected finite numbers"),
        ({"TRANSLATION": 99}, "found 99, expected an index below"),
    ],
)
def test_refusals(tmp_path, attributes, message):
    builder = GltfBuilder()
    given = {k: v if isinstance(v, int) else builder.accessor(v) for k, v in attributes.items()}
    trees(builder)
    builder.json["nodes"][0]["extensions"][EXTENSION]["attributes"] = given
    with pytest.raises(dl.FormatError, match=message):
        dl.load(builder.write(tmp_path))


def test_more_instances_than_fit_into_memory_are_refused(tmp_path, monkeypatch):
    builder = GltfBuilder()
    many = np.zeros((200_000, 3), np.uint8)
    path = trees(builder, TRANSLATION=builder.accessor(many)).write(tmp_path)
    monkeypatch.setattr("deltalux.io.scene_size.available_memory", lambda: 1 << 29)
    with pytest.raises(dl.SceneError, match="found 200,001 nodes after instancing"):
        dl.load(path)
