# SPDX-License-Identifier: Apache-2.0
"""Malformed glTF: one clear FormatError with file, place, found and expected; nothing read elsewhere."""

import gc
import json
import os
import struct

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD, QUAD_TRIANGLES, GltfBuilder
from deltalux.io.decoding import process


@pytest.fixture(autouse=True)
def no_decoders(monkeypatch):
    """The package without its extra for compressed geometry."""
    monkeypatch.setattr(process, "find_spec", lambda name: None)


def valid():
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(), name="floor")
    return builder


def refuse(path, *parts):
    with pytest.raises(dl.FormatError) as error:
        dl.load(path)
    message = str(error.value)
    assert message.startswith(f"{path.name}: ")
    for part in parts:
        assert part in message, message
    return message


def test_the_base_of_all_these_is_valid(tmp_path):
    assert dl.load(valid().write(tmp_path)).info()["triangles"] == 2


# Each entry changes the valid file's JSON; the message must contain the texts.
BROKEN_JSON = {
    "index beyond the vertices": (
        lambda j: j["accessors"][0].update(count=3),
        ["accessors[1]: found vertex index 3, expected an index below 3"],
    ),
    "count beyond the view": (
        lambda j: j["accessors"][0].update(count=4_000_000_000),
        ["accessors[0]: found 4000000000 elements", "expected at most the view's 48 bytes"],
    ),
    "huge count without a view": (
        lambda j: (j["accessors"][0].pop("bufferView"), j["accessors"][0].update(count=10**12)),
        ["accessors[0]: found 1000000000000 elements without a buffer view"],
    ),
    "offset beyond the view": (
        lambda j: j["accessors"][0].update(byteOffset=1),
        ["accessors[0]", "expected at most the view's 48 bytes"],
    ),
    "view beyond the buffer": (
        lambda j: j["bufferViews"][1].update(byteLength=9999),
        ["bufferViews[1]: found bytes 48 to 10047, expected at most the buffer's 60 bytes"],
    ),
    "stride below the element": (
        lambda j: j["bufferViews"][0].update(byteStride=4),
        ["bufferViews[0].byteStride: found 4, expected at least 12"],
    ),
    "corners not in threes": (
        lambda j: j["accessors"][1].update(count=5),
        ["meshes[0].primitives[0]: found 5 corners, expected a multiple of 3"],
    ),
    "signed indices": (
        lambda j: j["accessors"][1].update(componentType=5122),
        ["accessors[1]: found type SCALAR of component type 5122"],
    ),
    "positions of two": (
        lambda j: j["accessors"][0].update(type="VEC2"),
        ["accessors[0]: found type VEC2 of component type 5126, expected VEC3"],
    ),
    "unknown component type": (
        lambda j: j["accessors"][0].update(componentType=5130),
        ["accessors[0].componentType: found 5130"],
    ),
    "unknown mode": (
        lambda j: j["meshes"][0]["primitives"][0].update(mode=7),
        ["meshes[0].primitives[0].mode: found 7"],
    ),
    "no POSITION": (
        lambda j: j["meshes"][0]["primitives"][0].update(attributes={"NORMAL": 0}),
        ["meshes[0].primitives[0].attributes: found no POSITION"],
    ),
    "accessor out of range": (
        lambda j: j["meshes"][0]["primitives"][0].update(indices=2),
        ["meshes[0].primitives[0].indices: found 2, expected an index below 2"],
    ),
    "material out of range": (
        lambda j: j["meshes"][0]["primitives"][0].update(material=0),
        ["meshes[0].primitives[0].material: found 0, expected an index below 0"],
    ),
    "mesh out of range": (lambda j: j["nodes"][0].update(mesh=1), ["nodes[0].mesh: found 1"]),
    "buffer out of range": (
        lambda j: j["bufferViews"][0].update(buffer=1),
        ["bufferViews[0].buffer: found 1"],
    ),
    "child out of range": (lambda j: j["nodes"][0].update(children=[5]), ["nodes[0].children: found 5"]),
    "scene out of range": (lambda j: j.update(scene=1), ["scene: found 1"]),
    "root out of range": (lambda j: j["scenes"][0].update(nodes=[3]), ["scenes[0].nodes: found 3"]),
    "node its own child": (
        lambda j: j["nodes"][0].update(children=[0]),
        ["scenes[0].nodes: found node 0, which is its own ancestor, expected nodes without cycles"],
    ),
    "cycle of three": (
        lambda j: j.update(nodes=[{"children": [1]}, {"children": [2]}, {"children": [0]}]),
        ["found node 0, which is its own ancestor"],
    ),
    "root below a cycle": (
        lambda j: j.update(nodes=[{}, {"children": [0, 2]}, {"children": [1]}]),
        ["found node 1, which is its own ancestor"],
    ),
    "two parents": (
        lambda j: j.update(nodes=[{"children": [2]}, {"children": [2]}, {}]),
        ["nodes[2]: found a child of both node 0 and node 1, expected one parent"],
    ),
    "negative number": (lambda j: j["nodes"][0].update(mesh=-1), ["nodes[0].mesh: found -1"]),
    "fraction": (lambda j: j["nodes"][0].update(mesh=0.5), ["nodes[0].mesh: found 0.5"]),
    "truth for a number": (lambda j: j["nodes"][0].update(mesh=False), ["nodes[0].mesh: found False"]),
    "text for a number": (lambda j: j["nodes"][0].update(mesh="0"), ["nodes[0].mesh: found '0'"]),
    "object for a list": (
        lambda j: j.update(nodes={"a": {}}),
        ["nodes: found {'a': {}}, expected a list"],
    ),
    "number for an object": (lambda j: j.update(nodes=[5]), ["nodes[0]: found 5, expected an object"]),
    "null in a list": (lambda j: j.update(nodes=[None]), ["nodes[0]: found None"]),
    "short vector": (
        lambda j: j["nodes"][0].update(scale=[1, 1]),
        ["found [1, 1], expected a list of 3"],
    ),
    "infinite number": (lambda j: j["nodes"][0].update(scale=[1, 1, 1e999]), ["number Infinity"]),
    "endless number": (
        lambda j: j["nodes"][0].update(translation=[0, 0, 10**300]),
        ["nodes[0].translation[2]", "expected a finite number"],
    ),
    "no rotation": (lambda j: j["nodes"][0].update(rotation=[0, 0, 0, 0]), ["nodes[0].rotation"]),
    "perspective matrix": (
        lambda j: j["nodes"][0].update(matrix=[1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
        ["nodes[0].matrix: found last row [1.0, 0.0, 0.0, 1.0], expected [0, 0, 0, 1]"],
    ),
    "no asset": (lambda j: j.pop("asset"), ["asset.version: found None"]),
    "version 1": (
        lambda j: j["asset"].update(version="1.0"),
        ["asset.version: found '1.0'"],
    ),
    "later version": (lambda j: j["asset"].update(minVersion="2.1"), ["2.1"]),
    "unknown extension": (
        lambda j: j.update(extensionsRequired=["VENDOR_future"]),
        ['extension "VENDOR_future": the file requires it'],
    ),
    "another required": (
        lambda j: j.update(extensionsRequired=["EXT_mesh_manifold"]),
        ['extension "EXT_mesh_manifold": the file requires it', "expected only EXT_mesh_gpu_instancing, "],
    ),
    "Draco": (
        lambda j: j.update(extensionsRequired=["KHR_draco_mesh_compression"]),
        ["extension KHR_draco_mesh_compression: found compressed geometry", "deltalux[compressed]"],
    ),
    "meshopt": (
        lambda j: j.update(extensionsRequired=["EXT_meshopt_compression"]),
        ["extension EXT_meshopt_compression: found compressed geometry"],
    ),
}


@pytest.mark.parametrize("case", BROKEN_JSON)
def test_broken_json(tmp_path, case):
    change, parts = BROKEN_JSON[case]
    builder = valid()
    builder.json = json.loads(json.dumps(builder.json))
    builder.json["buffers"] = [{"byteLength": len(builder.data)}]
    change(builder.json)
    refuse(builder.write(tmp_path), *parts)


def test_draco_that_is_not_declared_as_required(tmp_path):
    builder = valid()
    builder.json["meshes"][0]["primitives"][0]["extensions"] = {
        "KHR_draco_mesh_compression": {"bufferView": 0}
    }
    for accessor in builder.json["accessors"]:
        del accessor["bufferView"]
    refuse(
        builder.write(tmp_path), "data compressed by KHR_draco_mesh_compression only", "deltalux[compressed]"
    )


def test_meshopt_whose_fallback_has_no_data(tmp_path):
    builder = valid()
    builder.json["buffers"] = [{"byteLength": 60}, {"byteLength": 100}]
    view = builder.json["bufferViews"][0]
    view["buffer"] = 1
    view["extensions"] = {"EXT_meshopt_compression": {"buffer": 0}}
    refuse(builder.write(tmp_path), "buffers[1]: found data compressed by EXT_meshopt_compression only")


def test_optional_compression_beside_plain_data_is_a_warning(tmp_path):
    builder = valid()
    builder.use("EXT_meshopt_compression")
    builder.json["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {"buffer": 0}}
    (warning,) = (w for w in dl.load(builder.write(tmp_path)).warnings if "meshopt" in w)
    assert "uncompressed data are read instead" in warning


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_positions_that_are_not_finite(tmp_path, value):
    builder = GltfBuilder()
    points = QUAD.copy()
    points[2, 1] = value
    builder.node(mesh=builder.mesh({"attributes": {"POSITION": builder.accessor(points)}, "mode": 6}))
    refuse(builder.write(tmp_path), "accessors[0]: found", "at vertex 2, expected finite positions")


def test_transforms_that_overflow(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(), scale=[1e30] * 3, root=False)
    for k in range(20):
        builder.node(children=[k], scale=[1e30] * 3, root=k == 19)
    refuse(builder.write(tmp_path), "found a world transform beyond float64")


def sparse(builder, indices, count=None):
    values = np.zeros((len(indices), 3), np.float32)
    return {
        "count": len(indices) if count is None else count,
        "indices": {
            "bufferView": builder.view(np.array(indices, np.uint16).tobytes()),
            "componentType": 5123,
        },
        "values": {"bufferView": builder.view(values.tobytes())},
    }


@pytest.mark.parametrize(
    ("indices", "count", "message"),
    [
        ([0, 9], None, "accessors[0].sparse.indices: found indices that repeat, fall, or reach beyond"),
        ([2, 1], None, "accessors[0].sparse.indices"),
        ([1, 1], None, "accessors[0].sparse.indices"),
        ([0, 1], 5, "accessors[0].sparse.count: found 5, expected at most the accessor's count 4"),
        ([0], 3, "accessors[0].sparse.indices: found 3 elements up to byte 6"),
    ],
)
def test_sparse_accessors(tmp_path, indices, count, message):
    builder = valid()
    builder.json["accessors"][0]["sparse"] = sparse(builder, indices, count)
    refuse(builder.write(tmp_path), message)


@pytest.mark.parametrize("length", [0, 3, 11, 19, 100, 400])
def test_truncated_glb(tmp_path, length):
    path = tmp_path / "cut.glb"
    path.write_bytes(valid().glb()[:length])
    refuse(path, "truncated" if length > 11 else "found")


def test_every_truncation_is_refused(tmp_path):
    data = valid().glb()
    path = tmp_path / "cut.glb"
    for length in range(0, len(data), 7):
        path.write_bytes(data[:length])
        refuse(path)


JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942


def glb_with(text, *, version=2, kind=JSON_CHUNK, size=None):
    size = len(text) if size is None else size
    return b"glTF" + struct.pack("<IIII", version, 20 + len(text), size, kind) + text


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "text that is no JSON"),
        (b"\xff\xfe\x00", "text that is no JSON"),
        (b"[]", "JSON: found [], expected an object"),
        (b'{"asset": {"version": "2.0"}, "nodes": [{"scale": [NaN, 1, 1]}]}', "the number NaN"),
        (b"[" * 100_000, "JSON: found"),  # deeply nested, or from Python 3.13 on cut off
        (b'{"asset": ' * 5000, "deeply nested"),
        (b'{"scene": ' + b"9" * 5000 + b"}", "text that is no JSON"),
        (glb_with(b"{}", version=1), "GLB header: found version 1, expected version 2"),
        (glb_with(b"{}", kind=BINARY_CHUNK), "expected a JSON chunk"),
        (glb_with(b"{}", size=2**31), "GLB chunk 0: found 2147483648 bytes"),
    ],
)
def test_files_that_are_no_gltf(tmp_path, data, message):
    path = tmp_path / "scene.gltf"
    path.write_bytes(data)
    refuse(path, message)


def external(tmp_path, uri):
    folder = tmp_path / "scene"
    folder.mkdir(exist_ok=True)
    path = folder / "scene.gltf"
    path.write_bytes(valid().gltf(uri))
    return path


def test_absent_buffer_is_named(tmp_path):
    refuse(external(tmp_path, "gone.bin"), 'buffers[0]: found no file "gone.bin" in', "restore it")


def test_short_buffer(tmp_path):
    path = external(tmp_path, "short.bin")
    (path.parent / "short.bin").write_bytes(b"\0" * 10)
    refuse(path, "buffers[0]: found 10 bytes, expected 60")


@pytest.mark.parametrize(
    "uri", ["../secret.bin", "a/../../secret.bin", "..%2fsecret.bin", "%2e%2e/secret.bin", "./../secret.bin"]
)
def test_no_path_leads_out_of_the_folder(tmp_path, uri):
    (tmp_path / "secret.bin").write_bytes(valid().data)
    path = external(tmp_path, uri)
    (path.parent / "a").mkdir()
    refuse(path, "leads out of the file's folder")


@pytest.mark.parametrize(
    "uri",
    [
        "{absolute}",
        "file://{absolute}",
        "http://localhost/x.bin",
        "https://localhost/x.bin",
        "C:\\x.bin",
        "\\\\server\\x.bin",
        "%2f{absolute}",
        "a\0b.bin",
        "a%00b.bin",
        "bad\udcff.bin",
    ],
)
def test_addresses_and_absolute_paths_are_refused(tmp_path, uri):
    secret = tmp_path / "secret.bin"
    secret.write_bytes(valid().data)
    refuse(
        external(tmp_path, uri.format(absolute=secret)), "expected a relative path below the file's folder"
    )


def test_symbolic_links_do_not_lead_out_but_may_stay_inside(tmp_path):
    secret = tmp_path / "secret.bin"
    secret.write_bytes(valid().data)
    path = external(tmp_path, "link.bin")
    link = path.parent / "link.bin"
    link.symlink_to(secret)
    refuse(path, "leads out of the file's folder")
    link.unlink()
    link.symlink_to("link.bin")
    refuse(path, "buffers[0]")
    link.unlink()
    (path.parent / "real.bin").write_bytes(valid().data)
    link.symlink_to("real.bin")
    assert dl.load(path).info()["triangles"] == 2


@pytest.mark.timeout(20)
def test_pipes_and_folders_are_not_read(tmp_path):
    path = external(tmp_path, "pipe.bin")
    os.mkfifo(path.parent / "pipe.bin")
    refuse(path, '"pipe.bin", which is no regular file')
    refuse(external(tmp_path, "."), "no regular file")
    pipe = tmp_path / "scene.glb"
    os.mkfifo(pipe)
    refuse(pipe, "no regular file")


def test_only_the_declared_part_of_a_buffer_is_read(tmp_path):
    path = external(tmp_path, "long.bin")
    with (path.parent / "long.bin").open("wb") as file:
        file.write(valid().data)
        file.truncate(1 << 40)  # a sparse file of a terabyte
    assert dl.load(path).info()["triangles"] == 2


@pytest.mark.parametrize("uri", ["data:application/octet-stream;base64", "data:;base64,####=", "data:,short"])
def test_bad_data_uris(tmp_path, uri):
    refuse(external(tmp_path, uri), "buffers[0]")


def test_absent_file_and_unknown_suffix(tmp_path):
    refuse(tmp_path / "none.glb", 'file: found no file "none.glb"')
    with pytest.raises(dl.OptionError, match=r'found suffix "\.fbx", expected one of \.gltf, \.glb, \.obj'):
        dl.load(tmp_path / "scene.fbx")


def test_json_beyond_memory_is_refused_before_it_is_parsed(tmp_path, monkeypatch):
    path = tmp_path / "scene.gltf"
    path.write_bytes(b"[" + b"[]," * 100_000 + b"[]]")
    refuse(path, "expected an object")
    monkeypatch.setattr("deltalux.io.scene_size.available_memory", lambda: 5_000_000)
    with pytest.raises(
        dl.SceneError, match=r"scene\.gltf: JSON: found 300,004 bytes of text, which need 9 MiB"
    ):
        dl.load(path)


@pytest.mark.parametrize("enabled", [True, False])
@pytest.mark.parametrize("text", [b"{}", b"{", b"[" * 100_000])
def test_garbage_collection_is_left_as_it_was(tmp_path, text, enabled):
    path = tmp_path / "scene.gltf"
    path.write_bytes(text)
    (gc.enable if enabled else gc.disable)()
    try:
        refuse(path)
        assert gc.isenabled() is enabled
    finally:
        gc.enable()


def test_nothing_to_light(tmp_path):
    builder = GltfBuilder()
    builder.node(extensions=builder.light(type="point"))
    with pytest.raises(dl.SceneError, match=r"scene\.glb: scene: found no triangles"):
        dl.load(builder.write(tmp_path))


def test_extras_of_any_type_and_nulls_are_accepted(tmp_path):
    builder = valid()
    builder.json["nodes"][0] |= {"extras": [1, {"a": None}], "matrix": None, "skin": None}
    builder.json["meshes"][0]["extras"] = "text"
    builder.json["extras"] = 5
    builder.json["asset"]["extras"] = None
    builder.json["unknown"] = {"deep": [[]]}
    assert dl.load(builder.write(tmp_path)).info()["triangles"] == 2


def test_integers_written_as_floats_are_accepted(tmp_path):
    builder = valid()
    builder.json["accessors"][0]["count"] = 4.0
    assert dl.load(builder.write(tmp_path)).info()["triangles"] == 2


def test_empty_primitives_add_nothing(tmp_path):
    builder = valid()
    position = builder.accessor(QUAD)
    none = builder.accessor(QUAD_TRIANGLES[:1])
    builder.json["accessors"][none]["count"] = 0
    two = builder.accessor(QUAD_TRIANGLES[:2])
    for mode, indices in ((4, none), (5, none), (6, two)):
        builder.node(
            mesh=builder.mesh({"attributes": {"POSITION": position}, "indices": indices, "mode": mode})
        )
    assert dl.load(builder.write(tmp_path)).info()["triangles"] == 2
