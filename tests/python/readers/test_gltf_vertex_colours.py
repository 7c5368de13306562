# SPDX-License-Identifier: Apache-2.0
"""Vertex colours of glTF files multiply the reflectance, triangle by triangle."""

from __future__ import annotations

from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD, QUAD_TRIANGLES, GltfBuilder
from deltalux.io.gltf.vertex_colours import MOST, tints
from hypothesis import given, settings
from hypothesis import strategies as st
from thoroughness import examples

RED, GREEN = (1.0, 0.25, 0.0), (0.0, 0.5, 0.25)


def painted(builder: GltfBuilder, colours: np.ndarray, material: int | None = 0, **fields) -> int:
    """The unit square in two triangles, with a colour for each of its four vertices."""
    primitive = {
        "attributes": {"POSITION": builder.accessor(QUAD), "COLOR_0": builder.accessor(colours, **fields)},
        "indices": builder.accessor(QUAD_TRIANGLES),
    }
    return builder.mesh(primitive if material is None else {**primitive, "material": material})


def loaded(builder: GltfBuilder, folder: Path) -> dl.Scene:
    return dl.load(builder.write(folder))


def reflectances(scene: dl.Scene, mesh: int = 0) -> list[list[float]]:
    """Of each triangle."""
    own = scene.meshes[mesh]
    names = np.atleast_1d(own.material)
    of = {m.name: m.reflectance.round(6).tolist() for m in scene.materials}
    return [of[names[i]] for i in own.material_index]


def test_a_triangle_reflects_the_mean_of_its_corners_times_the_material(tmp_path):
    builder = GltfBuilder()
    builder.material(name="paint", colour=(0.8, 0.8, 0.4))
    builder.node(mesh=painted(builder, np.array([RED, RED, RED, GREEN], np.float32)), name="wall")
    scene = loaded(builder, tmp_path)
    mixed = (2 * np.array(RED) + GREEN) / 3
    assert reflectances(scene) == [
        (np.array(RED) * (0.8, 0.8, 0.4)).round(6).tolist(),
        (mixed * (0.8, 0.8, 0.4)).round(6).tolist(),
    ]
    assert [m.name for m in scene.materials] == ["paint #d59c52", "paint #ff8900"]
    assert "vertex colours count with the mean of each triangle (wall)" in scene.warnings


@pytest.mark.parametrize(
    ("colours", "fields"),
    [
        (np.full((4, 3), 51, np.uint8), {"normalized": True}),
        (np.full((4, 4), 13107, np.uint16), {"normalized": True}),
        (np.array([(0.2, 0.2, 0.2, 0.0)] * 4, np.float32), {}),
    ],
)
def test_all_kinds_of_numbers_alpha_left_out(tmp_path, colours, fields):
    builder = GltfBuilder()
    builder.material(name="paint", colour=(0.5, 0.5, 0.5))
    if colours.shape[1] == 3 and colours.dtype.itemsize == 1:  # vertices are aligned to 4 bytes
        colours = np.pad(colours, ((0, 0), (0, 1)))
        view = builder.view(colours.tobytes(), byteStride=4)
        accessor = {"bufferView": view, "componentType": 5121, "count": 4, "type": "VEC3", **fields}
        builder.node(mesh=painted(builder, np.zeros((4, 3), np.float32)), name="wall")
        builder.json["accessors"][1] = accessor
    else:
        builder.node(mesh=painted(builder, colours, **fields), name="wall")
    assert reflectances(loaded(builder, tmp_path)) == [[0.1, 0.1, 0.1]] * 2


def test_white_changes_nothing_and_is_not_told(tmp_path):
    builder = GltfBuilder()
    builder.material(name="paint", colour=(0.5, 0.5, 0.5))
    builder.node(mesh=painted(builder, np.ones((4, 4), np.float32)), name="wall")
    scene = loaded(builder, tmp_path)
    assert [m.name for m in scene.materials] == ["paint"]
    assert not any("vertex colours" in warning for warning in scene.warnings)


def test_equal_colours_of_several_objects_are_one_material(tmp_path):
    builder = GltfBuilder()
    builder.material(name="paint", colour=(0.5, 0.5, 0.5))
    mesh = painted(builder, np.array([RED] * 4, np.float32))
    builder.node(mesh=mesh, name="wall")
    builder.node(mesh=mesh, name="MOVE_door", translation=[0, 0, 2])
    builder.node(mesh=painted(builder, np.array([RED] * 4, np.float32)), name="other", translation=[0, 0, 3])
    builder.node(mesh=builder.quad(0), name="plain", translation=[0, 0, 4])
    scene = loaded(builder, tmp_path)
    assert [m.name for m in scene.materials] == ["paint #ff8900", "paint"]


def test_without_a_material_they_tint_gltf_s_white(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=painted(builder, np.array([RED] * 4, np.float32), None), name="wall")
    assert reflectances(loaded(builder, tmp_path)) == [list(RED)] * 2


def test_they_leave_the_emission(tmp_path):
    builder = GltfBuilder()
    builder.material(name="glow", colour=(0.5, 0.5, 0.5), emissiveFactor=[1, 1, 1])
    builder.node(mesh=painted(builder, np.array([RED] * 3 + [GREEN], np.float32)), name="lamp")
    scene = loaded(builder, tmp_path)
    assert [m.emission.tolist() for m in scene.materials] == [[1.0, 1.0, 1.0]] * 2
    assert len(scene.groups) == 1


@pytest.mark.parametrize(
    ("colours", "said"),
    [
        (np.ones((3, 3), np.float32), "3 elements, expected one for each of 4 vertices"),
        (np.ones((4, 2), np.float32), "type VEC2"),
        (np.full((4, 3), np.nan, np.float32), "at element 0, expected finite numbers"),
    ],
)
def test_broken_ones_are_refused(tmp_path, colours, said):
    builder = GltfBuilder()
    builder.material(name="paint")
    builder.node(mesh=painted(builder, colours))
    with pytest.raises(dl.Error, match=said):
        loaded(builder, tmp_path)


def test_light_reflected_is_that_of_the_colour(tmp_path):
    """The same bits as from a file whose material has the colour."""
    digests = []
    for tinted in (True, False):
        builder = GltfBuilder()
        colour = np.array((0.5, 0.25, 0.125))
        builder.material(name="paint", colour=(0.5, 0.5, 0.5) if tinted else 0.5 * colour)
        colours = np.broadcast_to(colour if tinted else 1.0, (4, 3)).astype(np.float32)
        builder.node(mesh=painted(builder, colours), name="wall")
        lamp = builder.light(type="point", intensity=50, name="lamp")
        builder.node(extensions=lamp, translation=[0.5, 0.5, 1], name="lamp")
        folder = tmp_path / str(tinted)
        folder.mkdir()
        scene = loaded(builder, folder)
        with dl.Session(scene, dl.Samples([(0.5, 0.5, 0.8)], [(0, 0, -1)]), paths=2000, gather=64) as session:
            session.bake()
            assert session.irradiance.min() > 0
            digests.append(session.irradiance.tobytes())
    assert digests[0] == digests[1]


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(1, 1500), st.integers(1, 1500), st.booleans(), st.integers(0, 2**31))
def test_palettes_are_small_and_keep_the_sum_of_what_is_reflected(triangles, different, flat, seed):
    rng = np.random.default_rng(seed)
    colours = rng.uniform(size=(different, 3))[rng.integers(0, different, triangles)]
    areas = np.zeros(triangles) if flat else rng.uniform(0, 2, triangles)
    palette, number = tints(np.repeat(colours[:, None], 3, axis=1), areas)
    assert len(palette) <= MOST
    assert len(number) == triangles
    assert number.max() < len(palette)
    if len(np.unique(colours.round(9), axis=0)) <= MOST:
        np.testing.assert_allclose(palette[number], colours, atol=1e-9)
    else:
        assert len(palette) == MOST
    np.testing.assert_allclose(areas @ palette[number], areas @ colours, rtol=1e-6)
    assert (palette.min(axis=0) >= colours.min(axis=0) - 1e-9).all()
    assert (palette.max(axis=0) <= colours.max(axis=0) + 1e-9).all()


def test_a_gradient_is_near_in_each_triangle_and_not_darker_in_all():
    """Two channels that change in two directions, 10,000 triangles: 128 colours, steps of about a tenth."""
    u, v = np.meshgrid(np.linspace(0, 1, 100), np.linspace(0, 1, 100))
    colours = np.stack([0.1 + 0.8 * u, 0.1 + 0.8 * v, 0.9 - 0.8 * u], axis=-1).reshape(-1, 3)
    palette, number = tints(np.repeat(colours[:, None], 3, axis=1), np.ones(len(colours)))
    error = palette[number] - colours
    assert np.sqrt((error**2).mean()) < 0.035
    assert np.abs(error).max() < 0.15
    np.testing.assert_allclose(error.mean(axis=0), 0, atol=1e-6)


def test_one_colour_more_changes_the_others_little():
    rng = np.random.default_rng(3)
    colours = rng.uniform(size=(MOST + 1, 3))
    palette, number = tints(np.repeat(colours[:, None], 3, axis=1), np.ones(len(colours)))
    assert (np.abs(palette[number] - colours).max(axis=1) > 1e-9).sum() <= 3


def test_no_triangles_have_no_colours():
    palette, number = tints(np.zeros((0, 3, 3)), np.zeros(0))
    assert (palette.shape, number.shape) == ((0, 3), (0,))
