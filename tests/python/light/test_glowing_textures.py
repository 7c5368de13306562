# SPDX-License-Identifier: Apache-2.0
"""Light of textures of emission: where texels are, as much as they say."""

from __future__ import annotations

from dataclasses import replace

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import png
from deltalux.scene.look import NEAREST, Look, Texture
from deltalux.texels import LINEAR_OF_BYTE
from rooms import box, translation
from test_panes import FACES
from thoroughness import slow

FULL = np.array([400.0, 300.0, 200.0])  # radiance of a texel of 1
SIDE = 2.0
UV = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)


def card(texels: np.ndarray, **mapping) -> tuple[dl.Mesh, dl.Material]:
    """A square that faces down, at a height of 2 m, with its middle at (0, 2, 0)."""
    corners = (UV - 0.5) * SIDE
    vertices = np.stack([corners[:, 0], np.full(4, 2.0), corners[:, 1]], axis=1)
    mean = LINEAR_OF_BYTE[texels].reshape(-1, 3).mean(axis=0)
    look = Look(glow=Texture(png(texels), mean, mag_filter=NEAREST, **mapping))
    mesh = dl.Mesh("card", vertices, FACES, "card", coordinates=UV[np.array(FACES)])
    return mesh, dl.Material("card", (0, 0, 0), FULL * mean, look=look)


def by_hand(texels: np.ndarray) -> tuple[list[dl.Mesh], list[dl.Material]]:
    """The same, with a lamp for each texel that is not black, below a black card."""
    meshes = [replace(card(texels)[0], name="back", pose=translation(0, 0.001, 0), coordinates=None)]
    materials = [dl.Material("card", (0, 0, 0))]
    rows, columns = texels.shape[:2]
    for row, column in np.argwhere(texels.any(axis=2)):
        at = ((UV + np.array([column, row])) / (columns, rows) - 0.5) * SIDE
        vertices = np.stack([at[:, 0], np.full(4, 2.0), at[:, 1]], axis=1)
        name = f"lamp {row} {column}"
        meshes.append(dl.Mesh(name, vertices, FACES, name))
        materials.append(
            dl.Material(name, (0, 0, 0), FULL * LINEAR_OF_BYTE[texels[row, column]], group="all")
        )
    return meshes, materials


def in_room(meshes: list[dl.Mesh], materials: list[dl.Material], reflectance: float = 0.5) -> dl.Scene:
    walls = dl.Mesh("walls", *box((4, 3, 3.6), (0, 1.5, 0), inward=True), "wall")
    shelf = dl.Mesh("shelf", *box((0.5, 0.03, 0.6), (0.3, 1.2, 0.2)), "wall")
    wall = dl.Material("wall", (reflectance,) * 3)
    return dl.Scene([walls, shelf, *meshes], [wall, *materials], unit="lux")


def places() -> tuple[np.ndarray, np.ndarray]:
    x, z = (each.ravel() for each in np.meshgrid(np.linspace(-1.6, 1.6, 11), np.linspace(-1.5, 1.5, 9)))
    near = np.array([(-0.8, 1.7, -0.6), (0.1, 1.75, 0.4), (0.7, 1.6, 0.9)])  # close to the card
    points = np.concatenate([np.stack([x, 0 * x, z], axis=1), near])
    return points, np.tile((0.0, 1.0, 0.0), (len(points), 1))


def light(scene: dl.Scene, gather: int | str, paths: int = 300_000) -> tuple[np.ndarray, np.ndarray]:
    with dl.Session(scene, dl.Samples(*places(), radius=0.15), paths=paths, gather=gather, seed=4) as session:
        session.bake()
        return session.irradiance.copy(), session.standard_error.copy()


def pattern(seed: int, size: tuple[int, int] = (6, 5)) -> np.ndarray:
    """Grey texels, a half of them black."""
    rng = np.random.default_rng(seed)
    grey = rng.integers(20, 256, (*size, 1)) * (rng.random((*size, 1)) < 0.5)
    return np.repeat(grey, 3, axis=2).astype(np.uint8)


@pytest.mark.parametrize("gather", [256, "off"])
@pytest.mark.parametrize("seed", [1, slow(2)])
def test_a_texture_shines_as_lamps_of_its_texels(gather, seed):
    """Null hypothesis: equal light. Discs of 300,000 paths know means of 100 points to 0.3 %."""
    mesh, material = card(pattern(seed))
    (found, error), (expected, other) = (
        light(scene, gather) for scene in (in_room([mesh], [material]), in_room(*by_hand(pattern(seed))))
    )
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.01)
    far = np.abs(found - expected) - 0.01 * expected
    assert np.quantile(far / np.hypot(error, other), 0.9) < 2
    assert (np.abs(found / expected - 1) < (0.25 if gather == "off" else 0.08)).all()


def test_direct_light_is_that_of_the_texels_where_nothing_is_between():
    """In an open scene; the closed form of lamps by hand, which is exact. Parts blur edges of texels."""
    points, normals = places()
    clear = np.flatnonzero((points[:, 0] < -0.3) | (points[:, 2] < -0.4))
    found = []
    for meshes, materials in (by_hand(pattern(5)), [[each] for each in card(pattern(5))]):
        scene = in_room(meshes, materials, 0)
        scene = dl.scene.replace_scene(scene, meshes=[m for m in scene.meshes if m.name != "shelf"])
        with dl.Session(scene, dl.Samples(points, normals), paths=2000, gather=16) as session:
            session.bake()
            found.append(session.at(points, normals, part="direct")[clear])
    np.testing.assert_allclose(found[1], found[0], rtol=0.02)
    assert np.quantile(np.abs(found[1] / found[0] - 1), 0.9) < 0.005


def test_a_few_bright_texels_of_a_dark_page_shine_where_they_are():
    """One texel of 10,000: all light comes from a square of 2 cm."""
    texels = np.zeros((100, 100, 3), np.uint8)
    texels[20, 70] = 255
    mesh, material = card(texels)
    points = np.array([(0.41, 0.5, -0.59), (-0.9, 0.5, 0.9)])
    scene = dl.scene.replace_scene(in_room([mesh], [material], 0), meshes=[mesh])
    with dl.Session(scene, dl.Samples(points, [(0, 1, 0)]), paths=2000, gather=16) as session:
        session.bake()
        found = session.at(points, np.tile((0.0, 1, 0), (2, 1)), part="direct")
    way = np.array([0.41, 2, -0.59]) - points
    squared = (way**2).sum(axis=1)
    expected = FULL * (0.02**2 * way[:, 1] ** 2 / squared**2)[:, None]
    np.testing.assert_allclose(found, expected, rtol=0.002)


def test_colours_are_those_of_connected_pieces():
    """Two lamps of one material and one image, of other hues, with darkness between them."""
    texels = np.zeros((4, 8, 3), np.uint8)
    texels[1:3, 1:3], texels[1:3, 5:7] = (255, 0, 0), (0, 0, 255)
    mesh, material = card(texels)
    scene = in_room([mesh], [material], 0)
    points = np.array([(-0.5, 1.9, 0), (0.5, 1.9, 0)])
    with dl.Session(scene, dl.Samples(points, [(0, 1, 0)]), paths=2000, gather=16) as session:
        session.bake()
        red, _, blue = session.at(points, np.tile((0.0, 1, 0), (2, 1)), part="direct").T
    assert red[0] > 20 * red[1] > 0
    assert blue[1] > 20 * blue[0] > 0


def test_paths_carry_the_power_of_all_texels():
    """In a closed black room everything lands: the power is that of the texels, to a thousandth."""
    texels = pattern(7, (37, 53))
    mesh, material = card(texels)
    segments = dl.trace(in_room([mesh], [material], 0), paths=20_000, max_bounces=1)
    power = segments.power.sum(axis=0)
    expected = np.pi * FULL * LINEAR_OF_BYTE[texels].reshape(-1, 3).mean(axis=0) * SIDE**2
    np.testing.assert_allclose(power, expected, rtol=1e-3)


def test_without_coordinates_all_of_it_has_the_mean():
    mesh, material = card(pattern(1))
    bare = in_room([replace(mesh, coordinates=None)], [material])
    plain = in_room([mesh], [replace(material, look=Look())])
    assert np.array_equal(light(bare, 64, 5000)[0], light(plain, 64, 5000)[0])


def test_even_textures_are_no_more_lamps_than_there_are_triangles():
    """And so give the same bits as a plain emission of the same value."""
    mesh, material = card(np.full((16, 16, 3), 255, np.uint8))
    plain = in_room([mesh], [replace(material, look=Look())])
    assert np.array_equal(light(in_room([mesh], [material]), 64, 5000)[0], light(plain, 64, 5000)[0])


def test_alpha_of_an_image_weighs_its_colour_and_not_its_glow():
    texels = np.concatenate([np.full((4, 4, 3), 200, np.uint8), np.full((4, 4, 1), 255, np.uint8)], axis=2)
    texels[:2, :, 3] = 0
    mesh, material = card(texels[..., :3].copy())
    shared = replace(material.look.glow, image=png(texels))
    other = replace(shared, image=png(texels))
    found = []
    for colour in (None, shared, other):
        look = Look(colour, shared, alpha_mode="OPAQUE" if colour is None else "BLEND")
        scene = in_room([mesh], [replace(material, look=look)], 0)
        found.append(light(scene, 16, 2000)[0])
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


@pytest.mark.parametrize("mean", [(0.5, 0.5, 0), (1e-38, 0.5, 0.5)])
def test_emission_that_no_texel_can_have_is_refused(mean):
    mesh, material = card(pattern(1))
    glow = replace(material.look.glow, mean=mean)
    scene = in_room([mesh], [replace(material, look=Look(glow=glow))])
    with pytest.raises(dl.SceneError, match=r'material "card": emission: found .* texels that can shine'):
        dl.Session(scene, dl.Samples(*places()), paths=100, gather=16)
