# SPDX-License-Identifier: Apache-2.0
"""glTF materials: reflectance, emission, textures, and what is said not to be honoured."""

import io

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD, GltfBuilder, png
from deltalux.scene.adding import NO_LIGHT
from PIL import Image


def load(builder, tmp_path, name="scene.glb"):
    return dl.load(builder.write(tmp_path, name))


def only_material(tmp_path, builder, **fields):
    builder.node(mesh=builder.quad(builder.material(**fields)))
    (material,) = load(builder, tmp_path).materials
    return material


def linear(byte):
    value = byte / 255
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def test_base_colour_is_the_reflectance(tmp_path):
    material = only_material(tmp_path, GltfBuilder(), name="paint", colour=(0.1, 0.2, 0.3))
    assert material.name == "paint"
    np.testing.assert_allclose(material.reflectance, (0.1, 0.2, 0.3))
    assert not material.emissive


@pytest.mark.parametrize("double_sided", [False, True])
def test_emission(tmp_path, double_sided):
    builder = GltfBuilder()
    builder.use("KHR_materials_emissive_strength")
    material = only_material(
        tmp_path,
        builder,
        emissiveFactor=[1, 0.5, 0.25],
        doubleSided=double_sided,
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 400}},
    )
    np.testing.assert_allclose(material.emission, (400, 200, 100))
    assert material.two_sided is double_sided
    assert material.group is None


def test_emission_without_strength(tmp_path):
    material = only_material(tmp_path, GltfBuilder(), emissiveFactor=[1, 0.5, 0])
    np.testing.assert_allclose(material.emission, (1, 0.5, 0))


def test_texture_is_averaged_after_srgb_decoding(tmp_path):
    builder = GltfBuilder()
    pixels = np.zeros((2, 2, 3), np.uint8)
    pixels[0, 0] = 255, 128, 10
    pixels[1, 0] = 64, 0, 3
    texture = {"index": builder.texture(png(pixels))}
    material = only_material(
        tmp_path,
        builder,
        pbrMetallicRoughness={
            "baseColorFactor": [0.5, 1, 1, 1],
            "baseColorTexture": texture,
            "metallicFactor": 0,
        },
        emissiveFactor=[2, 1, 1],
        emissiveTexture=texture,
    )
    mean = np.array([[linear(v) for v in p] for p in pixels.reshape(-1, 3)]).mean(axis=0)
    np.testing.assert_allclose(material.reflectance, mean * (0.5, 1, 1), rtol=1e-12)
    np.testing.assert_allclose(material.emission, mean * (2, 1, 1), rtol=1e-12)


@pytest.mark.parametrize("mode", ["L", "LA", "P", "RGBA", "I;16", "1", "JPEG", "WEBP"])
def test_image_kinds(tmp_path, mode):
    flat = Image.new("RGB", (8, 8), (200, 200, 200))
    stream = io.BytesIO()
    if mode in ("JPEG", "WEBP"):
        flat.save(stream, mode, **({"lossless": True} if mode == "WEBP" else {}))
    elif mode == "I;16":
        Image.fromarray(np.full((8, 8), 200 * 257, np.uint16)).save(stream, "PNG")
    elif mode == "1":
        Image.new("1", (8, 8), 1).save(stream, "PNG")
    else:
        image = flat.quantize() if mode == "P" else flat.convert(mode)
        if mode in ("RGBA", "LA"):
            image.putalpha(0)  # alpha is not regarded
        image.save(stream, "PNG")
    builder = GltfBuilder()
    texture = builder.texture(stream.getvalue())
    material = only_material(tmp_path, builder, pbrMetallicRoughness={"baseColorTexture": {"index": texture}})
    expected = 1.0 if mode == "1" else linear(200)
    np.testing.assert_allclose(material.reflectance, [expected] * 3, rtol=0.02 if mode == "JPEG" else 1e-12)


def test_external_image_and_texture_transform_required(tmp_path):
    (tmp_path / "wood.png").write_bytes(png(np.full((2, 2, 3), 100, np.uint8)))
    builder = GltfBuilder()
    builder.use("KHR_texture_transform", required=True)
    builder.json["images"] = [{"uri": "wood.png"}]
    builder.json["textures"] = [{"source": 0}]
    transform = {"KHR_texture_transform": {"scale": [7, 7]}}
    material = only_material(
        tmp_path,
        builder,
        pbrMetallicRoughness={"baseColorTexture": {"index": 0, "extensions": transform}},
    )
    np.testing.assert_allclose(material.reflectance, [linear(100)] * 3)


def test_webp_texture_extension_comes_first(tmp_path):
    stream = io.BytesIO()
    Image.new("RGB", (4, 4), (50, 50, 50)).save(stream, "WEBP", lossless=True)
    builder = GltfBuilder()
    builder.texture(png(np.full((4, 4, 3), 255, np.uint8)))
    webp = builder.texture(stream.getvalue())
    builder.use("EXT_texture_webp", required=True)
    builder.json["textures"][0]["extensions"] = {"EXT_texture_webp": {"source": webp}}
    material = only_material(tmp_path, builder, pbrMetallicRoughness={"baseColorTexture": {"index": 0}})
    np.testing.assert_allclose(material.reflectance, [linear(50)] * 3)


def test_specular_glossiness_counts_with_its_diffuse_part(tmp_path):
    builder = GltfBuilder()
    builder.use("KHR_materials_pbrSpecularGlossiness", required=True)
    texture = {"index": builder.texture(png(np.full((2, 2, 3), 128, np.uint8)))}
    glossy = {"diffuseFactor": [0.5, 1, 0, 1], "diffuseTexture": texture, "specularFactor": [1, 1, 1]}
    material = only_material(
        tmp_path,
        builder,
        pbrMetallicRoughness={"baseColorFactor": [0, 0, 0, 1]},
        extensions={"KHR_materials_pbrSpecularGlossiness": glossy},
    )
    np.testing.assert_allclose(material.reflectance, np.array([0.5, 1, 0]) * linear(128))


@pytest.mark.parametrize("given", [None, 0.0, 0.35, 1])
def test_no_material_is_light_grey_with_a_warning_that_names_the_remedy(tmp_path, given):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad())
    builder.node(mesh=builder.quad())
    scene = dl.load(builder.write(tmp_path), **({} if given is None else {"reflectance": given}))
    value = 0.8 if given is None else given
    assert [m.name for m in scene.materials] == ["default"]
    np.testing.assert_array_equal(scene.materials[0].reflectance, (value,) * 3)
    told = [w for w in scene.warnings if "without a material" in w]
    assert told == [
        f"surfaces without a material reflect {value:g}, as light paint does; another reflectance: "
        "--reflectance R (reflectance=R)"
    ]


def test_a_material_is_never_replaced_by_the_reflectance_of_missing_ones(tmp_path):
    material = only_material(tmp_path, GltfBuilder(), name="white")
    np.testing.assert_array_equal(material.reflectance, (1, 1, 1))


@pytest.mark.parametrize("given", [-0.1, 1.01, np.nan, np.inf])
def test_a_reflectance_beyond_0_to_1_is_refused(tmp_path, given):
    with pytest.raises(dl.OptionError, match=r"reflectance: found .*, expected a number from 0 to 1"):
        dl.load(tmp_path / "any.glb", reflectance=given)


def test_repeated_and_missing_material_names_are_unique(tmp_path):
    builder = GltfBuilder()
    for name in ("paint", "paint", None):
        fields = {"name": name} if name else {}
        builder.node(mesh=builder.quad(builder.material(colour=(0.1, 0.1, 0.1), **fields)))
    assert [m.name for m in load(builder, tmp_path).materials] == ["paint", "paint#2", "material2"]


def test_reflectance_is_clipped(tmp_path):
    material = only_material(tmp_path, GltfBuilder(), colour=(1.5, -0.5, 0.5))
    np.testing.assert_array_equal(material.reflectance, (1, 0, 0.5))


def test_each_kind_of_thing_not_honoured_gives_one_warning(tmp_path):
    builder = GltfBuilder()
    extensions = ("KHR_materials_unlit", "KHR_materials_sheen", "KHR_materials_variants", "VENDOR_toy")
    for name in extensions:
        builder.use(name)
    texture = {"index": builder.texture(png(np.full((2, 2, 3), 9, np.uint8)))}
    for _ in range(3):
        material = builder.material(
            name="m",
            alphaMode="BLEND",
            normalTexture=texture,
            occlusionTexture=texture,
            pbrMetallicRoughness={"metallicFactor": 1, "baseColorTexture": texture},
            extensions={"KHR_materials_unlit": {}, "KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1]}},
        )
        colours = builder.accessor(np.ones((4, 4), np.float32))
        attributes = {"POSITION": builder.accessor(QUAD), "COLOR_0": colours}
        builder.node(mesh=builder.mesh({"attributes": attributes, "mode": 6, "material": material}), name="n")
    warnings = load(builder, tmp_path).warnings
    expected = [f"extension {name} is present but not honoured" for name in sorted(extensions)]
    expected += [
        "metals count as diffuse (m, m#2, m#3)",
        "normal maps are not honoured (m, m#2, m#3)",
        "occlusion maps are not honoured (m, m#2, m#3)",
        NO_LIGHT,
    ]
    assert sorted(warnings) == sorted(expected)


def test_appearance_extensions_may_be_required(tmp_path):
    builder = GltfBuilder()
    builder.use("KHR_materials_sheen", required=True)
    builder.node(mesh=builder.quad())
    assert "extension KHR_materials_sheen is present but not honoured" in load(builder, tmp_path).warnings


def test_names_lose_what_cannot_be_printed(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(), name="a\x1b[31m\nb\ud800")
    (mesh,) = load(builder, tmp_path, "scene.gltf").meshes
    assert (
        mesh.name == "a\N{REPLACEMENT CHARACTER}[31m" + "\N{REPLACEMENT CHARACTER}b\N{REPLACEMENT CHARACTER}"
    )
