# SPDX-License-Identifier: Apache-2.0
"""Hostile session files with right checksums: one error each, or a session that can be used."""

from __future__ import annotations

import io
import json
import warnings
import zipfile

import deltalux as dl
import numpy as np
import pytest
from deltalux import snapshot
from rooms import room, translation, with_texture
from session_files import read_parts, write_parts
from thoroughness import slow


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """Index and arrays of a file with everything: direct light by rays, pending work, a display mesh."""
    path = tmp_path_factory.mktemp("whole") / "whole.dlx"
    scene = with_texture(room(groups=3))
    samples = dl.Samples.on_vertices(scene, spacing=1.0, radius=0.2)
    options = {"paths": 300, "threads": 1, "segment_end": "bounded", "static_method": "disc_index"}
    with dl.Session(scene, samples, **options) as session:
        session.bake()
        session.set_reflectance("wall", (0.4, 0.4, 0.4))
        assert session.update(budget_ms=1e-6).done < 1
        snapshot.write(path, session)
    return read_parts(path)


def use(session):
    """Everything that reads or changes what a file brought."""
    session.update()
    session.move("block", translation(-0.4, 0.6, -0.3))
    session.dim("desk", 0.5)
    session.update()
    if session.poses["lamp"] is not None:
        session.remove("lamp")
    session.update()
    assert np.isfinite(session.gradient).all()
    session.digest()
    for _ in range(2):
        assert np.isfinite(session.irradiance).all()
        assert np.isfinite(session.standard_error).all()
        session.recompute()


def set_entry(name, dtype, entry, value):
    def change(index, arrays):
        values = arrays[name].view(np.uint8).reshape(-1).copy()
        values.view(dtype)[entry] = value
        arrays[name] = values.view(arrays[name].dtype).reshape(arrays[name].shape)

    return change


NODE = {"name": "n", "parent": -1, "matrix": np.eye(4).tolist(), "parts": [], "lights": [], "label": None}


def set_field(value, *way):
    def change(index, arrays):
        for key in way[:-1]:
            index = index[key]
        index[way[-1]] = value

    return change


def set_array(name, array):
    return lambda index, arrays: arrays.__setitem__(name, array)


def set_look(value, *way):
    return set_field(value, "scene", "looks", *way)


VIEW = {"name": "c", "pose": np.eye(4).tolist(), "vertical_fov": 1, "height": None, "aspect": None,
        "near": 0, "far": None}  # fmt: skip


HOSTILE = {
    "a hit beyond the discs": (set_entry("core/level0.hits", "u4", 1, 0xFFFFFFFE), "disc that is not there"),
    "a hit far beyond": (set_entry("core/level1.hits", "u4", slice(None), 2**31), "disc that is not there"),
    "an infinite radius": (set_entry("core/radius", "f4", 0, np.inf), '"radius": found inf at entry 0'),
    "a huge radius": (set_entry("core/radius", "f4", 3, 1e18), '"radius": found 1e\\+18 at entry 3'),
    "no radius": (set_entry("core/radius", "f4", 0, np.nan), '"radius": found nan'),
    "a huge world": (
        set_array("core/world", np.array([-1e19] * 3 + [1e19] * 3, "f4").view("u1")),
        '"world" is larger than the scene',
    ),
    "a world of NaN": (set_entry("core/world", "f4", slice(None), np.nan), "world|box"),
    "a pose of NaN": (set_entry("core/poses", "f8", slice(24, 36), np.nan), '"poses": found nan'),
    "a pose far away": (set_entry("core/poses", "f8", -1, 1e300), '"poses": found 1e\\+300'),
    "a mirrored pose": (set_entry("core/poses", "f8", slice(36, 45), -np.eye(3).ravel()), "no rigid pose"),
    "a static mesh away": (set_entry("core/present", "u1", 0, 0), "is static, but was moved or removed"),
    "half present": (set_entry("core/present", "u1", 2, 7), '"present": found 7'),
    "an origin far away": (set_entry("core/level0.segments", "f4", 0, 2e18), "bounce 0 is not sound"),
    "an endless flight": (set_entry("core/level1.segments", "f4", 4, np.inf), "is not sound"),
    "a flight of NaN": (set_entry("core/level1.segments", "f4", 4, np.nan), "is not sound"),
    "too much power": (set_entry("core/level0.segments", "u4", 5, 2**32 - 1), "is not sound"),
    "a triangle beyond": (set_entry("core/level0.segments", "u4", 9, 10**6), "is not sound"),
    "a path beyond": (set_entry("core/level1.segments", "u4", slice(8, None, 11), 10**6), "is not sound"),
    "a circle": (set_entry("core/level1.segments", "u4", slice(10, None, 11), 0), "one chain"),
    "an extension of NaN": (set_entry("core/level0.extended", "f4", 0, np.nan), "is not sound"),
    "no quantum": (set_entry("core/quantum", "f8", 0, 0.0), '"quantum": found 0'),
    "a huge quantum": (set_entry("core/quantum", "f8", 0, 1e300), '"quantum": found 1e\\+300'),
    "a fine quantum": (set_entry("core/quantum", "f8", 0, 1e-150), "integer scale"),
    "a coarse quantum": (set_entry("core/quantum", "f8", 0, 1e132), '"quantum": found 1e\\+132'),
    "a coarse direct quantum": (
        set_entry("core/direct.scales", "f8", 0, 1e30),
        '"direct.scales": found 1e\\+30 at entry 0, expected 1e-200 to',
    ),
    "no direct quantum": (set_entry("core/direct.scales", "f8", 0, 0.0), '"direct.scales": found 0'),
    "a light without paths": (set_entry("core/light_paths", "u8", 0, 0), '"light_paths": found 0'),
    "more paths": (set_entry("core/light_paths", "u8", 0, 2**32 - 1), "more than fit"),
    "endless paths": (set_entry("core/light_paths", "u8", 0, 2**63), '"light_paths": found'),
    "sums below zero": (set_entry("core/sums", "i8", 5, -(2**63)), '"sums": found'),
    "sums beyond": (set_entry("core/sums", "i8", 5, 2**63 - 1), '"sums": found'),
    "an area of NaN": (set_entry("core/area", "f4", 0, np.nan), '"area": found nan'),
    "an area of next to nothing": (set_entry("core/area", "f4", 0, 1e-45), '"area": found 1'),
    "openness of NaN": (set_entry("core/openness", "f4", 0, np.nan), '"openness": found nan'),
    "a level that wraps around": (
        set_entry("core/level_sizes", "u8", 1, 2**62),
        "more segments than there are paths",
    ),
    "no levels": (set_array("core/level_sizes", np.zeros(0, "u1")), "bounce 0 has 0 segments"),
    "a pending path beyond": (set_entry("core/pending", "u4", 0, 10**6), '"pending" refers'),
    "a pending bounce beyond": (set_entry("core/pending", "u4", 2, 0xFFFF), '"pending" names a bounce'),
    "a factor of NaN": (set_entry("core/group_factor", "f8", 0, np.nan), "found factor"),
    "reflectance of NaN": (set_entry("core/reflectance", "f4", 0, np.nan), '"reflectance": found nan'),
    "a view beyond": (set_entry("core/direct.views", "u4", 0, 0xFFFFFFEF), '"direct.views" holds'),
    "a missing array": (lambda index, arrays: arrays.pop("core/cut"), '"cut" is missing'),
    "an array too many": (set_array("core/more", np.zeros(3, "u1")), 'array "core/more" .* nothing asks for'),
    "light in the index only": (
        lambda index, arrays: [arrays.pop(n) for n in list(arrays) if n == "core/level_sizes"],
        "found light in one of index and arrays only",
    ),
    "a reflectance beyond": (set_field(1e300, "reflectances", 0, 0), "reflectances: found .* 0 to 1"),
    "other reflectances": (
        lambda index, arrays: index["reflectances"][0].__setitem__(0, 0.9),
        "other reflectances in the index",
    ),
    "an option too many": (set_field(3, "options", "progress"), "index.options.progress: found it"),
    "an option too few": (
        lambda index, arrays: index["options"].pop("paths"),
        "index.options.paths: found nothing",
    ),
    "paths as a text": (set_field("a", "options", "paths"), "paths: found 'a'"),
    "paths beyond": (set_field(10**30, "options", "paths"), "paths: found 1000"),
    "a limit as a text": (set_field("a", "options", "memory_limit"), "memory_limit: found 'a'"),
    "a switch as a text": (set_field("yes", "scene", "meshes", 2, "movable"), "movable: found 'yes'"),
    "an angle as a text": (set_field("x", "scene", "meshes", 0, "smooth_angle"), "smooth_angle: found 'x'"),
    "more vertices": (set_field(2**30, "scene", "meshes", 0, "vertices"), "fewer rows than the index says"),
    "fewer vertices": (set_field(0, "scene", "meshes", 1, "vertices"), "found vertex index"),
    "a pose of texts": (set_field([["a"] * 4] * 4, "scene", "meshes", 0, "pose"), "pose: found"),
    "a pose that scales": (set_field(1e200, "scene", "meshes", 1, "pose", 0, 0), "pose: found .* 2e\\+15"),
    "a pose that shears": (set_field(1e15, "scene", "meshes", 1, "pose", 0, 1), "pose: found a matrix that"),
    "a place far away": (set_field(1.7e308, "scene", "meshes", 0, "pose", 1, 3), "pose: found .* 2e\\+15"),
    "a sample far away": (
        set_entry("samples/points", "f8", 4, -1e300),
        r"points: found a coordinate of 1e\+300 m, expected at most 1e\+15",
    ),
    "a light of no kind": (set_field("x", "scene", "lights", 0, "kind"), "found kind 'x'"),
    "a surface of no kind": (
        set_field("velvet", "scene", "materials", 0, "surface", "kind"),
        r"materials\[0\].surface: found kind 'velvet', expected one of \['diffuse', 'pane'\]",
    ),
    "no surface": (set_field(None, "scene", "materials", 0, "surface"), "surface: found kind None"),
    "a node under itself": (set_field([NODE | {"parent": 0}], "scene", "nodes"), "parent: found 0"),
    "a node's part beyond": (
        set_field([NODE | {"parts": [["walls", 0, 99]]}], "scene", "nodes"),
        r"nodes\[0\].parts: found",
    ),
    "a node's lights beyond": (set_field([NODE | {"lights": ["x"]}], "scene", "nodes"), "lights: found"),
    "a node's label of another type": (set_field([NODE | {"label": 3}], "scene", "nodes"), "label: found 3"),
    "a camera of nothing": (
        set_field([VIEW | {"pose": []}], "scene", "cameras"),
        r"cameras\[0\].pose: found",
    ),
    "a camera without height": (set_field([VIEW | {"height": 0}], "scene", "cameras"), r"height: found 0"),
    "a camera too high": (set_field([VIEW | {"height": 1e99}], "scene", "cameras"), r"height: found 1e\+99"),
    "a camera of no aspect": (set_field([VIEW | {"aspect": -1}], "scene", "cameras"), "aspect: found -1"),
    "a camera behind": (set_field([VIEW | {"near": -1}], "scene", "cameras"), "near: found -1"),
    "a camera that ends": (set_field([VIEW | {"far": "x"}], "scene", "cameras"), "far: found 'x'"),
    "no look": (set_field(3, "scene", "looks"), "looks: found 3"),
    "looks of few": (set_look([], "materials"), "looks.materials: found 0, expected"),
    "an image beyond": (set_look([2**30, 5], "images"), "fewer rows than the index says"),
    "an image below zero": (set_look([-5], "images"), "images: found"),
    "an image of nothing": (set_look([0], "images"), "another format, expected PNG"),
    "an image of something": (
        lambda index, arrays: arrays.__setitem__("images", arrays["images"] + np.uint8(1)),
        "another format, expected PNG",
    ),
    "images that nothing uses": (
        lambda index, arrays: arrays.__setitem__("images", np.r_[arrays["images"], np.zeros(9, np.uint8)]),
        'array "images" or a part of it',
    ),
    "an image too many": (set_look(1, "textures", 0, "image"), "image: found 1"),
    "a bright mean": (set_look([1, 1, 1.5], "textures", 0, "mean"), "mean: found"),
    "a wrap of another kind": (set_look([10497, 10498], "textures", 0, "wrap"), "sampler: found"),
    "one wrap": (set_look([10497], "textures", 0, "wrap"), "wrap: found"),
    "a wrap as a fraction": (set_look([10497, 10497.0], "textures", 0, "wrap"), "wrap: found"),
    "a filter of another kind": (set_look(9987, "textures", 0, "mag_filter"), "sampler: found"),
    "a filter as a text": (set_look("x", "textures", 0, "min_filter"), "min_filter: found 'x'"),
    "an endless offset": (set_look([1e300, 0], "textures", 0, "offset"), r"offset: found \[1e\+300"),
    "an endless rotation": (set_look(-1e300, "textures", 0, "rotation"), r"rotation: found -1e\+300"),
    "a scale of one": (set_look([1], "textures", 0, "scale"), r"scale: found \[1\]"),
    "a texture beyond": (set_look(2, "materials", 0, "colour"), "colour: found 2"),
    "a texture below": (set_look(-2, "materials", 0, "glow"), "glow: found -2"),
    "an alpha mode": (set_look("ADD", "materials", 0, "alpha_mode"), "alpha_mode: found 'ADD'"),
    "an alpha beyond": (set_look(2, "materials", 0, "alpha"), "alpha: found 2"),
    "a cutoff below": (set_look(-1, "materials", 0, "alpha_cutoff"), "alpha_cutoff: found -1"),
    "a mesh beyond": (set_look([4], "meshes"), "meshes: found"),
    "a mesh twice": (set_look([0, 0], "meshes"), "fewer rows than the index says"),
    "endless coordinates": (set_entry("meshes/coordinates", "f4", 1, np.inf), "coordinates: found"),
    "coordinates of others": (
        set_array("meshes/coordinates", np.zeros((12, 5), "f4")),
        r'"meshes/coordinates": found float32 of shape',
    ),
    "a grid beyond": (set_field([10**9, 10**9], "samples", "grid_shape"), "grid_shape: found"),
    "no spacing": (set_field(-1, "samples", "display_spacing"), "display_spacing: found -1"),
    "samples on nothing": (
        lambda index, arrays: arrays.__setitem__("samples/attached", arrays["samples/attached"] - 9),
        '"samples/attached": found',
    ),
    "triangles beyond": (
        lambda index, arrays: arrays.__setitem__("display/triangles", arrays["display/triangles"] + 10**6),
        '"display/triangles": found',
    ),
    "corners beyond all": (set_entry("display/points", "f8", 1, 6e125), r'"display/points": found 6e\+125'),
    "no corners": (set_entry("display/sample_points", "f8", 1, np.nan), 'sample_points": found nan'),
    "a normal beyond": (set_entry("display/normals", "f8", 1, 2.0), '"display/normals": found 2.0'),
    "points of another type": (
        lambda index, arrays: arrays.__setitem__("samples/points", arrays["samples/points"].astype("f4")),
        '"samples/points": found float32',
    ),
    "reflectances of texts": (set_field("x", "reflectances"), "reflectances: found 'x'"),
    "a version as a list": (set_field([1] * 50, "version"), "found session format"),
}  # fmt: skip


@pytest.mark.parametrize("what", HOSTILE)
def test_hostile_files_are_refused(parts, tmp_path, what):
    change, words = HOSTILE[what]
    index, arrays = json.loads(json.dumps(parts[0])), dict(parts[1])
    change(index, arrays)
    path = tmp_path / "hostile.dlx"
    write_parts(path, index, arrays)
    with pytest.raises(dl.FormatError, match=words) as caught, warnings.catch_warnings():
        warnings.simplefilter("error")  # NumPy's come before an error, or without one
        dl.Session.open(path, threads=1)
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value)) < 700


LIMITS = {
    "u1": [0, 1, 2, 7, 254, 255],
    "u4": [0, 1, 2**32 - 1, 2**32 - 2, 2**31, 0x7F800000, 0x7FC00000, 0x7F7FFFFF],
    "u8": [0, 1, 7, 2**61, 2**63, 2**64 - 1],
    "i8": [0, -1, 2**63 - 1, -(2**63)],
    "f4": [0, -0.0, 1e-45, 1e-30, 1e15, 3e38, np.inf, np.nan, -1],
    "f8": [0, 1e-310, 1e-300, 1e300, np.inf, np.nan, -1],
}
DTYPES = {
    "cut": "u1", "present": "u1", "light_sampled": "u1", "direct.behind": "u1", "sums": "i8",
    "direct.weights": "i8", "light_paths": "u8", "level_sizes": "u8", "quantum": "f8", "poses": "f8",
    "group_factor": "f8", "direct.scales": "f8", "area": "f4", "radius": "f4", "openness": "f4",
    "world": "f4", "reflectance": "f4",
}  # fmt: skip


@pytest.mark.parametrize(("seed", "values"), [(0, 1), *(slow(seed, 3) for seed in range(3))])
def test_numbers_at_the_limits_are_refused_or_harmless(parts, tmp_path, seed, values):
    """Any number anywhere in the core's arrays: an error, or a session that can be used."""
    path, (index, arrays) = tmp_path / "hostile.dlx", parts
    rng = np.random.default_rng(seed)
    outcomes = {"refused": 0, "harmless": 0}
    for name in sorted(arrays):
        early = not name.startswith("core/level") or name < "core/level2"
        if not name.startswith("core/") or not early or not arrays[name].size:
            continue
        dtype = DTYPES.get(name.removeprefix("core/"), "u4")
        for value in rng.permutation(len(LIMITS[dtype]))[:values]:
            data = arrays[name].copy()
            numbers = data[: data.size // np.dtype(dtype).itemsize * np.dtype(dtype).itemsize].view(dtype)
            numbers[rng.integers(numbers.size)] = np.array(LIMITS[dtype][value]).astype(dtype)
            write_parts(path, index, arrays | {name: data})
            try:
                opened = dl.Session.open(path, threads=1)
            except dl.FormatError:
                outcomes["refused"] += 1
                continue
            with opened:
                use(opened)
            outcomes["harmless"] += 1
    assert outcomes["refused"] > 6 * values
    assert outcomes["harmless"] > values


def test_signalling_nans_stand_for_automatic_radii(tmp_path):
    """NumPy warns where one becomes a float32 or is compared."""
    path = tmp_path / "odd.dlx"
    scene = room()
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=1.0), paths=300, threads=1) as session:
        session.save(path)
        session.bake()
        digest = session.digest()
    index, arrays = read_parts(path)
    set_entry("samples/radius", "u8", slice(None), 0x7FF0000000000001)(index, arrays)
    set_entry("core/radius", "u4", slice(None), 0x7F800001)(index, arrays)
    write_parts(path, index, arrays)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with dl.Session.open(path, threads=1) as opened:
            assert np.isnan(opened.samples.radius).all()
            assert np.isnan(opened.radius.astype(np.float64)).all()
            opened.bake()
            assert opened.digest() == digest


def archive_of(entries, compression=zipfile.ZIP_STORED):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", compression) as file:
        for name, content in entries:
            file.writestr(name, content)
    return data.getvalue()


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize(
    ("data", "words"),
    [
        pytest.param(
            lambda: archive_of([("deltalux.json", b" " * (8 << 20))], zipfile.ZIP_DEFLATED),
            "hostile.dlx",
            id="bomb",
        ),
        pytest.param(lambda: archive_of([("deltalux.json", "{}")] * 2), "twice", id="twice"),
        pytest.param(
            lambda: archive_of([("deltalux.json", "{}"), *((f"{i}.npy", b"") for i in range(5000))]),
            "found 5001 entries, expected at most 4096",
            id="many",
        ),
        pytest.param(
            lambda: archive_of([(f"{i:0200}.npy", b"") for i in range(9000)]),
            "list of entries of [0-9]+ bytes",
            id="very many",
        ),
        pytest.param(lambda: archive_of([("deltalux.json", "[" * 200_000)]), "nested too deeply", id="deep"),
        pytest.param(lambda: archive_of([("deltalux.json", '{"a": NaN}')]), "found NaN", id="nan"),
        pytest.param(lambda: archive_of([("deltalux.json", "9" * 10_000)]), "hostile.dlx", id="digits"),
        pytest.param(lambda: archive_of([("deltalux.json", b"\xff\xfe")]), "hostile.dlx", id="no text"),
        pytest.param(lambda: archive_of([("other", "")]), 'found no "deltalux.json"', id="no index"),
        pytest.param(lambda: b"", "truncated, damaged or no session", id="nothing"),
    ],
)
def test_hostile_zips_are_refused(tmp_path, data, words):
    path = tmp_path / "hostile.dlx"
    path.write_bytes(data())
    with pytest.raises(dl.FormatError, match=words):
        dl.Session.open(path)


@pytest.mark.parametrize(
    "header",
    [
        b"{'descr': '|u1', 'fortran_order': False, 'shape': (99,), }",
        b"{'descr': '|u1', 'fortran_order': True, 'shape': (4,), }",
        b"{'descr': '|O', 'fortran_order': False, 'shape': (4,), }",
        b"{'descr': '|V999999999', 'fortran_order': False, 'shape': (4,), }",
        b"{'descr': '|u1', 'fortran_order': False, 'shape': (-4,), }",
        b"{'descr': '|u1', 'fortran_order': False, 'shape': (4294967296, 4294967296, 0, ), }",
        b"(" * 9000,
        b"{",
    ],
)
def test_hostile_array_headers_are_refused(parts, tmp_path, header):
    path, (index, arrays) = tmp_path / "hostile.dlx", parts
    write_parts(path, index, {name: array for name, array in arrays.items() if name != "core/present"})
    data = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(4)
    with zipfile.ZipFile(path, "a") as file:
        file.writestr("core/present.npy", data)
    with pytest.raises(dl.FormatError, match=r"hostile\.dlx: .*core/present|present"):
        dl.Session.open(path)


def test_damage_in_any_byte_is_found(parts, tmp_path):
    """Arrays are read in pieces; the last one of each brings its checksum."""
    whole, path = tmp_path / "whole.dlx", tmp_path / "damaged.dlx"
    write_parts(whole, *parts)
    with zipfile.ZipFile(whole) as file:
        places = {info.filename: (info.header_offset, info.file_size) for info in file.infolist()}
    data = whole.read_bytes()
    rng = np.random.default_rng(3)
    for name, (offset, size) in places.items():
        if size < 200:
            continue
        place = offset + 30 + len(name) + 140 + int(rng.integers(size - 150))
        path.write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
        with pytest.raises(dl.FormatError, match=r"damaged\.dlx"):
            dl.Session.open(path, threads=1)
