# SPDX-License-Identifier: Apache-2.0
"""Pictures show what is behind panes and in holes, as much dimmed as light is."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import png
from deltalux.mesh.surfaces import Surfaces
from deltalux.outputs.camera import look_at
from deltalux.outputs.see_through import MOST_PASSED, SeeThrough
from deltalux.outputs.textures import ShownTextures
from deltalux.outputs.view import View, camera_rays
from deltalux.rendering import render_session
from deltalux.scene.look import NEAREST, Look, Texture

FACES = [(0, 1, 2), (0, 2, 3)]
UV = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)[np.array(FACES)]
SIZE = (16, 16)
CAMERA = dl.Camera("above", look_at(np.array([0.02, 3, 0.03]), np.zeros(3)), np.radians(40))


def square(name: str, height: float, material: str, side: float = 4, x: float = 0) -> dl.Mesh:
    corners = np.array([(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)], float) * side / 2
    return dl.Mesh(name, corners + np.array([x, height, 0]), FACES, material, coordinates=UV)


def leaf(alpha: list[list[int]], mode: str = "MASK") -> Look:
    texels = np.full((*np.shape(alpha), 4), 255, np.uint8)
    texels[..., 3] = alpha
    return Look(Texture(png(texels), (1, 1, 1), mag_filter=NEAREST), alpha_mode=mode)


def scene_with(material: dl.Material, count: int = 1) -> dl.Scene:
    """A floor under a lamp, with sheets above the lamp and below the camera."""
    sheets = [square(f"sheet{k}", 2 + 0.001 * k, material.name) for k in range(count)]
    return dl.Scene(
        [square("floor", 0, "floor"), *sheets],
        [dl.Material("floor", (0.5, 0.5, 0.5)), material],
        [dl.PointLight("lamp", (0, 1.5, 0), (100, 100, 100))],
        cameras=[CAMERA],
        unit="lux",
    )


def seen(scene: dl.Scene) -> tuple[np.ndarray, np.ndarray]:
    """By pixel: the mesh that is seen, and the share of its light that arrives."""
    samples = dl.Samples.on_vertices(scene, spacing=0.5)
    surfaces = Surfaces(scene, samples.display)
    y, x = (each.ravel() + 0.5 for each in np.indices(SIZE[::-1]))
    hits, passed = SeeThrough(surfaces, ShownTextures(surfaces))(*camera_rays(CAMERA, SIZE, x, y))
    return samples.display.triangle_mesh[hits.triangle], passed


def test_films_dim_what_is_behind_or_hide_it():
    for coverage, mesh, share in ((0.3, 0, 0.7), (0.8, 1, 0.8), (1, 1, 1)):
        film = dl.PaneSurface(coverage=coverage, transmission=0)
        meshes, passed = seen(scene_with(dl.Material("film", (0.2,) * 3, surface=film)))
        assert (meshes == mesh).all()
        np.testing.assert_allclose(passed, share, rtol=1e-6)


def test_glass_dims_by_angle_and_each_pane_again():
    pane = dl.PaneSurface(faces=2, index=1.52, inner=0.96)
    y, x = (each.ravel() + 0.5 for each in np.indices(SIZE[::-1]))
    _, directions = camera_rays(CAMERA, SIZE, x, y)
    once, _ = pane.shares(np.abs(directions[:, 1]))
    for count in (1, 3):
        meshes, passed = seen(scene_with(dl.Material("glass", (0, 0, 0), surface=pane), count))
        assert (meshes == 0).all()
        np.testing.assert_allclose(passed, once**count, rtol=1e-4)


def test_rays_end_in_too_many_panes():
    clear = dl.PaneSurface(coverage=0.01, transmission=0)
    meshes, passed = seen(scene_with(dl.Material("film", (0, 0, 0), surface=clear), MOST_PASSED + 3))
    assert (meshes > 0).all()
    assert np.isfinite(passed).all()


@pytest.mark.parametrize("surface", [dl.DiffuseSurface(), dl.PaneSurface(transmission=0)])
def test_texels_decide_what_is_seen(surface):
    """Two of four quarters of the sheet are holes, or have so little alpha that the floor is seen."""
    is_pane = isinstance(surface, dl.PaneSurface)
    look = leaf([[255, 51], [51, 255]], "BLEND" if is_pane else "MASK")
    meshes, passed = seen(scene_with(dl.Material("leaf", (0.2,) * 3, look=look, surface=surface)))
    meshes, passed = (each.reshape(SIZE[::-1]) for each in (meshes, passed))
    half = SIZE[0] // 2
    for rows in (np.s_[:half], np.s_[half:]):
        assert len(np.unique(meshes[rows, :half])) == 1
    assert {meshes[0, 0], meshes[-1, 0]} == {0, 1}
    np.testing.assert_allclose(passed[meshes == 1], 1)
    np.testing.assert_allclose(passed[meshes == 0], 0.8 if is_pane else 1, rtol=1e-6)


def test_pictures_are_as_much_darker():
    """Both kinds of pictures: of values at vertices, and of light at pixels."""
    film = dl.PaneSurface(coverage=0.3, transmission=0)
    scenes = [scene_with(dl.Material("film", (0, 0, 0), surface=film), count) for count in (0, 1)]
    views, pictures = [], []
    for scene in scenes:
        samples = dl.Samples.on_vertices(scene, spacing=0.5)
        views.append(View(Surfaces(scene, samples.display), CAMERA, SIZE).passed.mean())
        with dl.Session(scene, samples, paths=2000, gather=16, seed=1) as session:
            session.bake()
            picture = render_session(session, camera=CAMERA, size=SIZE, edge_rays=0)
            pictures.append(picture.pixels(picture.seen.passed[:, None] * picture.direct)[..., 0])
            own = picture.albedo * picture.irradiance / np.pi
            np.testing.assert_allclose(picture.radiance, own * picture.seen.passed[:, None])
    assert views == pytest.approx([1, 0.7])
    np.testing.assert_allclose(pictures[1], 0.7 * pictures[0], rtol=1e-5)
