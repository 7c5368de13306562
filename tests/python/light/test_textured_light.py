# SPDX-License-Identifier: Apache-2.0
"""Textures in light: as if each texel were a surface of its own, with every promise of sessions kept."""

from __future__ import annotations

import gc
import io
from dataclasses import replace

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import GltfBuilder, png
from deltalux.scene import core_textures, replace_scene
from deltalux.scene.look import NEAREST, WRAPS, Look, Texture
from deltalux.texels import LINEAR_OF_BYTE, linear_to_srgb, srgb_texels
from edit_sequences import apply, equals_recompute
from PIL import Image
from scenes_for_tests import BOX_SIDES, box, joined, quad
from shared_sessions import Shared

FLOOR = quad((0, 0, 0), (0, 0, 3), (4, 0, 0))
UV = np.array([(0, 0), (0, 1), (1, 1), (1, 0)], np.float32)[FLOOR.triangles]  # u along x, v along z
WHITE = 0.8  # reflectance of a white texel
TEXELS = 6


def pixels(seed: int = 1) -> np.ndarray:
    """Dark and bright texels of three channels, at random."""
    return np.random.default_rng(seed).choice([30, 120, 240], (TEXELS, TEXELS, 3)).astype(np.uint8)


def texture(texels: np.ndarray, **fields) -> Texture:
    return Texture(png(texels), LINEAR_OF_BYTE[texels].reshape(-1, 3).mean(axis=0), **fields)


def walls() -> list[dl.Mesh]:
    lamp = quad((1.5, 2.6, 1), (1, 0, 0), (0, 0, 1))  # faces down
    room = box((0, 0, 0), (4, 2.7, 3), [side for side in BOX_SIDES if side != "floor"])
    return [room.mesh("walls", "wall"), lamp.mesh("lamp", "lamp")]


MATERIALS = [dl.Material("wall", (0.6, 0.5, 0.4)), dl.Material("lamp", (0, 0, 0), (5, 5, 5))]


def painted(texels: np.ndarray, **fields) -> dl.Scene:
    """A room whose floor has a texture; a box on it, which moves, has it too."""
    own = texture(texels, **fields)
    floor = dl.Material("floor", WHITE * own.mean, look=Look(own))
    block = box((1, 0, 1), (1.6, 0.5, 1.4)).flipped()
    places = np.random.default_rng(2).uniform(-1, 2, (len(block.triangles), 3, 2)).astype(np.float32)
    meshes = [*walls(), FLOOR.mesh("floor", "floor", coordinates=UV)]
    meshes.append(block.mesh("block", "floor", coordinates=places, movable=True))
    return dl.Scene(meshes, [*MATERIALS, floor])


def laid(texels: np.ndarray) -> dl.Scene:
    """The same room without the box, whose floor is laid of as many plain tiles as there are texels."""
    height, width = texels.shape[:2]
    size = 4 / width, 3 / height
    materials, tiles = {}, []
    for row in range(height):
        for column in range(width):
            name = f"tile {texels[row, column].tolist()}"
            materials[name] = dl.Material(name, WHITE * LINEAR_OF_BYTE[texels[row, column]])
            tile = quad((size[0] * column, 0, size[1] * row), (0, 0, size[1]), (size[0], 0, 0))
            tiles.append((name, tile))
    floor = joined(*(tile for _, tile in tiles))
    names = list(materials)
    index = np.repeat([names.index(name) for name, _ in tiles], 2)
    mesh = dl.Mesh("floor", floor.vertices, floor.triangles, names, index)
    return dl.Scene([*walls(), mesh], [*MATERIALS, *materials.values()])


def places() -> dl.Samples:
    """Just above the floor and below the ceiling, facing down."""
    x, z = np.meshgrid(np.linspace(0.2, 3.8, 13), np.linspace(0.2, 2.8, 9))
    points = [np.stack([x.ravel(), np.full(x.size, y), z.ravel()], axis=1) for y in (0.06, 2.65)]
    return dl.Samples(np.concatenate(points), np.tile((0, -1, 0), (2 * x.size, 1)), 0.1)


def light(scene: dl.Scene, **options) -> np.ndarray:
    with dl.Session(scene, places(), paths=100_000, **options) as session:
        session.bake()
        return session.irradiance


def apart(found: np.ndarray, expected: np.ndarray) -> float:
    """RMS difference, relative to the mean, of the channel that differs most."""
    return float((np.sqrt(((found - expected) ** 2).mean(axis=0)) / expected.mean(axis=0)).max())


@pytest.mark.parametrize(("rays", "most"), [("off", 0.001), (512, 0.01)])
def test_texels_are_as_tiles(rays, most: float):
    """Each path meets the same reflectances, so discs differ by rounding; gather rays choose otherwise.

    Near the floor, light varies five times from tile to tile.
    """
    texels = pixels()
    scene = painted(texels, mag_filter=NEAREST)
    scene = replace_scene(scene, meshes=[m for m in scene.meshes if m.name != "block"])
    found, expected = light(scene, gather=rays), light(laid(texels), gather=rays)
    assert np.ptp(expected[:117], axis=0).min() > 0.5 * expected[:117].mean()
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.003)
    assert apart(found, expected) < most


def test_a_file_s_image_lies_as_gltf_says(tmp_path):
    """Close above each quarter of a floor, light has the colour of that quarter; v points down the image."""
    colours = np.array([[(250, 40, 40), (40, 250, 40)], [(40, 40, 250), (240, 240, 40)]], np.uint8)
    builder = GltfBuilder()
    texture = {"index": builder.texture(png(colours))}
    builder.json["samplers"] = [{"magFilter": NEAREST}]
    builder.json["textures"][0]["sampler"] = 0
    pbr = {"baseColorTexture": texture, "baseColorFactor": [0.8, 0.8, 0.8, 1], "metallicFactor": 0}
    corners = np.array([(0, 0, 0), (0, 0, 2), (2, 0, 2), (2, 0, 0)], np.float32)
    attributes = {
        "POSITION": builder.accessor(corners),
        "TEXCOORD_0": builder.accessor(np.ascontiguousarray(corners[:, [0, 2]] / 2)),
    }
    primitive = {
        "attributes": attributes,
        "indices": builder.accessor(np.array([0, 1, 2, 0, 2, 3], np.uint16)),
        "material": builder.material(name="floor", pbrMetallicRoughness=pbr),
    }
    builder.node(mesh=builder.mesh(primitive), name="floor")
    scene = dl.load(builder.write(tmp_path))
    lamp = dl.PointLight("lamp", (1, 2, 1), (50, 50, 50))
    points = np.array([(x, 0.05, z) for z in (0.5, 1.5) for x in (0.5, 1.5)])
    samples = dl.Samples(points, np.tile((0, -1, 0), (4, 1)), 0.02)
    with dl.Session(replace_scene(scene, lights=[lamp]), samples, paths=2000, gather=256) as session:
        session.bake()
        found = session.irradiance / session.irradiance.sum(axis=1, keepdims=True)
    linear = LINEAR_OF_BYTE[colours].reshape(4, 3)
    np.testing.assert_allclose(found, linear / linear.sum(axis=1, keepdims=True), atol=0.03)


def test_a_mapping_turns_scales_and_wraps():
    """Two mappings of one place in the image are one surface."""
    texels = pixels(3)
    plain = light(painted(texels, mag_filter=NEAREST), gather="off")
    scene = painted(texels, mag_filter=NEAREST, offset=(7.0, -2.0), scale=(0.5, 0.25))
    meshes = [
        m if m.coordinates is None else replace(m, coordinates=m.coordinates * np.float32((2, 4)))
        for m in scene.meshes
    ]
    np.testing.assert_allclose(light(replace_scene(scene, meshes=meshes), gather="off"), plain, rtol=1e-3)


def test_beyond_its_edges_an_image_goes_on_as_it_says():
    """Clamped along u and mirrored along v, twice its size: as an image that holds all of that."""
    texels = pixels(4)
    wide = np.concatenate([texels, np.repeat(texels[:, -1:], TEXELS, axis=1)], axis=1)
    whole = painted(np.concatenate([wide, wide[::-1]]), mag_filter=NEAREST)
    wrapped = painted(texels, mag_filter=NEAREST, wrap=WRAPS[1:])
    found = []
    for scene, scale in ((whole, 1), (wrapped, 2)):
        floor = next(m for m in scene.meshes if m.name == "floor")
        meshes = [*walls(), replace(floor, coordinates=np.float32(scale) * UV)]
        found.append(light(replace_scene(scene, meshes=meshes), gather="off"))
    assert apart(found[1], found[0]) < 0.001


def test_what_has_no_coordinates_has_the_mean():
    texels = pixels()
    scene = painted(texels)
    bare = replace_scene(scene, meshes=[replace(m, coordinates=None) for m in scene.meshes])
    plain = [replace(m, look=Look()) for m in scene.materials]
    grey = replace_scene(bare, materials=plain)
    assert np.array_equal(light(bare, gather="off"), light(grey, gather="off"))
    assert not np.array_equal(light(scene, gather="off"), light(grey, gather="off"))


@pytest.mark.parametrize(("mode", "kept"), [("OPAQUE", 1), ("BLEND", 90 / 255)])
def test_what_alpha_hides_has_the_mean(mode: str, kept: float):
    """Of a diffuse surface: as if hidden texels, one of two, were mixed with the mean of what is opaque."""
    texels = pixels()
    alpha = np.where(np.arange(TEXELS * TEXELS).reshape(TEXELS, TEXELS) % 2, 90, 255).astype(np.uint8)
    linear, weight = LINEAR_OF_BYTE[texels], np.where(alpha == 90, kept, 1)[..., None]
    mean = (linear * weight).mean(axis=(0, 1)) / weight.mean()
    mixed = np.round(255 * linear_to_srgb(weight * linear + (1 - weight) * mean)).astype(np.uint8)
    scene, expected = painted(texels, mag_filter=NEAREST), painted(mixed, mag_filter=NEAREST)
    image = png(np.concatenate([texels, alpha[..., None]], axis=2))
    look = Look(replace(scene.materials[-1].look.colour, image=image, mean=mean), alpha_mode=mode)
    clear = replace(scene.materials[-1], look=look, reflectance=WHITE * mean)
    found = light(replace_scene(scene, materials=[*MATERIALS, clear]), gather="off")
    assert apart(found, light(expected, gather="off")) < 0.005  # because `mixed` is of bytes


EDITS = [
    [("nudge", "block", (0.7, 0, 0.4))],
    [("paint", "floor", 0.9)],  # brighter than its texels allow
    [("toggle", "block"), ("paint", "floor", 0.1)],
    [("toggle", "block"), ("paint", "wall", 0.2)],
]


@pytest.mark.parametrize("rays", ["off", 64])
@pytest.mark.parametrize("threads", [1, 2])
def test_updates_are_exact(rays, threads: int):
    with dl.Session(painted(pixels()), places(), paths=5000, gather=rays, threads=threads) as session:
        session.bake()
        before = session.irradiance.copy()
        for edits in EDITS:
            for edit in edits:
                apply(session, edit)
            session.update()
            equals_recompute(session)
        session.move("block", np.eye(4))
        for name in ("floor", "wall"):
            session.set_reflectance(name, session.scene.material(name).reflectance)
        session.update()
        assert np.array_equal(session.irradiance, before)


def test_shared_paths_and_files_are_exact(tmp_path):
    options = {"paths": 4000, "gather": 64, "threads": 1}
    scene = painted(pixels())
    with dl.Session(scene, places(), **options) as one:
        one.bake()
        with Shared(scene, places(), [(0, 1500), (1500, 4000)], **options) as shared:
            shared.bake()
            shared.equals(one)
        one.save(tmp_path / "room.dlx")
        with dl.Session.open(tmp_path / "room.dlx") as opened:
            assert opened.digest() == one.digest()
            for session in (one, opened):
                for edit in [*EDITS[0], *EDITS[1]]:
                    apply(session, edit)
                session.update()
            assert opened.digest() == one.digest()
            assert np.array_equal(opened.irradiance, one.irradiance)


def test_a_file_whose_image_decodes_otherwise_here_is_refused(tmp_path, monkeypatch):
    with dl.Session(painted(pixels()), places(), paths=500, gather=64) as session:
        session.bake()
        session.save(tmp_path / "room.dlx")
    monkeypatch.setattr(core_textures, "srgb_texels", lambda *given: srgb_texels(*given) // 2)
    with pytest.raises(dl.FormatError, match="decodes to other texels here"):
        dl.Session.open(tmp_path / "room.dlx")


def test_an_image_is_decoded_once(tmp_path, monkeypatch):
    """By a session, by another one beside it, and by the file that it is saved to."""
    calls = []
    monkeypatch.setattr(
        core_textures, "srgb_texels", lambda *given: calls.append(given) or srgb_texels(*given)
    )
    scene = painted(pixels(7))
    with dl.Session(scene, places(), paths=500, gather=64) as session:
        dl.Session(scene, places()).close()
        session.bake()
        session.save(tmp_path / "room.dlx")
        assert len(calls) == 1
    del session
    gc.collect()
    dl.Session(scene, places()).close()
    assert len(calls) == 2  # nobody had kept it


def test_a_mesh_that_is_added_has_its_texture():
    scene = painted(pixels())
    chair = replace(
        scene.meshes[-1], name="chair", vertices=scene.meshes[-1].vertices + np.array((1, 0, 0.5))
    )
    with dl.Session(scene, places(), paths=5000, gather="off") as session:
        session.bake()
        session.add(chair)
        session.update()
        equals_recompute(session)
        textured = session.irradiance.copy()
        session.remove("chair")
        session.add(replace(chair, name="plain", coordinates=None))
        session.update()
        assert not np.array_equal(session.irradiance, textured)


def test_an_image_that_cannot_be_decoded_is_refused():
    scene = painted(pixels())
    broken = replace(scene.materials[-1].look.colour, image=scene.materials[-1].look.colour.image[:60])
    materials = [*MATERIALS, replace(scene.materials[-1], look=Look(broken))]
    with pytest.raises(
        dl.SceneError, match='material "floor": texture: found an image that cannot be decoded'
    ):
        dl.Session(replace_scene(scene, materials=materials), places())


# ---- large images ----------------------------------------------------------------------------------------


def test_large_images_are_halved_in_linear_light():
    rng = np.random.default_rng(5)
    texels = rng.integers(0, 256, (37, 50, 3), dtype=np.uint8)
    found = srgb_texels(png(texels), "image", 16)
    assert found.shape == (10, 13, 4) and (found[..., 3] == 255).all()
    padded = np.pad(LINEAR_OF_BYTE[texels[:36]], ((0, 0), (0, 2), (0, 0)), mode="edge")
    means = padded.reshape(9, 4, 13, 4, 3).mean(axis=(1, 3))
    expected = np.round(255 * linear_to_srgb(means))
    assert np.abs(found[:9, :, :3] - expected).max() <= 1  # by rounding in single precision
    assert np.array_equal(srgb_texels(png(texels), "image", 50)[..., :3], texels)


def test_halves_are_of_what_counts():
    texels = np.array([[(200, 100, 50, 255), (9, 9, 9, 0)], [(100, 200, 50, 255), (7, 7, 7, 0)]], np.uint8)
    found = srgb_texels(png(texels), "image", 1, np.arange(256) / 255)
    mean = LINEAR_OF_BYTE[texels[:, 0, :3]].mean(axis=0)
    assert np.array_equal(found, [[[*np.round(255 * linear_to_srgb(mean)), 128]]])
    assert np.array_equal(srgb_texels(png(texels), "image", 2, np.zeros(256))[..., 3], np.zeros((2, 2)))


def test_all_images_of_a_scene_fit_into_their_memory(monkeypatch):
    monkeypatch.setattr(core_textures, "MOST_BYTES", 4 * 64 * 64)
    sizes = []
    monkeypatch.setattr(
        core_textures, "srgb_texels", lambda *given: sizes.append(given[2]) or srgb_texels(*given)
    )
    stream = io.BytesIO()
    Image.new("RGB", (100, 64), (9, 9, 9)).save(stream, "PNG")
    scene = painted(pixels())
    images = [
        replace(scene.materials[-1].look.colour, image=data) for data in (stream.getvalue(), png(pixels(4)))
    ]
    materials = [dl.Material(f"m{i}", look=Look(image)) for i, image in enumerate(images)]
    dl.Session(replace_scene(scene, materials=[*scene.materials, *materials]), places()).close()
    assert sizes == [64, 64, 64]  # half of 100 fits
