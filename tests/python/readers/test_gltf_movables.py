# SPDX-License-Identifier: Apache-2.0
"""Movable objects of glTF files: selection, nesting, rigid poses, attached lights, node records."""

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD, GltfBuilder
from scipy.spatial.transform import Rotation

ORIGIN = np.array([1.0, 2.0, 3.0])
TURN = Rotation.from_euler("y", 40, degrees=True)


def load(builder, tmp_path, **options):
    return dl.load(builder.write(tmp_path), **options)


def grey(builder):
    return builder.material(name="grey", colour=(0.5, 0.5, 0.5))


def test_three_ways_to_make_a_node_movable(tmp_path):
    builder = GltfBuilder()
    for name, extras in (
        ("chair", {}),
        ("MOVE_desk", {}),
        ("vase", {"movable": True}),
        ("door", {"movable": 1}),
    ):
        builder.node(mesh=builder.quad(), name=name, extras=extras)
    builder.node(mesh=builder.quad(), name="wall", extras={"movable": False})
    assert load(builder, tmp_path).movable == ("MOVE_desk", "vase", "door")
    assert load(builder, tmp_path, movable=["chair"]).movable == ("chair", "MOVE_desk", "vase", "door")
    assert load(builder, tmp_path, movable="chair").movable == ("chair", "MOVE_desk", "vase", "door")


def test_unknown_name_lists_the_nearest_candidates(tmp_path):
    builder = GltfBuilder()
    for name in ("wall", "office chair", "lamp"):
        builder.node(mesh=builder.quad(), name=name)
    builder.node(name="empty")
    message = r'"ofice chair": found no node of that name, expected one of: office chair, wall, lamp'
    with pytest.raises(dl.OptionError, match=message):
        load(builder, tmp_path, movable=["ofice chair"])
    with pytest.raises(dl.OptionError, match='"empty": found a node with neither mesh nor light'):
        load(builder, tmp_path, movable=["empty"])


def test_a_marked_node_with_nothing_to_move_is_told(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad())
    builder.node(name="MOVE_ghost")
    scene = load(builder, tmp_path)
    assert scene.movable == ()
    assert "nodes marked as movable have nothing to move (MOVE_ghost)" in scene.warnings


def trolley(builder, scale=(1, 1, 1)):
    """A movable with two parts, a luminous child and a spot, turned and scaled; and a wall."""
    glow = builder.material(name="glow", emissiveFactor=[50, 50, 50])
    base = grey(builder)
    builder.node(mesh=builder.quad(base), name="wall")
    spot = builder.light(type="spot", intensity=100)
    wheel = builder.node(root=False, mesh=builder.quad(base), name="wheel", translation=[0, 0, 1])
    lamp = builder.node(root=False, mesh=builder.quad(glow), name="lamp", translation=[0, 0, 2])
    beam = builder.node(root=False, extensions=spot, name="beam", translation=[0, 1, 0])
    builder.node(
        name="MOVE_trolley",
        children=[wheel, lamp, beam],
        translation=[1, 2, 3],
        rotation=TURN.as_quat().tolist(),
        scale=list(scale),
    )
    return builder


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 2, 2), (1, 3, 0.5), (-1, 1, 1), (-1, -1, -2)])
def test_a_subtree_becomes_one_mesh(tmp_path, scale):
    scene = load(trolley(GltfBuilder(), scale), tmp_path)
    assert [m.name for m in scene.meshes] == ["wall", "MOVE_trolley"]
    mesh = scene.meshes[1]
    assert mesh.movable
    assert [mesh.material[i] for i in mesh.material_index] == ["grey"] * 2 + ["glow"] * 2
    rotation = mesh.pose[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) > 0
    np.testing.assert_allclose(mesh.pose[:3, 3], (1, 2, 3))
    if min(scale) > 0:
        np.testing.assert_allclose(rotation, TURN.as_matrix(), atol=1e-12)
    world = [TURN.apply((QUAD + np.array([0, 0, z])) * scale) + ORIGIN for z in (1, 2)]
    np.testing.assert_allclose(mesh.world_vertices, np.concatenate(world), atol=1e-12)
    a, b, c = (mesh.world_vertices[mesh.triangles[:, i]] for i in range(3))
    facing = TURN.apply(np.array((0, 0, 1)) / scale)  # the image of the front side
    assert (np.cross(b - a, c - a) @ facing > 0).all()


@pytest.mark.parametrize("scale", [(1, 1, 1), (1, 3, 0.5), (-1, 1, 1)])
def test_lights_of_the_subtree_are_attached_in_local_space(tmp_path, scale):
    scene = load(trolley(GltfBuilder(), scale), tmp_path)
    (light,) = scene.lights
    assert (light.name, light.attached_to) == ("beam", "MOVE_trolley")
    pose = scene.meshes[1].pose
    np.testing.assert_allclose(
        pose[:3, :3] @ light.position + pose[:3, 3],
        TURN.apply(np.array((0, 1, 0)) * scale) + ORIGIN,
        atol=1e-12,
    )
    np.testing.assert_allclose(pose[:3, :3] @ light.direction, TURN.apply((0, 0, -1)), atol=1e-12)
    np.testing.assert_array_equal(light.intensity, (100, 100, 100))


def test_emissive_parts_of_a_movable_belong_to_its_group(tmp_path):
    scene = load(trolley(GltfBuilder()), tmp_path)
    assert set(scene.groups) == {"MOVE_trolley", "beam"}


def test_a_light_alone_can_be_movable(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad())
    point = builder.light(type="point", intensity=90)
    builder.node(name="MOVE_bulb", extensions=point, translation=[1, 2, 3])
    scene = load(builder, tmp_path)
    mesh = scene.mesh("MOVE_bulb")
    assert mesh.movable
    assert len(mesh.triangles) == 0
    np.testing.assert_array_equal(mesh.pose[:3, 3], (1, 2, 3))
    assert scene.lights[0].attached_to == "MOVE_bulb"
    np.testing.assert_array_equal(scene.lights[0].position, (0, 0, 0))


def test_a_movable_inside_a_movable_moves_with_it(tmp_path):
    builder = GltfBuilder()
    inner = builder.node(root=False, mesh=builder.quad(), name="MOVE_cup", translation=[0, 0, 1])
    builder.node(mesh=builder.quad(), name="table", children=[inner], extras={"movable": True})
    scene = load(builder, tmp_path)
    assert scene.movable == ("table",)
    assert len(scene.meshes[0].triangles) == 4
    assert 'movable objects inside another one move with it ("MOVE_cup" in "table")' in scene.warnings


def test_a_name_that_several_nodes_bear(tmp_path):
    builder = GltfBuilder()
    for x in range(3):
        builder.node(mesh=builder.quad(), name="chair", translation=[x, 0, 0])
    assert load(builder, tmp_path, movable=["chair"]).movable == ("chair", "chair#2", "chair#3")
    scene = load(builder, tmp_path, movable=["chair#2"])
    assert scene.movable == ("chair#2",)
    assert scene.mesh("chair#2").pose[0, 3] == 1


def test_a_mesh_below_an_empty_node_of_the_same_name(tmp_path):
    builder = GltfBuilder()
    inner = builder.node(root=False, mesh=builder.quad(), name="room", translation=[0, 0, 1])
    builder.node(name="room", children=[inner], translation=[1, 0, 0])
    assert [m.name for m in load(builder, tmp_path).meshes] == ["room"]
    scene = load(builder, tmp_path, movable=["room"])
    assert scene.movable == ("room",)
    np.testing.assert_array_equal(scene.meshes[0].pose[:3, 3], (1, 0, 0))  # the outer node's
    assert not [w for w in scene.warnings if "inside another" in w]


def test_node_records_restore_hierarchy_and_geometry(tmp_path):
    scene = load(trolley(GltfBuilder(), (1, 3, 0.5)), tmp_path)
    assert [n.name for n in scene.nodes] == ["wall", "MOVE_trolley", "wheel", "lamp", "beam"]
    assert [n.parent for n in scene.nodes] == [-1, -1, 1, 1, 1]
    parts = [n.parts for n in scene.nodes]
    assert parts == [
        (("wall", 0, 2),),
        (("MOVE_trolley", 0, 0),),
        (("MOVE_trolley", 0, 2),),
        (("MOVE_trolley", 2, 2),),
        (),
    ]
    world = []
    for node in scene.nodes:
        world.append(world[node.parent] @ node.matrix if node.parent >= 0 else node.matrix)
    for node, matrix in zip(scene.nodes, world, strict=True):
        for name, first, count in node.parts:
            mesh = scene.mesh(name)
            to_part = np.linalg.inv(mesh.pose) @ matrix
            used = np.unique(mesh.triangles[first : first + count])
            if len(used):
                own = (mesh.vertices[used] - to_part[:3, 3]) @ np.linalg.inv(to_part[:3, :3]).T
                np.testing.assert_allclose(own, QUAD, atol=1e-12)


def test_collapsed_movable_still_has_a_rigid_pose(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad())
    builder.node(mesh=builder.quad(), name="MOVE_flat", scale=[1, 0, 1], rotation=TURN.as_quat().tolist())
    builder.node(mesh=builder.quad(), name="MOVE_gone", scale=[0, 0, 0])
    for name in ("MOVE_flat", "MOVE_gone"):
        rotation = load(builder, tmp_path).mesh(name).pose[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) > 0


def chairs(builder):
    for name in ("chair", "chair", "armchair", "table", "chair[0]"):
        builder.node(mesh=builder.quad(), name=name)
    builder.node(name="chairs of nobody")
    return builder


@pytest.mark.parametrize(
    ("word", "movable"),
    [
        ("chair*", ("chair", "chair#2", "chair[0]")),
        ("*chair", ("chair", "chair#2", "armchair")),
        ("?able", ("table",)),
        ("chair[0]", ("chair[0]",)),  # a name comes before what it describes
        ("chair#1", ("chair",)),
        ("*#2", ("chair#2",)),
    ],
)
def test_patterns_select_several_nodes(tmp_path, word, movable):
    assert load(chairs(GltfBuilder()), tmp_path, movable=[word]).movable == movable


def test_a_pattern_that_means_nothing_is_refused(tmp_path):
    message = (
        r'"stool\*": found no node of that name, expected one of: .*chair.*; `deltalux info FILE --nodes`'
    )
    with pytest.raises(dl.OptionError, match=message):
        load(chairs(GltfBuilder()), tmp_path, movable=["stool*"])


def test_nodes_know_their_lights_and_what_selects_them(tmp_path):
    builder = trolley(GltfBuilder())
    builder.node(extensions=builder.light(type="point", intensity=1), name="wheel")
    scene = load(builder, tmp_path)
    assert [node.lights for node in scene.nodes] == [(), (), (), (), ("beam",), ("wheel",)]
    assert [node.label for node in scene.nodes][2:] == ["wheel", "lamp", "beam", "wheel#2"]
