# SPDX-License-Identifier: Apache-2.0
"""Textures count with the texels that an object uses; those that cannot be read as white, with a warning."""

from __future__ import annotations

import base64
import io
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD, QUAD_TRIANGLES, GltfBuilder, png
from deltalux.io.diagnostics import MEAN_GLOW
from deltalux.texels import MOST_SAMPLED, srgb_to_linear
from PIL import Image

REPEAT, CLAMP, MIRROR = 10497, 33071, 33648
UNIT = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)


def linear(byte) -> np.ndarray:
    return srgb_to_linear(np.asarray(byte, float) / 255)


def atlas(width: int, height: int, left: int, right: int) -> np.ndarray:
    """Grey `left` in the left half, `right` in the right one."""
    pixels = np.full((height, width, 3), left, np.uint8)
    pixels[:, width // 2 :] = right
    return pixels


def quad(builder: GltfBuilder, material: int, uv: np.ndarray, **fields) -> int:
    attributes = {
        "POSITION": builder.accessor(QUAD),
        "TEXCOORD_0": builder.accessor(np.asarray(uv, np.float32)),
    }
    primitive = {"attributes": attributes, "indices": builder.accessor(QUAD_TRIANGLES), "material": material}
    return builder.mesh(primitive, **fields)


def textured(
    builder: GltfBuilder, image: bytes, *, sampler=None, transform=None, factor=(1, 1, 1, 1), **fields
):
    index = builder.texture(image)
    if sampler is not None:
        builder.json.setdefault("samplers", []).append({"wrapS": sampler, "wrapT": sampler})
        builder.json["textures"][index]["sampler"] = len(builder.json["samplers"]) - 1
    info = {"index": index}
    if transform is not None:
        builder.use("KHR_texture_transform")
        info["extensions"] = {"KHR_texture_transform": transform}
    pbr = {"baseColorTexture": info, "baseColorFactor": list(factor), "metallicFactor": 0}
    return builder.material(name="paint", pbrMetallicRoughness=pbr, **fields)


def reflectance(scene: dl.Scene, name: str) -> float:
    (material,) = scene.mesh(name).material
    return float(scene.material(material).reflectance[1])


@pytest.mark.parametrize("size", [(2, 2), (64, 8), (3000, 40), (2 * MOST_SAMPLED, 2 * MOST_SAMPLED)])
@pytest.mark.parametrize(("left", "right"), [(255, 30), (90, 200)])
def test_objects_that_share_an_atlas_have_their_own_reflectance(tmp_path: Path, size, left: int, right: int):
    builder = GltfBuilder()
    material = textured(builder, png(atlas(*size, left, right)), factor=(0.5, 0.5, 0.5, 1))
    parts = {
        "one": UNIT * (0.45, 1),
        "two": UNIT * (0.4, 0.3) + (0.55, 0.1),
        "both": UNIT,
        "again": UNIT * (0.3, 1),
    }
    for name, uv in parts.items():
        builder.node(mesh=quad(builder, material, uv), name=name)
    scene = dl.load(builder.write(tmp_path))
    values = linear(left) / 2, linear(right) / 2, (linear(left) + linear(right)) / 4
    for name, value in zip(parts, (*values, values[0]), strict=True):
        assert reflectance(scene, name) == pytest.approx(float(value), abs=0.002)
    assert [m.name for m in scene.materials] == ["paint", "paint on two", "paint on both"]
    for material in scene.materials:  # what pictures show is the texel times this
        np.testing.assert_allclose(material.reflectance, 0.5 * material.look.colour.mean)
    assert len({id(m.look.colour.image) for m in scene.materials}) == 1


@pytest.mark.parametrize(
    ("wrap", "uv", "share"),
    [
        (REPEAT, UNIT * (0.4, 1) + (7.05, -3), 1.0),
        (REPEAT, UNIT * (0.4, 1) - (0.45, 0), 0.0),
        (REPEAT, UNIT * (1, 20), 0.5),
        (CLAMP, UNIT * (4, 1) + (1, 0), 0.0),
        (CLAMP, UNIT * (-4, 1), 1.0),
        (CLAMP, UNIT * (2, 1), 0.25),
        (MIRROR, UNIT * (0.4, 1) + (1.0, 0), 0.0),
        (MIRROR, UNIT * (0.4, 1) + (1.55, 0), 1.0),
        (MIRROR, UNIT * (2, 1), 0.5),
    ],
)  # fmt: skip
def test_edges_are_wrapped(tmp_path: Path, wrap: int, uv: np.ndarray, share: float):
    builder = GltfBuilder()
    builder.node(
        mesh=quad(builder, textured(builder, png(atlas(16, 4, 255, 0)), sampler=wrap), uv), name="card"
    )
    assert reflectance(dl.load(builder.write(tmp_path)), "card") == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize(
    ("transform", "share"),
    [
        ({"scale": [0.4, 1]}, 1.0),
        ({"scale": [0.4, 1], "offset": [0.55, 0]}, 0.0),
        ({"rotation": np.pi / 2, "scale": [1, 0.4]}, 1.0),  # v becomes u
        ({"rotation": np.pi, "scale": [0.4, 1]}, 0.0),  # u becomes -u
    ],
)
def test_the_transform_of_a_texture_counts(tmp_path: Path, transform: dict, share: float):
    builder = GltfBuilder()
    material = textured(builder, png(atlas(32, 32, 255, 0)), transform=transform)
    builder.node(mesh=quad(builder, material, UNIT), name="card")
    assert reflectance(dl.load(builder.write(tmp_path)), "card") == pytest.approx(share, abs=0.005)


def leaf(kind: str, colour: int) -> bytes:
    """A picture of which three eighths are opaque, and the rest black or bright but transparent."""
    pixels = np.zeros((8, 8, 4), np.uint8)
    pixels[:, :3] = (colour, colour, colour, 255)
    pixels[:, 5:] = (255, 255, 255, 0)
    if kind == "RGBA":
        return png(pixels)
    stream = io.BytesIO()
    if kind == "LA":
        Image.fromarray(pixels[..., (1, 3)], "LA").save(stream, "PNG")
    else:
        flat = np.where(pixels[..., 3] > 0, 1, 0).astype(np.uint8)
        image = Image.fromarray(flat, "P")
        image.putpalette([0, 0, 0, colour, colour, colour])
        image.save(stream, "PNG", transparency=0)
    return stream.getvalue()


@pytest.mark.parametrize("kind", ["RGBA", "LA", "P"])
@pytest.mark.parametrize(
    ("mode", "cutoff"), [("MASK", None), ("MASK", 0.9), ("BLEND", None), ("OPAQUE", None)]
)
@pytest.mark.parametrize("colour", [40, 180])
def test_what_a_cut_out_leaves_away_does_not_count(tmp_path: Path, kind, mode, cutoff, colour):
    builder = GltfBuilder()
    fields = {"alphaMode": mode} | ({} if cutoff is None else {"alphaCutoff": cutoff})
    material = textured(builder, leaf(kind, colour), **fields)
    builder.node(mesh=quad(builder, material, UNIT), name="leaf")
    builder.node(mesh=builder.quad(material), name="bare")  # without coordinates
    scene = dl.load(builder.write(tmp_path))
    bright = {"RGBA": 3, "LA": 3, "P": 0}[kind]
    value = linear(colour) if mode != "OPAQUE" else (3 * linear(colour) + bright) / 8
    for name in ("leaf", "bare"):
        assert reflectance(scene, name) == pytest.approx(float(value), abs=0.003)


def test_half_transparent_texels_count_by_half(tmp_path: Path):
    pixels = np.zeros((4, 4, 4), np.uint8)
    pixels[:2], pixels[2:] = (200, 200, 200, 255), (20, 20, 20, 51)
    builder = GltfBuilder()
    builder.node(mesh=quad(builder, textured(builder, png(pixels), alphaMode="BLEND"), UNIT), name="veil")
    expected = (linear(200) + 0.2 * linear(20)) / 1.2
    assert reflectance(dl.load(builder.write(tmp_path)), "veil") == pytest.approx(float(expected), abs=0.002)


def test_a_part_that_is_all_transparent_has_the_mean_of_the_image(tmp_path: Path):
    builder = GltfBuilder()
    material = textured(builder, leaf("RGBA", 40), alphaMode="MASK")
    builder.node(mesh=quad(builder, material, UNIT * (0.2, 1) + (0.7, 0)), name="gap")
    assert reflectance(dl.load(builder.write(tmp_path)), "gap") == pytest.approx(float(linear(40)), abs=1e-9)


def test_the_emission_of_an_atlas_is_that_of_the_screen_alone(tmp_path: Path):
    builder = GltfBuilder()
    texture = {"index": builder.texture(png(atlas(64, 64, 255, 0)))}
    material = builder.material(name="panel", emissiveFactor=[1, 0.5, 0.25], emissiveTexture=texture)
    builder.node(mesh=quad(builder, material, UNIT * (0.45, 1)), name="screen")
    builder.node(mesh=quad(builder, material, UNIT * (0.4, 1) + (0.55, 0)), name="case")
    scene = dl.load(builder.write(tmp_path))
    emission = {mesh.name: scene.material(mesh.material[0]).emission for mesh in scene.meshes}
    np.testing.assert_allclose(emission["screen"], (1, 0.5, 0.25), rtol=1e-9)
    assert not emission["case"].any()
    assert scene.groups == ("screen",)
    assert not any(MEAN_GLOW in warning for warning in scene.warnings)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_few_bright_texels_beside_a_dark_object_shine(tmp_path: Path, order: tuple[int, int]):
    """An object on the black half of a page, and one on its other half, of which one texel in 64 is lit."""
    page = np.zeros((16, 32, 3), np.uint8)
    page[::8, 16::8] = 120
    builder = GltfBuilder()
    texture = {"index": builder.texture(png(page))}
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 1e5}}
    material = builder.material(
        name="panel", emissiveFactor=[1, 1, 1], emissiveTexture=texture, extensions=strength
    )
    for number in order:
        uv = UNIT * (0.5, 1) + (0.5 * number, 0)
        builder.node(mesh=quad(builder, material, uv), name=("dark", "lit")[number])
    scene = dl.load(builder.write(tmp_path))
    emission = {mesh.name: scene.material(mesh.material[0]).emission for mesh in scene.meshes}
    assert not emission["dark"].any()
    np.testing.assert_allclose(emission["lit"], 1e5 * linear(120) / 64, rtol=0.05)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_random_image_on_random_triangles(tmp_path: Path, seed: int):
    """Against the mean of a fine grid of places on each triangle."""
    rng = np.random.default_rng(seed)
    pixels = rng.integers(0, 255, (int(rng.integers(3, 40)), int(rng.integers(3, 40)), 3), dtype=np.uint8)
    uv = rng.uniform(-1.5, 2.5, (4, 2)).astype(np.float32)
    builder = GltfBuilder()
    builder.node(mesh=quad(builder, textured(builder, png(pixels)), uv), name="card")
    a, b = np.meshgrid(np.arange(600), np.arange(600))
    a, b = (a[a + b < 599] + 1 / 3) / 600, (b[a + b < 599] + 1 / 3) / 600
    values = []
    for one, two, three in ((0, 1, 2), (0, 2, 3)):
        place = uv[one] + a[:, None] * (uv[two] - uv[one]) + b[:, None] * (uv[three] - uv[one])
        index = np.floor(place % 1.0 * pixels.shape[1::-1]).astype(int)
        values.append(linear(pixels[index[:, 1], index[:, 0], 1]).mean())
    found = reflectance(dl.load(builder.write(tmp_path)), "card")
    assert found == pytest.approx(float(np.mean(values)), abs=0.008)  # two means that are alike, and the grid


def test_many_objects_of_one_texture_have_few_materials(tmp_path: Path):
    """All of a gradient, each a part of its own."""
    pixels = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    builder = GltfBuilder()
    material = textured(builder, png(pixels))
    for i in range(400):
        builder.node(mesh=quad(builder, material, UNIT * (0.002, 1) + (i / 400, 0)), name=f"part {i}")
    scene = dl.load(builder.write(tmp_path))
    assert len(scene.materials) < 200
    for i in (0, 199, 399):
        value = float(linear(255 * (i / 400 + 0.001)))
        assert reflectance(scene, f"part {i}") == pytest.approx(value, abs=0.02)


def test_tinted_parts_of_an_atlas(tmp_path: Path):
    """Vertex colours and texels multiply."""
    builder = GltfBuilder()
    material = textured(builder, png(atlas(16, 16, 255, 0)))
    mesh = quad(builder, material, UNIT * (0.45, 1))
    colours = builder.accessor(np.full((4, 3), 0.5, np.float32))
    builder.json["meshes"][mesh]["primitives"][0]["attributes"]["COLOR_0"] = colours
    builder.node(mesh=mesh, name="card")
    assert reflectance(dl.load(builder.write(tmp_path)), "card") == pytest.approx(0.5)


@pytest.mark.parametrize(("left", "right"), [(255, 60), (128, 230)])
def test_atlases_of_obj_files(tmp_path: Path, left: int, right: int):
    (tmp_path / "atlas.png").write_bytes(png(atlas(32, 8, left, right)))
    (tmp_path / "leaf.png").write_bytes(leaf("RGBA", left))
    (tmp_path / "a.mtl").write_text(
        "newmtl paint\nKd 0.5 0.5 0.5\nmap_Kd atlas.png\nnewmtl leaf\nmap_Kd leaf.png\n"
        "newmtl lamp\nKd 0 0 0\nKe 8 8 8\nmap_Ke atlas.png\n"
    )
    lines = ["mtllib a.mtl"]
    objects = {
        "one": ("paint", 0.0, 0.45),
        "two": ("paint", 0.55, 1.0),
        "leaf": ("leaf", 0.0, 1.0),
        "lamp": ("lamp", 0.0, 0.4),
    }
    for k, (name, (material, low, high)) in enumerate(objects.items()):
        lines.append(f"o {name}\nusemtl {material}")
        for x, y in ((low, 0), (high, 0), (high, 1), (low, 1)):
            lines.append(f"v {x} {y} {k}\nvt {x} {y}")
        lines.append("f " + " ".join(f"{4 * k + i}/{4 * k + i}" for i in (1, 2, 3, 4)))
    (tmp_path / "scene.obj").write_text("\n".join(lines) + "\n")
    scene = dl.load(tmp_path / "scene.obj")
    assert reflectance(scene, "one") == pytest.approx(float(linear(left)) / 2, abs=0.002)
    assert reflectance(scene, "two") == pytest.approx(float(linear(right)) / 2, abs=0.002)
    assert reflectance(scene, "leaf") == pytest.approx(float(linear(left)), abs=0.003)
    np.testing.assert_allclose(scene.material("lamp").emission, 8 * linear(left), rtol=0.01)
    assert [m.name for m in scene.materials] == ["paint", "paint on two", "leaf", "lamp"]


# ---- textures that cannot be read -------------------------------------------------------------------------


def bomb(width: int) -> bytes:
    stream = io.BytesIO()
    Image.new("1", (width, 10_000)).save(stream, "PNG", optimize=True)
    assert len(stream.getvalue()) < 100_000
    return stream.getvalue()


def bitmap(kind: str) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (4, 4)).save(stream, kind)
    return stream.getvalue()


WHOLE = png(np.random.default_rng(0).integers(0, 255, (32, 32, 3), dtype=np.uint8))
BROKEN = {
    "nothing": b"",
    "cut off in the header": WHOLE[:20],
    "cut off in the data": WHOLE[: len(WHOLE) // 2],
    "zeros": WHOLE[:8] + bytes(40),
    "text": b"<html>404 Not Found</html>",
    "BMP": bitmap("BMP"),
    "GIF": bitmap("GIF"),
    "TIFF": bitmap("TIFF"),
    "KTX2": b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80),
    "DDS": b"DDS " + bytes(124),
    "a decompression bomb": bomb(20_000),
    "more pixels than allowed": bomb(12_000),
}
FACTOR = (0.5, 0.25, 0.125)


def check_counts_as_white(builder: GltfBuilder, folder: Path, *said: str) -> None:
    pbr = {"baseColorFactor": [*FACTOR, 1], "baseColorTexture": {"index": 0}, "metallicFactor": 0}
    wall = builder.material(name="wall", pbrMetallicRoughness=pbr)
    lamp = builder.material(name="lamp", emissiveFactor=[1, 0.5, 0], emissiveTexture={"index": 0})
    builder.node(mesh=quad(builder, wall, UNIT), name="a wall")
    builder.node(mesh=quad(builder, lamp, UNIT), name="a lamp")
    scene = dl.load(builder.write(folder))
    np.testing.assert_allclose(scene.material("wall").reflectance, FACTOR)
    np.testing.assert_allclose(scene.material("lamp").emission, (1, 0.5, 0))
    (told,) = [w for w in scene.warnings if "cannot be read: the plain colour counts" in w]
    for text in ('material "wall"', 'material "lamp"', *said):
        assert text in told
    assert not any("mean colour" in w for w in scene.warnings)


@pytest.mark.parametrize("image", BROKEN.values(), ids=BROKEN)
@pytest.mark.parametrize("how", ["binary chunk", "data URI", "file"])
def test_broken_images_count_as_white(tmp_path: Path, image: bytes, how: str):
    builder = GltfBuilder()
    builder.json["textures"] = [{"source": 0}]
    if how == "binary chunk":
        builder.json["images"] = [{"bufferView": builder.view(image)}]
    elif how == "data URI":
        uri = "data:image/png;base64," + base64.b64encode(image).decode()
        builder.json["images"] = [{"uri": uri}]
    else:
        (tmp_path / "an image.png").write_bytes(image)
        builder.json["images"] = [{"uri": "an%20image.png"}]
    check_counts_as_white(builder, tmp_path, "images[0]: found")


@pytest.mark.parametrize(
    ("image", "said"),
    [
        ({"uri": "wood.png"}, 'no file "wood.png"'),
        ({"uri": "https://example.com/wood.png"}, "a relative path below the file's folder"),
        ({"uri": "../wood.png"}, "leads out of the file's folder"),
        ({"uri": "/etc/hostname"}, "a relative path below the file's folder"),
        ({"uri": "."}, "no regular file"),
        ({"uri": "data:image/png;base64"}, "a data URI without a comma"),
        ({"uri": "data:image/png;base64,#"}, "images[0]: found"),
        ({"bufferView": 99}, "found 99, expected an index below"),
        ({}, "found no data"),
    ],
)
def test_images_that_are_not_there_count_as_white(tmp_path: Path, image: dict, said: str):
    builder = GltfBuilder()
    builder.json["images"], builder.json["textures"] = [image], [{"source": 0}]
    check_counts_as_white(builder, tmp_path, said)


@pytest.mark.parametrize(
    ("texture", "said"),
    [
        (
            {"extensions": {"KHR_texture_basisu": {"source": 0}}},
            "found KHR_texture_basisu, expected an image of PNG",
        ),
        ({}, "found no image"),
        ({"source": 7}, "found 7, expected an index below 1"),
        ({"source": 0, "sampler": 3}, "found 3, expected an index below 0"),
    ],
)
def test_textures_without_a_usable_image_count_as_white(tmp_path: Path, texture: dict, said: str):
    builder = GltfBuilder()
    builder.texture(WHOLE)
    builder.json["textures"] = [texture]
    check_counts_as_white(builder, tmp_path, said)


def test_a_buffer_view_beyond_its_buffer_counts_as_white(tmp_path: Path):
    builder = GltfBuilder()
    builder.texture(WHOLE)
    builder.json["bufferViews"][0]["byteLength"] = 1 << 30
    check_counts_as_white(builder, tmp_path, "bufferViews[0]")


@pytest.mark.parametrize("name", ["gone.png", "../wood.png", "broken.png"])
def test_unreadable_textures_of_obj_files(tmp_path: Path, name: str):
    (tmp_path / "broken.png").write_bytes(WHOLE[:50])
    (tmp_path / "a.mtl").write_text(f"newmtl wall\nKd 0.5 0.25 0.125\nmap_Kd {name}\n")
    text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nusemtl wall\nf 1/1 2/1 3/1\n"
    (tmp_path / "scene.obj").write_text(text)
    scene = dl.load(tmp_path / "scene.obj")
    np.testing.assert_allclose(scene.material("wall").reflectance, FACTOR)
    (told,) = [w for w in scene.warnings if "cannot be read: the plain colour counts" in w]
    assert 'material "wall" map_Kd' in told
