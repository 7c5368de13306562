# SPDX-License-Identifier: Apache-2.0
"""Textures in the page: texels where the file puts them, as bright as light and exposure say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import png
from deltalux.outputs.camera import look_at
from deltalux.outputs.images import render
from deltalux.outputs.tone import encode_srgb, tone_map
from deltalux.scene.look import Look, Texture
from deltalux.server.web.serving import Server
from deltalux.texels import LINEAR_OF_BYTE

from viewer.page.driver import Viewer

PIXELS = np.array(
    [[(250, 30, 30), (30, 250, 30)], [(30, 30, 250), (240, 240, 240)]], np.uint8
)  # red, green; blue, white
CORNERS = np.array([(-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)], float)  # from the upper left, clockwise
FACES = [(0, 2, 1), (0, 3, 2)]
UV = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)[np.array(FACES)] + [[[0, 0]], [[3, -1]]]
MEAN = LINEAR_OF_BYTE[PIXELS].reshape(-1, 3).mean(axis=0)
# Middles of the left wall's quarters and of the right wall, in metres.
QUARTERS = [(-1.6, 0.5, 0), (-0.6, 0.5, 0), (-1.6, -0.5, 0), (-0.6, -0.5, 0)]
PLAIN = (1.1, 0.1, 0)


def two_walls(image: bytes, emission=(0, 0, 0)) -> dl.Scene:
    """The left one has a seam along its diagonal, the right one no coordinates, both the same material."""
    texture = Texture(image, MEAN, mag_filter=9728)
    look = Look(None, texture) if any(emission) else Look(texture)
    reflectance = np.zeros(3) if any(emission) else 0.9 * MEAN
    left, right = CORNERS - (1.1, 0, 0), CORNERS - (-1.1, 0, 0)
    return dl.Scene(
        [
            dl.Mesh("left", left, FACES, "wall", coordinates=UV),
            dl.Mesh("right", right, FACES, "wall"),
        ],
        [dl.Material("wall", reflectance, np.multiply(emission, MEAN), look=look)],
        [dl.PointLight("lamp", (0, 0, 2), (300, 300, 300))],
        cameras=[dl.Camera("front", look_at(np.array([0, 0, 3.0]), np.zeros(3)), np.radians(55))],
        unit="lux",
    )


@pytest.fixture
def shown(open_page) -> Iterator[object]:
    """Shows a scene in a page, at rest with all images."""
    ends = []

    def show(scene: dl.Scene) -> Viewer:
        session = dl.Session(scene, dl.Samples.on_vertices(scene, spacing=0.25), paths=2000, gather="off")
        session.bake()
        server = Server(session)
        viewer = open_page(server.url)
        viewer.session = session
        ends.append((viewer, server, session))
        return viewer

    yield show
    for viewer, server, session in ends:
        viewer.end(server)
        session.close()


def on_canvas(viewer: Viewer, point: tuple[float, float, float]) -> tuple[float, float]:
    canvas = viewer.state()["canvas"]
    x, y = viewer.ask(f"deltalux.place({list(point)})")
    return x - canvas["x"], y - canvas["y"]


def pixel(viewer: Viewer, point: tuple[float, float, float]) -> np.ndarray:
    x, y = on_canvas(viewer, point)
    return viewer.picture()[round(y), round(x)]


def as_lit(viewer: Viewer, point: tuple[float, float, float], reflectance: np.ndarray) -> np.ndarray:
    """What a place must look like; the light is white, and nothing is reflected from wall to wall."""
    light = viewer.probe(*on_canvas(viewer, point))["reading"]["value"]
    assert light > 1
    return encode_srgb(tone_map(reflectance * light / np.pi, viewer.state()["exposure"])).astype(int)


def test_texels_are_where_the_file_puts_them_and_as_bright_as_they_must_be(shown):
    viewer = shown(two_walls(png(PIXELS)))
    viewer.settle()
    for texel, place in zip(LINEAR_OF_BYTE[PIXELS].reshape(-1, 3), QUARTERS, strict=True):
        assert np.abs(pixel(viewer, place) - as_lit(viewer, place, 0.9 * texel)).max() <= 2
    # without coordinates: the mean
    assert np.abs(pixel(viewer, PLAIN) - as_lit(viewer, PLAIN, 0.9 * MEAN)).max() <= 2


def test_they_can_be_left_out(shown):
    viewer = shown(two_walls(png(PIXELS)))
    viewer.settle()
    viewer.page.get_by_label("Textures").uncheck()
    viewer.settle()
    for place in QUARTERS:
        assert np.abs(pixel(viewer, place) - as_lit(viewer, place, 0.9 * MEAN)).max() <= 2
    viewer.until("location.hash.includes('textures=0')")


def test_luminous_textures_glow_and_are_metered_where_nothing_else_is_seen(shown):
    viewer = shown(two_walls(png(PIXELS), emission=(700, 700, 700)))
    viewer.settle()
    assert viewer.state()["exposure"] < 0.1
    for texel, place in zip(LINEAR_OF_BYTE[PIXELS].reshape(-1, 3), QUARTERS, strict=True):
        expected = encode_srgb(tone_map(700 * texel, viewer.state()["exposure"])).astype(int)
        assert np.abs(pixel(viewer, place) - expected).max() <= 2


def test_the_exposure_is_that_of_pictures_with_and_without_textures(shown):
    """Texels much smaller than those of the small picture that is measured: their mean would be brighter."""
    fine = np.where(np.indices((64, 64)).sum(axis=0)[..., None] % 4 < 3, 8, 250).repeat(3, axis=2)
    scene = two_walls(png(fine.astype(np.uint8)))
    mean = LINEAR_OF_BYTE[fine].reshape(-1, 3).mean(axis=0)
    own = replace(scene.materials[0].look.colour, mean=mean)
    materials = [replace(scene.materials[0], reflectance=0.9 * mean, look=Look(own))]
    viewer = shown(dl.scene.replace_scene(scene, materials=materials))
    viewer.settle()
    found = [viewer.state()["exposure"]]
    for act in ("uncheck", "check"):
        getattr(viewer.page.get_by_label("Textures"), act)()
        viewer.settle()
        found.append(viewer.state()["exposure"])
    size = viewer.state()["canvas"]
    session = viewer.session
    expected = [
        render(each, session.samples.display, session.irradiance, camera=scene.cameras[0],
               size=(int(size["width"]), int(size["height"]))).exposure
        for each in (session.scene, without_textures(session.scene))
    ]  # fmt: skip
    assert found[0] == found[2]
    np.testing.assert_allclose(found[:2], expected, rtol=0.05)
    assert found[0] > 1.2 * found[1]


def without_textures(scene: dl.Scene) -> dl.Scene:
    return dl.scene.replace_scene(scene, materials=[replace(m, look=Look()) for m in scene.materials])


def test_seams_are_no_creases(shown):
    """The difference view draws lines along open edges: the wall's border, and not its diagonal."""
    viewer = shown(two_walls(png(PIXELS)))
    viewer.settle()
    viewer.show("difference")
    picture = viewer.picture()

    def darkest(point) -> int:
        x, y = (round(v) for v in on_canvas(viewer, point))
        return picture[y - 2 : y + 3, x - 2 : x + 3].sum(axis=-1)

    inside, border = darkest((-1.1, 0.0, 0)), darkest((-0.1, 0.3, 0))
    assert inside.min() == inside.max()
    assert border.min() != border.max()


def test_an_image_that_cannot_be_shown_leaves_the_mean_and_is_told(shown):
    """Pillow and the browser need not know the same forms of a format."""
    viewer = shown(two_walls(png(PIXELS)))
    viewer.page.add_init_script("createImageBitmap = async () => { throw new Error('unknown form') }")
    viewer.page.reload()
    viewer.page.get_by_text("An image cannot be shown").wait_for()
    viewer.settle()
    for place in (QUARTERS[0], PLAIN):
        assert np.abs(pixel(viewer, place) - as_lit(viewer, place, 0.9 * MEAN)).max() <= 2


def test_panes_show_what_is_behind_them_and_cut_outs_show_it_undimmed(shown):
    """Before the right wall, that lets half of the light pass; before the left one, that is all holes."""
    scene = two_walls(png(PIXELS))
    film = dl.Material("film", (0, 0, 0), surface=dl.PaneSurface(coverage=0.5, transmission=0))
    hidden = png(np.concatenate([PIXELS, np.full((2, 2, 1), 100, np.uint8)], axis=2))
    leaf = dl.Material("leaf", (0.5,) * 3, look=Look(Texture(hidden, MEAN), alpha_mode="MASK"))
    sheets = [
        dl.Mesh("before", 0.8 * CORNERS + (1.1, 0, 0.3), FACES, "film"),
        dl.Mesh("none", 0.8 * CORNERS + (-1.1, 0, 0.3), FACES, "leaf", coordinates=UV),
    ]
    materials, meshes = [*scene.materials, film, leaf], [*scene.meshes, *sheets]
    viewer = shown(dl.scene.replace_scene(scene, materials=materials, meshes=meshes))
    viewer.settle()
    points, light = viewer.session.samples.points, viewer.session.irradiance[:, 0]
    exposure = viewer.state()["exposure"]

    def wall_at(place, factor) -> np.ndarray:
        on_wall = np.flatnonzero(np.abs(points[:, 2]) < 1e-6)
        nearest = on_wall[np.linalg.norm(points[on_wall] - place, axis=1).argsort()[:4]]
        return encode_srgb(tone_map(0.9 * factor * light[nearest].mean() / np.pi, exposure)).astype(float)

    dimmed = wall_at(PLAIN, MEAN) * 0.5 ** (1 / 2.2)
    assert np.abs(pixel(viewer, PLAIN) - dimmed).max() <= 6
    texel = LINEAR_OF_BYTE[PIXELS].reshape(-1, 3)[0]
    assert np.abs(pixel(viewer, QUARTERS[0]) - wall_at(QUARTERS[0], texel)).max() <= 6
