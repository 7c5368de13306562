# SPDX-License-Identifier: Apache-2.0
"""glTF geometry: modes, index types, layouts of accessors, hierarchies and windings."""

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD, QUAD_TRIANGLES, GltfBuilder
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from thoroughness import examples

UP = np.array([0, 0, 1], np.float32)


def load(builder, tmp_path, name="scene.glb", **options):
    return dl.load(builder.write(tmp_path, name), **options)


def normals(mesh):
    a, b, c = (mesh.world_vertices[mesh.triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a) / 2


def one_primitive(tmp_path, builder, **primitive):
    builder.node(mesh=builder.mesh(primitive))
    return load(builder, tmp_path).meshes[0]


@pytest.mark.parametrize("name", ["scene.glb", "scene.gltf"])
def test_both_containers_give_the_same_scene(tmp_path, name):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(), name="floor")
    scene = load(builder, tmp_path, name)
    assert [m.name for m in scene.meshes] == ["floor"]
    assert scene.unit == "lux"
    assert scene.source == str(tmp_path / name)
    np.testing.assert_array_equal(scene.meshes[0].vertices, QUAD)
    np.testing.assert_array_equal(scene.meshes[0].triangles, [[0, 1, 2], [0, 2, 3]])


def test_external_buffer_with_escaped_name(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad())
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "my buffer.bin").write_bytes(builder.data)
    (tmp_path / "scene.gltf").write_bytes(builder.gltf("data/my%20buffer.bin"))
    assert dl.load(tmp_path / "scene.gltf").info()["area"] == pytest.approx(1)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32])
def test_index_types(tmp_path, dtype):
    builder = GltfBuilder()
    position, indices = builder.accessor(QUAD), builder.accessor(QUAD_TRIANGLES.astype(dtype))
    mesh = one_primitive(tmp_path, builder, attributes={"POSITION": position}, indices=indices)
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3]])


ZIGZAG = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0], [1, 2, 0]], np.float32)
FANNED = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [1, 2, 0], [0, 2, 0]], np.float32)


@pytest.mark.parametrize("indexed", [False, True])
@pytest.mark.parametrize(("mode", "points", "area"), [(5, ZIGZAG, 2.0), (6, FANNED, 4.0)])
def test_strips_and_fans_face_one_way(tmp_path, mode, points, area, indexed):
    builder = GltfBuilder()
    primitive = {"attributes": {"POSITION": builder.accessor(points)}, "mode": mode}
    if indexed:
        order = np.array([3, 0, 5, 1, 2, 4], np.uint8)
        primitive["attributes"]["POSITION"] = builder.accessor(points[np.argsort(order)])
        primitive["indices"] = builder.accessor(order)
    mesh = one_primitive(tmp_path, builder, **primitive)
    assert len(mesh.triangles) == 4
    assert (normals(mesh)[:, 2] > 0).all()
    assert mesh.triangle_areas().sum() == pytest.approx(area)


def test_triangles_without_indices(tmp_path):
    builder = GltfBuilder()
    position = builder.accessor(QUAD[QUAD_TRIANGLES])
    mesh = one_primitive(tmp_path, builder, attributes={"POSITION": position})
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [3, 4, 5]])


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_points_and_lines_are_left_out_with_one_warning(tmp_path, mode):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(), name="floor")
    position = builder.accessor(QUAD)
    dots = {"attributes": {"POSITION": position}, "mode": mode}
    builder.node(mesh=builder.mesh(dots, dots), name="dots")
    scene = load(builder, tmp_path)
    assert scene.info()["triangles"] == 2
    assert [m.name for m in scene.meshes] == ["floor"]
    assert [(n.name, len(n.parts)) for n in scene.nodes] == [("floor", 1), ("dots", 0)]
    what = "points" if mode == 0 else "lines"
    assert [w for w in scene.warnings if "left out" in w] == [
        f"{what} are not surfaces and are left out (dots)"
    ]


def test_interleaved_positions(tmp_path):
    builder = GltfBuilder()
    rows = np.zeros((4, 8), np.float32)
    rows[:, 2:5] = QUAD
    view = builder.view(rows.tobytes(), byteStride=32)
    builder.json["accessors"].append(
        {"bufferView": view, "byteOffset": 8, "componentType": 5126, "count": 4, "type": "VEC3"}
    )
    mesh = one_primitive(tmp_path, builder, attributes={"POSITION": 0}, mode=6)
    np.testing.assert_array_equal(mesh.vertices, QUAD)


def test_last_interleaved_element_may_end_before_its_stride(tmp_path):
    builder = GltfBuilder()
    rows = np.zeros((4, 8), np.float32)
    rows[:, :3] = QUAD
    view = builder.view(rows.tobytes()[: 3 * 32 + 12], byteStride=32)
    builder.json["accessors"].append({"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3"})
    assert len(one_primitive(tmp_path, builder, attributes={"POSITION": 0}, mode=6).triangles) == 2


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int16, np.uint16])
@pytest.mark.parametrize("normalized", [False, True])
def test_quantised_positions(tmp_path, dtype, normalized):
    builder = GltfBuilder()
    builder.use("KHR_mesh_quantization", required=True)
    top = np.iinfo(dtype).max
    low = np.iinfo(dtype).min  # normalised, -128 and -127 are both -1
    points = np.array([[0, 0, 0], [top, 0, 0], [top, top, 0], [low, top, 0]], dtype)
    position = builder.accessor(points, normalized=normalized)
    mesh = one_primitive(tmp_path, builder, attributes={"POSITION": position}, mode=6)
    expected = points.astype(float)
    if normalized:
        expected = np.maximum(expected / top, -1)
    np.testing.assert_allclose(mesh.vertices, expected, rtol=1e-15)


@pytest.mark.parametrize("with_base", [True, False])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32])
def test_sparse_positions(tmp_path, with_base, dtype):
    builder = GltfBuilder()
    position = builder.accessor(QUAD * (1 if with_base else 0))
    where, values = [1, 3], np.array([[5, 0, 0], [0, 7, 0]], np.float32)
    accessor = builder.json["accessors"][position]
    accessor["sparse"] = {
        "count": 2,
        "indices": {
            "bufferView": builder.view(np.array(where, dtype).tobytes()),
            "componentType": {1: 5121, 2: 5123, 4: 5125}[np.dtype(dtype).itemsize],
        },
        "values": {"bufferView": builder.view(values.tobytes())},
    }
    if not with_base:
        del accessor["bufferView"]
    mesh = one_primitive(tmp_path, builder, attributes={"POSITION": position}, mode=6)
    expected = QUAD * (1 if with_base else 0)
    expected[where] = values
    np.testing.assert_array_equal(mesh.vertices, expected)


def test_primitives_that_share_a_big_vertex_array_keep_only_their_own(tmp_path):
    builder = GltfBuilder()
    points = np.zeros((10_000, 3), np.float32)
    points[-4:] = QUAD
    points[:3] = QUAD[:3] + UP
    position = builder.accessor(points)
    last = builder.accessor(np.array([9996, 9997, 9998], np.uint16))
    first = builder.accessor(np.array([0, 1, 2], np.uint16))
    some = builder.accessor(np.arange(9000, dtype=np.uint16))
    builder.node(
        mesh=builder.mesh(
            {"attributes": {"POSITION": position}, "indices": last},
            {"attributes": {"POSITION": position}, "indices": first},
        )
    )
    builder.node(mesh=builder.mesh({"attributes": {"POSITION": position}, "indices": some}))
    scene = load(builder, tmp_path)
    assert len(scene.meshes[0].vertices) == 6
    np.testing.assert_array_equal(
        scene.meshes[0].vertices[scene.meshes[0].triangles], [QUAD[:3], QUAD[:3] + UP]
    )
    assert len(scene.meshes[1].vertices) == 9000


def test_several_primitives_become_one_mesh_with_several_materials(tmp_path):
    builder = GltfBuilder()
    red, blue = (
        builder.material(name="red", colour=(1, 0, 0)),
        builder.material(name="blue", colour=(0, 0, 1)),
    )
    position, indices = builder.accessor(QUAD), builder.accessor(QUAD_TRIANGLES)
    primitives = [
        {"attributes": {"POSITION": position}, "indices": indices, "material": m} for m in (blue, red, blue)
    ]
    builder.node(mesh=builder.mesh(*primitives), name="thing")
    (mesh,) = load(builder, tmp_path).meshes
    names = [mesh.material[i] for i in mesh.material_index]
    assert names == ["blue"] * 2 + ["red"] * 2 + ["blue"] * 2


def test_mirrored_node_keeps_its_front(tmp_path):
    builder = GltfBuilder()
    quad = builder.quad()
    builder.node(mesh=quad, name="as it is")
    builder.node(mesh=quad, scale=[-1, 1, 1])
    inner = builder.node(root=False, mesh=quad, scale=[1, -2, 1])
    builder.node(scale=[-1, 1, 1], children=[inner])  # mirrored twice
    for mesh in load(builder, tmp_path).meshes:
        assert (normals(mesh)[:, 2] > 0).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_movable_that_is_mirrored_is_not_rotated_and_stays_where_it_is(tmp_path, axis):
    scale = np.where(np.arange(3) == axis, -2.0, 1.0)
    turned = Rotation.from_euler("y", 30, degrees=True)
    for rotation in (Rotation.identity(), turned):
        builder = GltfBuilder()
        builder.node(mesh=builder.quad(), name="MOVE_sign", scale=scale.tolist(), translation=[3, 4, 5],
                     rotation=rotation.as_quat().tolist())  # fmt: skip
        (mesh,) = load(builder, tmp_path).meshes
        np.testing.assert_allclose(mesh.pose[:3, :3], rotation.as_matrix(), atol=1e-12)
        expected = np.add(rotation.apply(QUAD * scale), (3, 4, 5))
        np.testing.assert_allclose(mesh.world_vertices, expected, atol=1e-6)


def test_shear_by_matrix(tmp_path):
    builder = GltfBuilder()
    matrix = np.eye(4)
    matrix[0, 1], matrix[2, 3] = 0.7, 5  # x += 0.7 y; z += 5
    builder.node(mesh=builder.quad(), matrix=matrix.T.ravel().tolist())
    (mesh,) = load(builder, tmp_path).meshes
    np.testing.assert_allclose(mesh.world_vertices, QUAD @ matrix[:3, :3].T + (0, 0, 5))


def test_shared_mesh_and_repeated_names(tmp_path):
    builder = GltfBuilder()
    quad = builder.quad(name="square")
    for x in range(3):
        builder.node(mesh=quad, name="panel", translation=[x, 0, 0])
    builder.node(mesh=quad)
    builder.node(mesh=quad)
    builder.node(mesh=builder.quad())
    scene = load(builder, tmp_path)
    assert [m.name for m in scene.meshes] == ["panel", "panel#2", "panel#3", "square", "square#2", "node5"]
    assert [m.world_vertices[0, 0] for m in scene.meshes[:3]] == [0, 1, 2]


def test_only_the_default_scene_is_loaded(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(), name="wanted")
    builder.node(mesh=builder.quad(), name="other", root=False)
    builder.json["scenes"].insert(0, {"nodes": [1]})
    builder.json["scene"] = 1
    scene = load(builder, tmp_path)
    assert [m.name for m in scene.meshes] == ["wanted"]
    assert "2 scenes: only the default one is loaded" in scene.warnings


LISTED = "the scene lists nodes that are children of others: each stands once, below its parent"


@pytest.mark.parametrize("listed", [[0, 1, 2], [2, 1, 0], [1, 0, 1], [2, 0]])
def test_children_that_the_scene_lists_stand_once_below_their_parent(tmp_path, listed):
    builder = GltfBuilder()
    builder.node(children=[1], translation=[1, 0, 0], name="top")
    builder.node(children=[2], translation=[0, 1, 0], name="middle", root=False)
    builder.node(mesh=builder.quad(), translation=[0, 0, 1], name="square", root=False)
    builder.json["scenes"][0]["nodes"] = listed
    scene = load(builder, tmp_path)
    (mesh,) = scene.meshes
    np.testing.assert_array_equal(mesh.world_vertices[0], (1, 1, 1))
    assert [node.name for node in scene.nodes] == ["top", "middle", "square"]
    (warning,) = (w for w in scene.warnings if w.startswith(LISTED))
    assert "(node " in warning


def test_a_listed_child_whose_parent_is_not_in_the_scene_stands_without_it(tmp_path):
    builder = GltfBuilder()
    builder.node(children=[1], translation=[1, 0, 0], name="elsewhere", root=False)
    builder.node(mesh=builder.quad(), translation=[0, 0, 1], name="square")
    scene = load(builder, tmp_path)
    np.testing.assert_array_equal(scene.meshes[0].world_vertices[0], (0, 0, 1))
    assert any(w.startswith(LISTED) for w in scene.warnings)


@pytest.mark.timeout(30)
def test_a_long_chain_of_which_every_node_is_listed(tmp_path):
    """Took time with the square of the length where each was followed to its root."""
    builder = GltfBuilder()
    count = 20_000
    for k in range(count):
        builder.node(children=[k + 1])
    builder.node(mesh=builder.quad(), name="square")
    assert len(load(builder, tmp_path).nodes) == count + 1


def test_without_scenes_every_root_is_loaded(tmp_path):
    builder = GltfBuilder()
    child = builder.node(mesh=builder.quad(), translation=[0, 0, 1])
    builder.node(children=[child], translation=[0, 0, 2])
    del builder.json["scenes"], builder.json["scene"]
    (mesh,) = load(builder, tmp_path).meshes
    assert mesh.world_vertices[0, 2] == 3


def test_degenerate_triangles_are_kept_and_told(tmp_path):
    builder = GltfBuilder()
    indices = builder.accessor(np.array([0, 1, 2, 0, 0, 1], np.uint8))
    builder.node(mesh=builder.mesh({"attributes": {"POSITION": builder.accessor(QUAD)}, "indices": indices}))
    scene = load(builder, tmp_path)
    assert scene.info()["triangles"] == 2
    assert "1 of 2 triangles have no area" in scene.warnings


def test_skin_and_morph_targets_stand_as_authored(tmp_path):
    builder = GltfBuilder()
    position = builder.accessor(QUAD)
    moved = builder.accessor(QUAD + np.float32(9))
    primitive = {"attributes": {"POSITION": position}, "mode": 6, "targets": [{"POSITION": moved}]}
    builder.node(mesh=builder.mesh(primitive, weights=[1.0]), skin=0, name="body")
    builder.json["skins"] = [{"joints": [0]}]
    builder.json["animations"] = [{"channels": [], "samplers": []}]
    scene = load(builder, tmp_path)
    np.testing.assert_array_equal(scene.meshes[0].world_vertices, QUAD)
    text = "\n".join(scene.warnings)
    for word in ("morph targets", "skins", "animations"):
        assert word in text


def test_a_chain_of_nodes_longer_than_the_call_stack(tmp_path):
    builder = GltfBuilder()
    depth = 5000
    builder.node(mesh=builder.quad(), translation=[1, 0, 0], root=False)
    for k in range(depth):
        builder.node(children=[k], translation=[1, 0, 0], root=k == depth - 1)
    (mesh,) = load(builder, tmp_path).meshes
    assert mesh.world_vertices[0, 0] == depth + 1


def test_instancing_beyond_memory_is_refused_before_allocating(tmp_path, monkeypatch):
    builder = GltfBuilder()
    quad = builder.quad()
    for _ in range(1000):
        builder.node(mesh=quad)
    monkeypatch.setattr("deltalux.io.scene_size.available_memory", lambda: 1_000_000)
    with pytest.raises(dl.SceneError, match=r"scene\.glb: scene: found 2,000 triangles .* need 1 MiB"):
        load(builder, tmp_path)


finite = st.floats(-3, 3)
scales = st.floats(0.1, 3).flatmap(lambda v: st.sampled_from([v, -v]))
transforms = st.fixed_dictionaries(
    {
        "translation": st.tuples(finite, finite, finite),
        "rotation": st.tuples(finite, finite, finite, st.floats(0.1, 3)),
        "scale": st.tuples(scales, scales, scales),
    }
)


@settings(max_examples=examples(60))
@given(chain=st.lists(transforms, min_size=1, max_size=4), movable_at=st.integers(0, 4))
def test_random_hierarchies(tmp_path_factory, chain, movable_at):
    """World triangles, their fronts and the node records agree with an independent composition."""
    builder = GltfBuilder()
    world = np.eye(4)
    for k, t in enumerate(chain):
        local = np.eye(4)
        local[:3, :3] = Rotation.from_quat(t["rotation"]).as_matrix() * t["scale"]
        local[:3, 3] = t["translation"]
        world = world @ local
        fields = {key: list(value) for key, value in t.items()}
        last = k == len(chain) - 1
        fields |= {"mesh": builder.quad()} if last else {"children": [k + 1]}
        builder.node(root=k == 0, name=f"n{k}", extras={"movable": k == movable_at}, **fields)
    scene = load(builder, tmp_path_factory.mktemp("gltf"))
    (mesh,) = scene.meshes
    expected = QUAD @ world[:3, :3].T + world[:3, 3]
    np.testing.assert_allclose(mesh.world_vertices, expected, atol=1e-9)
    # The front of the quad is the image of +Z's side; its area grows by the cofactors.
    front = abs(np.linalg.det(world[:3, :3])) * np.linalg.inv(world[:3, :3]).T @ (0, 0, 1)
    np.testing.assert_allclose(normals(mesh).sum(axis=0), front, atol=1e-9)
    assert mesh.movable == (movable_at < len(chain))
    node = scene.nodes[-1]
    assert node.parts == ((mesh.name, 0, 2),)
    np.testing.assert_allclose(
        np.linalg.multi_dot([n.matrix for n in scene.nodes] + [np.eye(4)]), world, atol=1e-9
    )
