# SPDX-License-Identifier: Apache-2.0
"""Draco and meshopt: the same geometry as uncompressed, and one clear error for whatever is wrong."""

import sys

import deltalux as dl
import numpy as np
import pygltflib
import pytest
from builders.gltf import QUAD, QUAD_TRIANGLES, WIDTH_NAME, GltfBuilder, png
from deltalux import outputs
from deltalux.io.decoding import process
from deltalux.outputs.of_session import baked_of

DracoPy = pytest.importorskip("DracoPy")
meshoptimizer = pytest.importorskip("meshoptimizer")

DRACO, MESHOPT = "KHR_draco_mesh_compression", "EXT_meshopt_compression"
AREA = pytest.approx(1, abs=1e-3)


def draco_builder(required=True):
    """The square, by Draco."""
    data = DracoPy.encode(QUAD, QUAD_TRIANGLES.reshape(-1, 3).astype(np.uint32), preserve_order=True)
    position = next(a["unique_id"] for a in DracoPy.decode(data).attributes if a["attribute_type"] == 0)
    builder = GltfBuilder()
    builder.use(DRACO, required=required)
    accessors = builder.json["accessors"]
    accessors.append({"componentType": 5126, "count": 4, "type": "VEC3"})
    accessors.append({"componentType": 5123, "count": 6, "type": "SCALAR"})
    extension = {"bufferView": builder.view(data), "attributes": {"POSITION": position}}
    mesh = builder.mesh({"attributes": {"POSITION": 0}, "indices": 1, "extensions": {DRACO: extension}})
    builder.node(mesh=mesh, name="floor")
    return builder


class MeshoptBuilder(GltfBuilder):
    """Compressed views, whose plain bytes would be in a fallback buffer that has no data."""

    def __init__(self, required=True):
        super().__init__()
        self.plain = 0
        self.use(MESHOPT, required=required)
        self.use("KHR_mesh_quantization", required=required)

    def compressed(self, data, mode, count, stride, **fields):
        """Append a view that `data` unfold to."""
        first = self.json["bufferViews"].pop(self.view(data))["byteOffset"]
        extension = {"buffer": 0, "byteOffset": first, "byteLength": len(data), "byteStride": stride}
        view = {"buffer": 1, "byteOffset": self.plain, "byteLength": count * stride}
        view["extensions"] = {MESHOPT: extension | {"mode": mode, "count": count, **fields}}
        self.plain += count * stride
        return self._append("bufferViews", view)

    def attributes(self, values, component, normalized=False, **fields):
        """Append an accessor over the rows of `values`."""
        view = self.compressed(
            meshoptimizer.encode_vertex_buffer(values),
            "ATTRIBUTES",
            len(values),
            values.strides[0],
            **fields,
        )
        self.json["bufferViews"][view]["byteStride"] = values.strides[0]
        accessor = {"bufferView": view, "componentType": component, "count": len(values), "type": "VEC3"}
        return self._append("accessors", accessor | {"normalized": normalized})

    def corners(self, mode="TRIANGLES", stride=2):
        """Append an accessor over the square's corners."""
        encode = {
            "TRIANGLES": meshoptimizer.encode_index_buffer,
            "INDICES": meshoptimizer.encode_index_sequence,
        }[mode]
        view = self.compressed(encode(QUAD_TRIANGLES.astype(np.uint32), 6, 4), mode, 6, stride)
        component = {2: 5123, 4: 5125}[stride]
        return self._append(
            "accessors", {"bufferView": view, "componentType": component, "count": 6, "type": WIDTH_NAME[1]}
        )

    def square(self, position, indices):
        """Append the node; returns the builder."""
        self.node(mesh=self.mesh({"attributes": {"POSITION": position}, "indices": indices}), name="floor")
        return self

    def glb(self):
        fallback = {"byteLength": max(1, self.plain), "extensions": {MESHOPT: {"fallback": True}}}
        self.json["buffers"] = [{"byteLength": len(self.data) + -len(self.data) % 4}, fallback]
        return super().glb()


def meshopt_builder(mode="TRIANGLES", stride=2, **options):
    """The square, its positions as floats."""
    builder = MeshoptBuilder(**options)
    return builder.square(builder.attributes(QUAD, 5126), builder.corners(mode, stride))


def refuse(builder, tmp_path, *parts):
    path = builder.write(tmp_path)
    with pytest.raises(dl.FormatError) as error:
        dl.load(path)
    for part in parts:
        assert part in str(error.value), str(error.value)


def assert_square(scene):
    (mesh,) = scene.meshes
    assert mesh.triangle_areas().sum() == AREA
    corners = mesh.world_vertices[mesh.triangles]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0.1).all()
    assert not [warning for warning in scene.warnings if "compression" in warning]


def test_draco(tmp_path):
    assert_square(dl.load(draco_builder().write(tmp_path)))


UV = np.array([[0, 0], [1, 0], [0.75, 1], [0, 0.5]], np.float32)


def with_texture(builder, coordinates, primitive):
    """Give a primitive a picture, and texture coordinates by an accessor."""
    pbr = {"baseColorTexture": {"index": builder.texture(png(np.full((2, 2, 3), 99, np.uint8)))}}
    primitive |= {"material": builder.material(pbrMetallicRoughness=pbr)}
    primitive["attributes"]["TEXCOORD_0"] = coordinates


@pytest.mark.parametrize("also", [True, False])
def test_draco_texture_coordinates(tmp_path, also):
    builder = draco_builder()
    (mesh,) = builder.json["meshes"]
    (primitive,) = mesh["primitives"]
    faces, options = QUAD_TRIANGLES.reshape(-1, 3).astype(np.uint32), {"preserve_order": True}
    data = DracoPy.encode(QUAD, faces, tex_coord=UV.astype(np.float64), **options)
    ids = {a["attribute_type"]: a["unique_id"] for a in DracoPy.decode(data).attributes}
    attributes = {"POSITION": ids[0]} | ({"TEXCOORD_0": ids[3]} if also else {})
    primitive["extensions"][DRACO] = {"bufferView": builder.view(data), "attributes": attributes}
    builder.json["accessors"].append({"componentType": 5126, "count": 4, "type": "VEC2"})
    with_texture(builder, 2, primitive)
    (square,) = dl.load(builder.write(tmp_path)).meshes
    if also:
        np.testing.assert_allclose(square.coordinates, UV[QUAD_TRIANGLES].reshape(2, 3, 2), atol=1e-3)
    else:
        assert square.coordinates is None
    primitive["extensions"][DRACO]["attributes"]["TEXCOORD_0"] = ids[0]
    refuse(builder, tmp_path, "TEXCOORD_0 of shape (4, 3), expected two numbers for each of 4 vertices")


def test_meshopt_texture_coordinates(tmp_path):
    builder = meshopt_builder()
    coordinates = builder.attributes(UV, 5126)
    builder.json["accessors"][coordinates]["type"] = "VEC2"
    with_texture(builder, coordinates, builder.json["meshes"][0]["primitives"][0])
    (square,) = dl.load(builder.write(tmp_path)).meshes
    np.testing.assert_array_equal(square.coordinates, UV[QUAD_TRIANGLES].reshape(2, 3, 2))


@pytest.mark.parametrize("mode", ["TRIANGLES", "INDICES"])
@pytest.mark.parametrize("stride", [2, 4])
def test_meshopt(tmp_path, mode, stride):
    assert_square(dl.load(meshopt_builder(mode, stride).write(tmp_path)))


def test_meshopt_with_quantized_positions(tmp_path):
    builder = MeshoptBuilder()
    rows = np.zeros((4, 4), np.int16)
    rows[:, :3] = np.rint(32767 * QUAD)
    builder.square(builder.attributes(rows, 5122, normalized=True), builder.corners())
    assert_square(dl.load(builder.write(tmp_path)))


def test_the_exponential_filter(tmp_path):
    """A mantissa of 24 bits below an exponent of 8, each of two's complement."""
    builder = MeshoptBuilder()
    mantissa, exponent = (QUAD * 1000).astype(np.int32), -10
    rows = np.uint32((exponent & 0xFF) << 24) | (mantissa & 0xFFFFFF).astype(np.uint32)
    builder.square(builder.attributes(rows, 5126, filter="EXPONENTIAL"), builder.corners())
    area = dl.load(builder.write(tmp_path)).meshes[0].triangle_areas().sum()
    assert area == pytest.approx((1000 / 1024) ** 2)


def test_the_octahedral_filter(tmp_path):
    builder = MeshoptBuilder()
    rows = np.array([(64, 0, 127, 0), (0, 64, 127, 0), (-64, 0, 127, 0), (0, -64, 127, 0)], np.int8)
    position = builder.attributes(rows, 5120, normalized=True, filter="OCTAHEDRAL")
    (mesh,) = dl.load(builder.square(position, builder.corners()).write(tmp_path)).meshes
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(1, abs=0.02)


def test_the_quaternion_filter(tmp_path):
    builder = MeshoptBuilder()
    rows = np.array([(0, 0, 0, 2047 << 2 | k) for k in range(4)], np.int16)
    position = builder.attributes(rows, 5122, normalized=True, filter="QUATERNION")
    (mesh,) = dl.load(builder.square(position, builder.corners()).write(tmp_path)).meshes
    assert sorted(np.linalg.norm(mesh.vertices, axis=1).round(3).tolist()) == [0, 1, 1, 1]


def test_plain_data_are_preferred(tmp_path):
    builder = draco_builder(required=False)
    builder.json["meshes"][0]["primitives"][0] |= {
        "attributes": {"POSITION": builder.accessor(QUAD)},
        "indices": builder.accessor(QUAD_TRIANGLES),
    }
    builder.json["meshes"][0]["primitives"][0]["extensions"][DRACO]["bufferView"] = 99
    assert_square(dl.load(builder.write(tmp_path)))


@pytest.mark.parametrize("make", [draco_builder, meshopt_builder])
@pytest.mark.parametrize("required", [True, False])
def test_without_the_extra_the_error_names_it(tmp_path, monkeypatch, make, required):
    monkeypatch.setattr(process, "find_spec", lambda name: None)
    refuse(make(required=required), tmp_path, "deltalux[compressed], or export the file without compression")


@pytest.mark.parametrize("make", [draco_builder, meshopt_builder])
def test_a_lit_mesh_is_not_compressed(tmp_path, make):
    scene = dl.load(make().write(tmp_path))
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=0.5), paths=100) as session:
        session.bake()
        outputs.write(tmp_path / "lit.glb", baked_of(session, "test"))
    document = pygltflib.GLTF2().load(tmp_path / "lit.glb")
    assert document.extensionsUsed == ["KHR_materials_unlit"]
    assert not document.extensionsRequired
    assert_square(dl.load(tmp_path / "lit.glb"))


def meshopt_of(builder):
    return builder.json["bufferViews"][0]["extensions"][MESHOPT]


MESHOPT_FAULTS = {
    "mode": ({"mode": "LINES"}, "mode: found 'LINES', expected ATTRIBUTES, TRIANGLES or INDICES"),
    "filter": ({"filter": "BOX"}, "filter: found 'BOX', expected one of NONE, OCTAHEDRAL"),
    "filter of another stride": ({"filter": "QUATERNION"}, "byteStride: found 12, expected one of 8"),
    "stride": ({"byteStride": 13}, "byteStride: found 13, expected one of 4, 8, 12"),
    "stride 0": ({"byteStride": 0}, "byteStride: found 0"),
    "count": ({"count": 5}, "count: found 5 elements of 12 bytes, expected the 48 bytes of the view"),
    "no count": ({"count": None}, 'found no "count", expected it to be there'),
    "huge count": ({"count": 2**52}, "elements of 12 bytes, expected the 48 bytes of the view"),
    "negative count": ({"count": -1}, "count: found -1"),
    "buffer": ({"buffer": 7}, "buffer: found 7"),
    "beyond the buffer": ({"byteOffset": 4000}, "bytes 4000 to"),
    "no data": ({"byteLength": 0}, "found 0 bytes for 4 elements of 12, expected more compressed data"),
    "truncated": ({"byteLength": 20}, "found compressed data that cannot be decoded (RuntimeError"),
    "indices instead": ({"mode": "INDICES", "byteStride": 4, "count": 12}, "byteStride: found 4"),
}


@pytest.mark.parametrize(("change", "text"), MESHOPT_FAULTS.values(), ids=MESHOPT_FAULTS)
def test_broken_meshopt_is_refused(tmp_path, change, text):
    builder = meshopt_builder()
    meshopt_of(builder).update(change)
    refuse(builder, tmp_path, f"bufferViews[0].extensions.{MESHOPT}", text)


def test_meshopt_that_unfolds_to_more_than_its_bytes_can_hold_is_refused(tmp_path):
    builder = meshopt_builder()
    meshopt_of(builder).update(count=10**9)
    builder.json["bufferViews"][0]["byteLength"] = 12 * 10**9
    builder.json["accessors"][0]["count"] = 10**9
    refuse(builder, tmp_path, "for 1000000000 elements of 12, expected more compressed data")


DRACO_FAULTS = {
    "fewer vertices": (lambda j: j["accessors"][0].update(count=3), "2 triangles and 3 vertices as its"),
    "more triangles": (
        lambda j: j["accessors"][1].update(count=9),
        "positions of shape (4, 3), expected 3",
    ),
    "another attribute": (
        lambda j: j["meshes"][0]["primitives"][0]["extensions"][DRACO]["attributes"].update(POSITION=44),
        "cannot be decoded (ValueError: no attribute 44)",
    ),
    "no attribute": (
        lambda j: j["meshes"][0]["primitives"][0]["extensions"][DRACO].update(attributes={}),
        "attributes: found no POSITION",
    ),
    "nothing": (
        lambda j: j["meshes"][0]["primitives"][0].update(extensions={DRACO: {}}),
        f'extensions.{DRACO}: found no "bufferView"',
    ),
    "no indices": (
        lambda j: j["meshes"][0]["primitives"][0].pop("indices"),
        "expected indexed triangles",
    ),
    "a strip": (lambda j: j["meshes"][0]["primitives"][0].update(mode=5), "compressed data, mode 5"),
    "truncated": (
        lambda j: j["bufferViews"][0].update(byteLength=30),
        "cannot be decoded (FileType",
    ),
    "no view": (
        lambda j: j["meshes"][0]["primitives"][0]["extensions"][DRACO].update(bufferView=5),
        "bufferView: found 5",
    ),
}


@pytest.mark.parametrize(("change", "text"), DRACO_FAULTS.values(), ids=DRACO_FAULTS)
def test_broken_draco_is_refused(tmp_path, change, text):
    builder = draco_builder()
    change(builder.json)
    refuse(builder, tmp_path, text)


def test_huge_declared_counts_are_refused_before_decoding(tmp_path, monkeypatch):
    monkeypatch.setattr(process.DecoderProcess, "decode", lambda *_: pytest.fail("it was decoded"))
    builder = draco_builder()
    builder.json["accessors"][1]["count"] = 3 * 10**12
    with pytest.raises(dl.SceneError, match="1,000,000,000,000 triangles after instancing, which need"):
        dl.load(builder.write(tmp_path))


@pytest.mark.parametrize("make", [draco_builder, meshopt_builder])
def test_any_changed_byte_gives_a_scene_or_one_error(tmp_path, make):
    """Each kind of byte of the streams' headers and bodies; a crash of a decoder would be an error, too."""
    random = np.random.default_rng(7)
    for position in random.permutation(len(make().data))[:25]:
        builder = make()
        builder.data[position] = random.integers(256)
        try:
            dl.load(builder.write(tmp_path))
        except dl.Error as error:
            assert str(error).startswith("scene.glb: ")


@pytest.mark.parametrize(
    ("program", "text"),
    [
        ("import os; os.abort()", "the decoder ended, with code -6"),
        ("import time; time.sleep(60)", "the decoder ended, with code -9"),
        ("import sys; sys.stdout.write('x' * 999)", "bytes, more than are declared"),
    ],
)
def test_a_decoder_that_crashes_hangs_or_babbles_is_one_error(tmp_path, monkeypatch, program, text):
    worker = tmp_path / "worker.py"
    worker.write_text(f"import sys\nsys.stdin.buffer.read(1)\n{program}\n")
    monkeypatch.setattr(process, "WORKER", worker)
    monkeypatch.setattr(process, "BASE_SECONDS", 2.0)
    refuse(draco_builder(), tmp_path, f"cannot be decoded ({text}" if "decoder" in text else text)


def test_a_decoder_that_cannot_be_started_is_one_error(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    refuse(draco_builder(), tmp_path, "compressed geometry: its decoder cannot be started")
