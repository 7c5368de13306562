# SPDX-License-Identifier: Apache-2.0
"""Textures in pictures with light per pixel: texels where they belong, the mean where many share a pixel."""

from __future__ import annotations

from dataclasses import replace

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import png
from deltalux.outputs.camera import look_at
from deltalux.outputs.images import render
from deltalux.outputs.textures import Mipmap
from deltalux.outputs.tone import encode_srgb, tone_map
from deltalux.rendering import render_session
from deltalux.scene.look import Look, Texture
from deltalux.texels import LINEAR_OF_BYTE
from scipy.ndimage import zoom

REPEAT, CLAMP, MIRROR = 10497, 33071, 33648
NEAREST = 9728
CORNERS = np.array([(-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)], float)  # from the upper left, clockwise
FACES = [(0, 2, 1), (0, 3, 2)]
UV = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)[np.array(FACES)]
PIXELS = np.array(
    [[(250, 30, 30), (30, 250, 30)], [(30, 30, 250), (240, 240, 240)]], np.uint8
)  # red, green; blue, white


def texture(pixels: np.ndarray = PIXELS, **fields) -> Texture:
    return Texture(png(pixels), LINEAR_OF_BYTE[pixels].reshape(-1, 3).mean(axis=0), **fields)


def wall(look: Look, reflectance, emission=(0, 0, 0), repeats: float = 1.0) -> dl.Scene:
    """A wall of 2 x 2 m that fills the picture, seen from its front, and a lamp."""
    material = dl.Material("wall", reflectance, emission, look=look)
    return dl.Scene(
        [dl.Mesh("wall", CORNERS, FACES, "wall", coordinates=repeats * UV)],
        [material],
        [dl.PointLight("lamp", (0, 0, 2), (10, 10, 10))],
        cameras=[dl.Camera("front", look_at(np.array([0, 0, 1.0]), np.zeros(3)), np.pi / 2)],
    )


def rendered(scene: dl.Scene, size=(64, 64)):
    samples = dl.Samples(np.zeros((0, 3)), np.zeros((0, 3)))
    with dl.Session(scene, samples, paths=1000, gather=32) as session:
        session.bake()
        return render_session(session, size=size)


def albedo(rendering) -> np.ndarray:
    return rendering.pixels(rendering.albedo)


def test_texels_are_where_the_coordinates_put_them():
    """Nearest texels of two by two: the picture's four quarters, the image's first row above."""
    own = texture(mag_filter=NEAREST)
    found = albedo(rendered(wall(Look(own), own.mean)))
    middles = found[16::32, 16::32]
    np.testing.assert_allclose(middles, LINEAR_OF_BYTE[PIXELS], rtol=1e-5)


def test_between_texels_colours_are_linear():
    """Against linear interpolation of the image by SciPy, away from its border."""
    own = texture(wrap=(CLAMP, CLAMP))
    found = albedo(rendered(wall(Look(own), own.mean)))
    expected = zoom(LINEAR_OF_BYTE[PIXELS], (32, 32, 1), order=1, mode="nearest", grid_mode=True)
    np.testing.assert_allclose(found, expected, atol=0.02)


def test_the_mean_of_a_picture_is_the_reflectance_that_light_has():
    own = texture()
    found = albedo(rendered(wall(Look(own), 0.5 * own.mean, repeats=3.0)))
    np.testing.assert_allclose(found.mean(axis=(0, 1)), 0.5 * own.mean, rtol=0.01)


def test_many_texels_in_a_pixel_show_their_mean():
    """200 repetitions along 64 pixels: without averaging the spread is that of the texels, 0.4."""
    own = texture()
    found = albedo(rendered(wall(Look(own), own.mean, repeats=200.0)))
    np.testing.assert_allclose(found, np.broadcast_to(own.mean, found.shape), rtol=0.02)


def test_luminous_textures_glow():
    own = texture(mag_filter=NEAREST)
    scene = wall(Look(glow=own), (0, 0, 0), emission=7 * own.mean)
    rendering = rendered(scene)
    found = rendering.pixels(rendering.radiance)[16::32, 16::32]
    np.testing.assert_allclose(found, 7 * LINEAR_OF_BYTE[PIXELS], rtol=1e-5)


def test_surfaces_without_coordinates_keep_the_mean():
    own = texture()
    scene = wall(Look(own), own.mean)
    bare = replace(scene.meshes[0], coordinates=np.full((2, 3, 2), np.nan))
    found = albedo(rendered(dl.scene.replace_scene(scene, meshes=[bare])))
    np.testing.assert_allclose(found, np.broadcast_to(own.mean, found.shape), rtol=1e-6)


def test_a_reflectance_that_was_edited_scales_the_texture():
    own = texture(mag_filter=NEAREST)
    scene = wall(Look(own), own.mean)
    with dl.Session(scene, dl.Samples([(0, 0, 0)], [(0, 0, 1)]), paths=1000, gather=32) as session:
        session.bake()
        session.set_reflectance("wall", 0.5 * own.mean)
        session.update()
        found = albedo(render_session(session, size=(64, 64)))
    np.testing.assert_allclose(found[16::32, 16::32], 0.5 * LINEAR_OF_BYTE[PIXELS], rtol=1e-5)


def test_a_reflectance_that_is_too_bright_for_its_texels_takes_contrast():
    """As in light: the brightest texel reflects all, and the mean is what was asked for."""
    own = texture(mag_filter=NEAREST)
    scene = wall(Look(own), own.mean)
    asked = np.array([0.9, 0.5, 0.8])
    with dl.Session(scene, dl.Samples([(0, 0, 0)], [(0, 0, 1)]), paths=1000, gather=32) as session:
        session.bake()
        session.set_reflectance("wall", asked)
        session.update()
        found = albedo(render_session(session, size=(64, 64)))
    np.testing.assert_allclose(found[16::32, 16::32].mean(axis=(0, 1)), asked, rtol=1e-5)
    np.testing.assert_allclose(found[..., (0, 2)].max(axis=(0, 1)), 1, rtol=1e-5)
    tints = LINEAR_OF_BYTE[PIXELS] / own.mean - 1
    shares = (found[16::32, 16::32] / asked - 1) / tints
    np.testing.assert_allclose(shares, np.broadcast_to(shares[0, 0], shares.shape), rtol=1e-4)
    assert (shares[0, 0] > 0).all() and (shares[0, 0, ::2] < 1).all()


@pytest.mark.parametrize(
    ("wrap", "expected"), [(REPEAT, [2, 0, 1, 2, 0]), (CLAMP, [0, 0, 1, 2, 2]), (MIRROR, [0, 0, 1, 2, 2])]
)
def test_coordinates_beyond_the_image_wrap(wrap, expected):
    row = np.repeat(np.array([[10, 100, 200]], np.uint8)[..., None], 3, axis=-1)
    own = texture(row, wrap=(wrap, wrap), mag_filter=NEAREST)
    place = np.stack([(np.arange(-1, 4) + 0.5) / 3, np.full(5, 0.5)], axis=1)
    found = Mipmap(LINEAR_OF_BYTE[row])(own, place, np.zeros(5))
    np.testing.assert_allclose(found[:, 0], LINEAR_OF_BYTE[row[0, expected, 0]], rtol=1e-6)


def test_an_image_is_scaled_then_turned_then_shifted():
    """A quarter turn takes (1, 0) to (0, -1): anticlockwise, as v points down."""
    own = texture(offset=(0.5, 0.25), rotation=np.pi / 2, scale=(2.0, 3.0))
    found = own.transformed(np.array([(0, 0), (1, 0), (0, 1)], float))
    np.testing.assert_allclose(found, [(0.5, 0.25), (0.5, -1.75), (3.5, 0.25)], atol=1e-12)


@pytest.mark.parametrize("lamp", [False, True])
def test_pictures_of_sessions_without_a_gather_show_them_too(lamp):
    """By light at vertices; the middles of the quarters are as bright as light and texels say."""
    own = texture(mag_filter=NEAREST)
    scene = wall(Look(glow=own) if lamp else Look(own), 0 * own.mean if lamp else 0.8 * own.mean,
                 emission=7 * own.mean if lamp else (0, 0, 0))  # fmt: skip
    samples = dl.Samples.on_vertices(scene, spacing=0.25)
    with dl.Session(scene, samples, paths=1000, gather="off") as session:
        session.bake()
        picture = render(scene, samples.display, session.irradiance, size=(64, 64), exposure=0.5)
        corners = session.irradiance[np.argsort(np.linalg.norm(samples.points - (0.5, 0.5, 0), axis=1))[0]]
    light = 7 if lamp else 0.8 * corners / np.pi
    expected = encode_srgb(tone_map(light * LINEAR_OF_BYTE[PIXELS], 0.5)).astype(int)
    assert np.abs(picture.pixels[16::32, 16::32].astype(int) - expected).max() <= 3
