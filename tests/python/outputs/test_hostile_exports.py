# SPDX-License-Identifier: Apache-2.0
"""Session files with right checksums and odd display meshes: what is exported of them has no NaN."""

from __future__ import annotations

import struct
import warnings

import deltalux as dl
import numpy as np
import pygltflib
import pytest
from deltalux import snapshot
from deltalux.outputs.of_session import baked_of
from deltalux.outputs.vertex_colors import write_glb
from rooms import room
from session_files import read_parts, write_parts
from thoroughness import all_but_slow

SIZES = {"VEC3": 3, "VEC2": 2, "SCALAR": 1}


def every(value):
    return lambda array: np.full_like(array, value)


def some(value):
    def change(array):
        array = array.copy()
        array[::3] = value
        return array

    return change


def opposite(array):
    return array * np.where(np.arange(len(array)) % 2, 1, -1)[:, None]


CHANGES = {
    "no normals": ("normals", every(0.0)),
    "some normals missing": ("normals", some(0.0)),
    "normals of next to nothing": ("normals", every(1e-300)),
    "normals of less than squares can be": ("normals", some(1e-200)),
    "normals that cancel out": ("normals", opposite),
    "one place": ("points", every(0.5)),
    "some in one place": ("points", some(0.5)),
    "one corner": ("triangles", every(0)),
}


@pytest.fixture(scope="module", params=[None, 0.1], ids=["plain", "detail"])
def parts(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("exports") / "a.dlx"
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=1.0, radius=0.2, detail=request.param)
    with dl.Session(scene, samples, paths=300, gather="off", threads=1) as session:
        session.bake()
        snapshot.write(path, session)
    return read_parts(path)


def numbers_of(path) -> dict[str, list[np.ndarray]]:
    """The float attributes of all primitives, by name."""
    document = pygltflib.GLTF2().load(str(path))
    data, found = document.binary_blob(), {}
    for mesh in document.meshes:
        for primitive in mesh.primitives:
            for name, number in vars(primitive.attributes).items():
                if number is None or document.accessors[number].componentType != pygltflib.FLOAT:
                    continue
                accessor = document.accessors[number]
                view = document.bufferViews[accessor.bufferView]
                begin, columns = (view.byteOffset or 0) + (accessor.byteOffset or 0), SIZES[accessor.type]
                values = struct.unpack_from(f"<{accessor.count * columns}f", data, begin)
                found.setdefault(name, []).append(np.reshape(values, (-1, columns)))
    return found


@pytest.mark.parametrize("kind", all_but_slow(CHANGES, *list(CHANGES)[::4]))
def test_a_lit_mesh_has_finite_numbers_and_unit_normals(parts, tmp_path, kind):
    name, change = CHANGES[kind]
    index, arrays = parts
    own = f"display/{name}"
    write_parts(tmp_path / "a.dlx", index, {**arrays, own: change(arrays[own])})
    with dl.Session.open(tmp_path / "a.dlx", threads=1) as session, warnings.catch_warnings():
        warnings.simplefilter("error")
        write_glb(tmp_path / "a.glb", baked_of(session, "a test"))
    found = numbers_of(tmp_path / "a.glb")
    assert found["NORMAL"]
    for values in (each for arrays in found.values() for each in arrays):
        assert np.isfinite(values).all()
    for normals in found["NORMAL"]:
        assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-6)
