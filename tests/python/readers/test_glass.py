# SPDX-License-Identifier: Apache-2.0
"""What becomes of surfaces that let light pass: as the file says, as windows, left out, or as boards."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD, GltfBuilder, png
from deltalux import outputs
from deltalux.outputs.of_session import baked_of
from deltalux.scene.surfaces import WINDOW
from pygltflib import GLTF2

# Name, fields of the material, alpha of its base colour, whether it is glass.
MATERIALS: list[tuple[str, dict[str, Any], float, bool]] = [
    ("pane", {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.9}}}, 1.0, True),
    ("film", {"alphaMode": "BLEND"}, 0.3, True),
    ("half", {"alphaMode": "BLEND"}, 0.5, True),
    ("frosted", {"alphaMode": "BLEND"}, 0.7, False),
    ("sticker", {"alphaMode": "BLEND"}, 1.0, False),
    ("by default", {"extensions": {"KHR_materials_transmission": {}}}, 1.0, False),
    ("leaf", {"alphaMode": "MASK"}, 0.1, False),
    ("opaque", {}, 0.1, False),
    ("glowing", {"alphaMode": "BLEND", "emissiveFactor": [1, 1, 1]}, 0.1, False),
]


def write(folder: Path, fields: dict[str, Any] | None, alpha: float = 1.0) -> Path:
    """A square of 1 m under a lamp, and between them (None: not) a square of the material."""
    builder = GltfBuilder()
    builder.node(name="floor", mesh=builder.quad(builder.material(name="grey", colour=(0.5,) * 3)))
    builder.node(
        name="lamp",
        translation=[0.5, 0.5, 2],
        extensions=builder.light(type="point", intensity=100),
    )
    if fields is not None:
        colour = {"baseColorFactor": [0.2, 0.4, 0.6, alpha], "metallicFactor": 0}
        material = builder.material(name="between", pbrMetallicRoughness=colour, **fields)
        builder.node(name="square", mesh=builder.quad(material), translation=[0, 0, 1])
    return builder.write(folder)


def light(scene: dl.Scene) -> np.ndarray:
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=0.25), paths=20_000, gather=256) as session:
        session.bake()
        return session.irradiance


@pytest.mark.parametrize(
    ("fields", "alpha", "is_glass"), [row[1:] for row in MATERIALS], ids=[row[0] for row in MATERIALS]
)
def test_what_is_mostly_transparent_is_left_out(tmp_path, fields, alpha, is_glass):
    path = write(tmp_path, fields, alpha)
    opaque, clear = dl.load(path, glass="opaque"), dl.load(path, glass="clear")
    assert isinstance(opaque.material("between").surface, dl.DiffuseSurface)
    assert [m.name for m in opaque.meshes] == ["floor", "square"]
    assert [m.name for m in clear.meshes] == (["floor"] if is_glass else ["floor", "square"])
    assert [n.name for n in clear.nodes] == [n.name for n in opaque.nodes]
    told = [w for w in opaque.warnings if "or clear" in w and w.endswith("(between)")]
    assert len(told) == is_glass
    assert any(w.startswith("glass is left out") for w in clear.warnings) == is_glass
    if is_glass:
        assert not any("transparency" in w for w in clear.warnings)


def test_light_passes_clear_glass_as_if_it_were_not_there(tmp_path):
    without = light(dl.load(write(tmp_path, None)))
    path = write(tmp_path, MATERIALS[0][1])
    assert (light(dl.load(path, glass="clear")) == without).all()
    assert light(dl.load(path, glass="opaque"))[: len(without)].max() < 0.01 * without.max()


# Of MATERIALS, in their order: coverage, transmission and index of the pane; None: it is opaque.
LITERAL = [(1, 0.9, 1.5), (0.3, 0, 1.5), (0.5, 0, 1.5), (0.7, 0, 1.5), None, None, None, None, None]


@pytest.mark.parametrize("number", range(len(MATERIALS)), ids=[row[0] for row in MATERIALS])
def test_the_file_says_what_passes(tmp_path, number):
    (_, fields, alpha, is_glass), pane = MATERIALS[number], LITERAL[number]
    path = write(tmp_path, fields, alpha)
    scene = dl.load(path)
    surface = scene.material("between").surface
    if pane is None:
        assert isinstance(surface, dl.DiffuseSurface)
    else:
        assert (surface.coverage, surface.transmission, surface.index) == pytest.approx(pane)
        assert surface.tint == pytest.approx(0.2126 * 0.2 + 0.7152 * 0.4 + 0.0722 * 0.6)
        assert surface.faces == 1
    told = any("counts as grey (between)" in w for w in scene.warnings)
    assert told == (pane is not None and pane[1] > 0)
    glows = any("emissiveFactor" in name for name in fields)
    assert any("glow count as opaque" in w for w in scene.warnings) == glows
    window = dl.load(path, glass="window").material("between").surface
    assert (window is WINDOW) == is_glass
    if not is_glass:
        assert type(window) is type(surface)


def test_numbers_of_glass(tmp_path):
    """The index of refraction counts; impossible numbers are refused, where they are."""
    transmission = {"transmissionFactor": 1.0}
    for ior, index in ((1.33, 1.33), (0, 1.5), (99, 10)):
        extensions = {"KHR_materials_transmission": transmission, "KHR_materials_ior": {"ior": ior}}
        scene = dl.load(write(tmp_path, {"extensions": extensions}))
        assert scene.material("between").surface.index == pytest.approx(index)
    for name, key, value in (("transmission", "transmissionFactor", 1.5), ("ior", "ior", 0.5)):
        extensions = {"KHR_materials_transmission": transmission} | {f"KHR_materials_{name}": {key: value}}
        with pytest.raises(dl.FormatError, match=rf"materials\[1\]: {key}: found {value}"):
            dl.load(write(tmp_path, {"extensions": extensions}))


@pytest.mark.parametrize(("alpha", "passes"), [(255, False), (254, True)])
def test_textures_that_blend_are_panes_where_they_have_gaps(tmp_path, alpha, passes):
    texels = np.full((2, 2, 4), 255, np.uint8)
    texels[0, 0, 3] = alpha
    builder = GltfBuilder()
    texture = {"index": builder.texture(png(texels))}
    material = builder.material(alphaMode="BLEND", pbrMetallicRoughness={"baseColorTexture": texture})
    builder.node(mesh=builder.quad(material))
    (found,) = dl.load(builder.write(tmp_path)).materials
    assert isinstance(found.surface, dl.PaneSurface) == passes


def test_lit_files_keep_panes(tmp_path):
    """A viewer sees through them by alpha; loaded again, the pane is as it was."""
    scene = dl.load(write(tmp_path, MATERIALS[0][1]), glass="window")
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=0.5), paths=1000, gather=16) as session:
        session.bake()
        outputs.write(tmp_path / "lit.glb", baked_of(session, "x"))
    again = dl.load(tmp_path / "lit.glb").material("between").surface
    assert again.parameters() == WINDOW.parameters()
    document = GLTF2.load(str(tmp_path / "lit.glb"))
    (pane,) = [m for m in document.materials if m.name == "between"]
    assert pane.alphaMode == "BLEND"
    assert pane.pbrMetallicRoughness.baseColorFactor == pytest.approx([0, 0, 0, 1 - WINDOW.passes])


def test_glass_below_a_movable_is_left_out_and_the_rest_moves(tmp_path):
    builder = GltfBuilder()
    pane = builder.material(name="pane", **MATERIALS[0][1])
    glass = builder.node(root=False, name="glass", mesh=builder.quad(pane))
    frame = builder.quad(builder.material(name="frame", colour=(0.5,) * 3))
    builder.node(name="MOVE_window", mesh=frame, children=[glass])
    builder.node(name="MOVE_only_glass", mesh=builder.quad(pane))
    builder.node(name="lamp", translation=[0, 0, 2], extensions=builder.light(type="point", intensity=1))
    floor = builder.quad(builder.material(name="grey", colour=(0.5,) * 3))
    builder.node(name="floor", mesh=floor, translation=[-2, -2, -1], scale=[5, 5, 1])
    scene = dl.load(builder.write(tmp_path), glass="clear")
    assert {m.name: len(m.triangles) for m in scene.meshes if m.movable} == {
        "MOVE_window": 2,
        "MOVE_only_glass": 0,
    }
    with dl.Session(scene, paths=1000, gather=16) as session:
        session.bake()
        for name in ("MOVE_window", "MOVE_only_glass"):
            pose = session.pose(name).copy()
            pose[0, 3] += 0.1
            session.move(name, pose)
        session.update()
        before = session.digest()
        session.recompute()
        assert session.digest() == before


def write_obj(folder: Path, statements: str) -> Path:
    (folder / "a.mtl").write_text(
        f"newmtl wall\nKd 0.5 0.5 0.5\nnewmtl between\nKd 0.2 0.2 0.2\n{statements}\n"
    )
    square = "v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\n"
    text = "mtllib a.mtl\no wall\nusemtl wall\n" + square.format(z=0) + "f 1 2 3 4\n"
    text += "o square\nusemtl between\n" + square.format(z=1) + "f 5 6 7 8\n"
    path = folder / "a.obj"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("statements", "is_glass", "literal"),
    [
        ("d 0.2", True, 0.8),
        ("Tr 0.8", True, 0.8),
        ("d 0.9", False, 0.1),
        ("Tr 0.2", False, 0.2),
        ("d 1\nTr 1", False, 0),  # as some programs write what is opaque
        ("Tr 1\nd 1", False, 0),
        ("d 0.2\nKe 1 1 1", False, 0),
        ("d ?", False, 0),
    ],
)
def test_obj(tmp_path, statements, is_glass, literal):
    path = write_obj(tmp_path, statements)
    opaque, clear = dl.load(path, glass="opaque"), dl.load(path, glass="clear")
    surface = dl.load(path).material("between").surface
    assert isinstance(surface, dl.PaneSurface) == bool(literal)
    assert not literal or surface.coverage == pytest.approx(1 - literal)
    assert len(opaque.meshes) == 2
    assert [m.name for m in clear.meshes] == (["wall"] if is_glass else ["wall", "square"])
    assert any("or clear" in w and w.endswith("(between)") for w in opaque.warnings) == is_glass
    assert any(w.startswith("glass is left out") for w in clear.warnings) == is_glass


def test_wrong_words_are_refused(tmp_path):
    with pytest.raises(
        dl.OptionError, match="glass: found 'dark', expected one of literal, window, clear, opaque"
    ):
        dl.load(write(tmp_path, None), glass="dark")


def test_a_file_of_glass_only_has_nothing_to_light(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(builder.material(name="pane", **MATERIALS[0][1])))
    with pytest.raises(dl.SceneError, match="found no triangles"):
        dl.load(builder.write(tmp_path), glass="clear")


def test_the_colour_of_a_texture_dims_what_passes(tmp_path):
    """As the same colour by a factor would; a pane behind a dark picture is dark."""
    texture = np.full((2, 2, 3), (60, 60, 60), np.uint8)
    builder = GltfBuilder()
    index = builder.texture(png(texture))
    extensions = {"KHR_materials_transmission": {"transmissionFactor": 1.0}}
    by_texture = builder.material(
        name="texture", pbrMetallicRoughness={"baseColorTexture": {"index": index}}, extensions=extensions
    )
    value = ((60 / 255 + 0.055) / 1.055) ** 2.4
    by_factor = builder.material(
        name="factor", pbrMetallicRoughness={"baseColorFactor": [value] * 3 + [1]}, extensions=extensions
    )
    for material in (by_texture, by_factor):
        builder.node(mesh=builder.quad(material))
    scene = dl.load(builder.write(tmp_path))
    tints = [scene.material(name).surface.tint for name in ("texture", "factor")]
    assert tints == pytest.approx([value] * 2, abs=1e-4)


@pytest.mark.parametrize("how", ["strength", "texture"])
def test_glass_that_could_glow_and_does_not_is_glass(tmp_path, how):
    builder = GltfBuilder()
    fields: dict[str, Any] = {"emissiveFactor": [1, 1, 1], "alphaMode": "BLEND"}
    if how == "texture":
        fields["emissiveTexture"] = {"index": builder.texture(png(np.zeros((2, 2, 3), np.uint8)))}
    else:
        fields["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": 0}}
    colour = {"baseColorFactor": [0.5, 0.5, 0.5, 0.2]}
    builder.node(mesh=builder.quad(builder.material(pbrMetallicRoughness=colour, **fields)))
    (material,) = dl.load(builder.write(tmp_path)).materials
    assert isinstance(material.surface, dl.PaneSurface)


@pytest.mark.parametrize(("statement", "coverage"), [("Tr 100", 0), ("d -1", 0), ("Tr inf", 0), ("d 7", 1)])
def test_shares_beyond_their_bounds_are_cut_off(tmp_path, statement, coverage):
    scene = dl.load(write_obj(tmp_path, statement))
    surface = scene.material("between").surface
    assert isinstance(surface, dl.PaneSurface) == (coverage < 1)
    assert coverage or surface.coverage == 0
    assert any("nothing is left" in warning for warning in scene.warnings) == (coverage == 0)


@pytest.mark.parametrize("mode", ["MASK", "BLEND"])
def test_lit_files_keep_holes_and_alpha_of_textures(tmp_path, mode):
    texels = np.full((4, 4, 4), 200, np.uint8)
    texels[:2, :, 3] = 90
    builder = GltfBuilder()
    colour = {"baseColorTexture": {"index": builder.texture(png(texels))}}
    leaf = builder.material(name="leaf", alphaMode=mode, pbrMetallicRoughness=colour)
    uv = builder.accessor(np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32))
    attributes = {"POSITION": builder.accessor(QUAD), "TEXCOORD_0": uv}
    builder.node(name="card", mesh=builder.mesh({"attributes": attributes, "mode": 6, "material": leaf}))
    lamp = builder.light(type="point", intensity=100)
    builder.node(name="lamp", translation=[0.5, 0.5, 2], extensions=lamp)
    scene = dl.load(builder.write(tmp_path))
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=0.5), paths=1000, gather=16) as session:
        session.bake()
        outputs.write(tmp_path / "lit.glb", baked_of(session, "x"))
    before, again = scene.material("leaf"), dl.load(tmp_path / "lit.glb").material("leaf")
    assert again.look.alpha_mode == mode
    assert again.look.colour is not None
    np.testing.assert_array_equal(again.look.opacity, before.look.opacity)
    np.testing.assert_allclose(again.reflectance, before.reflectance, atol=1e-6)
    assert type(again.surface) is type(before.surface)
