# SPDX-License-Identifier: Apache-2.0
"""Pictures: what a pixel shows follows from irradiance, reflectance and emission."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from deltalux import outputs
from deltalux.errors import OptionError
from deltalux.mesh import contact_cuts
from deltalux.mesh.display_mesh import BACK, BOTH, DisplayMesh, refine
from deltalux.mesh.surfaces import Surfaces, core_caster
from deltalux.outputs.camera import automatic_camera, look_at
from deltalux.outputs.colour_scale import ColourScale
from deltalux.outputs.images import SURROUNDINGS, UNSAMPLED
from deltalux.outputs.tone import automatic_exposure, encode_srgb, metered, tone_map
from deltalux.outputs.view import camera_rays
from deltalux.results import Result
from deltalux.samples import Samples
from deltalux.samples.clearance import Clearance, covered_samples
from deltalux.scene import Camera, Material, Mesh, Scene
from deltalux.texels import LINEAR_OF_BYTE
from deltalux.units import photopic
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
MATERIALS = (
    Material("grey", reflectance=(0.6, 0.5, 0.4)),
    Material("lamp", reflectance=(0, 0, 0), emission=(3, 2, 1)),
    Material("panel", reflectance=(0, 0, 0), emission=(3, 2, 1), two_sided=True),
)


def box(name: str, low, high, inward: bool = False, skip: int | None = None, **options) -> Mesh:
    corners = [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    faces = [q for i, q in enumerate(QUADS) if i != skip]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    return Mesh(name, corners, triangles[:, ::-1] if inward else triangles, **{"material": "grey"} | options)


def wall(material: str = "grey", name: str = "wall", z: float = 0.0, **options) -> Mesh:
    """Square from (-1, -1) to (1, 1) whose front looks along +z."""
    corners = [(-1, -1, z), (1, -1, z), (1, 1, z), (-1, 1, z)]
    return Mesh(name, corners, [(0, 1, 2), (0, 2, 3)], material=material, **options)


def scene_of(*meshes: Mesh, **options) -> Scene:
    return Scene(meshes, MATERIALS, **options)


def camera_at(eye, target, field: float = 0.9) -> Camera:
    return Camera("test", look_at(np.array(eye, dtype=float), np.array(target, dtype=float)), field)


FROM_FRONT = camera_at((0, 0, 3), (0, 0, 0))
FROM_BACK = camera_at((0, 0, -3), (0, 0, 0))
SIZE = (48, 32)


def flat(display: DisplayMesh, value=(1.0, 1.0, 1.0)) -> np.ndarray:
    return np.tile(np.array(value, dtype=float), (len(display.points), 1))


def middle(picture: outputs.Picture, size=SIZE) -> list[int]:
    return picture.pixels[size[1] // 2, size[0] // 2].tolist()


# ---- ray casting -------------------------------------------------------------------------------


def test_the_engines_caster_agrees_with_plain_arithmetic():
    random = np.random.default_rng(2)
    vertices = random.uniform(-1, 1, (60, 3)).astype(np.float32)
    triangles = random.permutation(60).reshape(20, 3).astype(np.uint32)
    origins = random.uniform(-2, 2, (400, 3)).astype(np.float32)
    directions = -origins + random.uniform(-0.8, 0.8, (400, 3)).astype(np.float32)
    t, primitive, u, v = core_caster(vertices, triangles, 1).intersect(origins, directions)
    a, b, c = (vertices[triangles[:, i]].astype(np.float64) for i in range(3))
    best = np.full(400, np.inf)
    nearest = np.full(400, 0xFFFFFFFF, dtype=np.uint32)
    for k in range(20):
        columns = np.stack([b[k] - a[k], c[k] - a[k]], axis=1)
        for i in range(400):
            weights = np.linalg.solve(np.column_stack([columns, -directions[i]]), origins[i] - a[k])
            inside = weights[0] >= 0 and weights[1] >= 0 and weights[0] + weights[1] <= 1
            if inside and 0 < weights[2] < best[i]:
                best[i], nearest[i] = weights[2], k
    assert (primitive != nearest).sum() <= 1  # an edge may be on either side
    same = (primitive == nearest) & (nearest != 0xFFFFFFFF)
    assert same.sum() > 50
    np.testing.assert_allclose(t[same], best[same], rtol=1e-4)
    u, v = u[same, None], v[same, None]
    found = (1 - u - v) * a[nearest[same]] + u * b[nearest[same]] + v * c[nearest[same]]
    np.testing.assert_allclose(found, origins[same] + t[same, None] * directions[same], atol=1e-4)


# ---- lit pictures ------------------------------------------------------------------------------


def test_uniform_light_gives_reflectance_times_irradiance_over_pi():
    scene = scene_of(box("room", (-1, -1, -1), (1, 1, 1), inward=True))
    display = refine(scene, 0.4)
    picture = outputs.render(scene, display, flat(display, (2, 3, 4)), size=SIZE, exposure=0.7,
                             camera=camera_at((0, 0, 0), (0, 0, -1)))  # fmt: skip
    radiance = np.array([0.6 * 2, 0.5 * 3, 0.4 * 4]) / np.pi
    assert (picture.pixels == encode_srgb(tone_map(radiance, 0.7))).all()
    assert picture.pixels.shape == (32, 48, 3)


def test_irradiance_is_interpolated_before_the_tone_curve():
    scene = scene_of(wall())
    display = refine(scene, 10)  # two triangles: all in between is interpolation
    values = np.repeat((display.points[:, :1] + 1) * 100, 3, axis=1)
    size = (400, 300)
    picture = outputs.render(scene, display, values, camera=FROM_FRONT, size=size, exposure=0.05)
    step = 2 * np.tan(0.45) * 3 / size[1]
    for column in (150, 200, 260):
        x = (column + 0.5 - size[0] / 2) * step
        expected = encode_srgb(tone_map(np.array([0.6, 0.5, 0.4]) * (x + 1) * 100 / np.pi, 0.05))
        assert np.abs(picture.pixels[150, column].astype(int) - expected).max() <= 1


def test_lamps_glow_on_their_front_and_two_sided_ones_on_both():
    for material, from_back in (("lamp", (0.0, 0.0, 0.0)), ("panel", (3.0, 2.0, 1.0))):
        scene = scene_of(wall(material))
        display = refine(scene, 1, sides=[BOTH, BOTH])
        for camera, light in ((FROM_FRONT, (3.0, 2.0, 1.0)), (FROM_BACK, from_back)):
            picture = outputs.render(
                scene, display, flat(display, (0, 0, 0)), camera=camera, size=SIZE, exposure=0.2
            )
            assert middle(picture) == encode_srgb(tone_map(np.array(light), 0.2)).tolist()


def test_each_side_shows_its_own_samples():
    scene = scene_of(wall())
    display = refine(scene, 0.5, sides=[BOTH, BOTH])
    values = np.where(display.normals[:, 2:] > 0, 5.0, 1.0) * np.ones(3)
    for camera, value in ((FROM_FRONT, 5), (FROM_BACK, 1)):
        picture = outputs.render(scene, display, values, camera=camera, size=SIZE, exposure=0.3)
        expected = encode_srgb(tone_map(np.array([0.6, 0.5, 0.4]) * value / np.pi, 0.3))
        assert middle(picture) == expected.tolist()


def test_a_side_without_samples_is_dark_grey_and_so_marked_in_false_colours():
    scene = scene_of(wall())
    unknown = encode_srgb(np.full(3, UNSAMPLED)).tolist()
    for sides, dark, bright in ((None, FROM_BACK, FROM_FRONT), ([BACK, BACK], FROM_FRONT, FROM_BACK)):
        display = refine(scene, 0.5, sides=sides)
        for false_colour in (False, True):
            seen = outputs.render(
                scene, display, flat(display), camera=dark, size=SIZE, false_colour=false_colour
            )
            assert middle(seen) == unknown
            seen = outputs.render(
                scene, display, flat(display), camera=bright, size=SIZE, false_colour=false_colour
            )
            assert middle(seen) != unknown
            assert seen.pixels[0, 0].tolist() == encode_srgb(np.full(3, SURROUNDINGS)).tolist()


def test_movables_are_drawn_where_they_are():
    near = wall("lamp", name="screen", z=1.0, movable=True)
    scene = scene_of(wall(), near)
    display = refine(scene, 1)
    grey = encode_srgb(tone_map(np.array([0.6, 0.5, 0.4]) / np.pi, 1)).tolist()
    lamp = encode_srgb(tone_map(np.array([3.0, 2, 1]), 1)).tolist()
    away = np.eye(4)
    away[0, 3] = 5
    for poses, expected in ((None, lamp), ({"screen": away}, grey), ({"screen": None}, grey)):
        picture = outputs.render(
            scene, display, flat(display), poses=poses, camera=FROM_FRONT, size=SIZE, exposure=1
        )
        assert middle(picture) == expected


def test_samples_under_a_box_do_not_darken_the_floor_beside_it():
    corners = [(-2, 0, -2), (-2, 0, 2), (2, 0, 2), (2, 0, -2)]
    floor = Mesh("floor", corners, [(0, 1, 2), (0, 2, 3)], material="grey")
    crate = box("crate", (-0.55, 0.001, -0.55), (0.55, 0.6, 0.55), movable=True)
    scene = scene_of(floor, crate)
    display = refine(scene, 0.3)
    away = np.eye(4)
    away[0, 3] = 10
    x, _, z = display.sample_points.T
    on_floor = display.vertex_mesh == 0
    bottom = ~on_floor & (display.normals[:, 1] < -0.5)
    under = on_floor & (np.maximum(np.abs(x), np.abs(z)) < 0.55)
    covered = covered_samples(Surfaces(scene, display))
    np.testing.assert_array_equal(covered, under | bottom)
    assert under.sum() > 10
    assert not covered_samples(Surfaces(scene, display, {"crate": away})).any()

    values = np.where(covered[:, None], 0.0, 5.0) * np.ones(3)
    camera = camera_at((0.3, 4, 0), (0, 0, 0), 0.6)
    picture = outputs.render(scene, display, values, camera=camera, size=(120, 120), exposure=0.3)
    lit = encode_srgb(tone_map(np.array([0.6, 0.5, 0.4]) * 5 / np.pi, 0.3))
    assert np.abs(picture.pixels.astype(int) - lit).max() <= 1


def frame_bars() -> list[Mesh]:
    """A frame around the middle of `wall`, over all of its vertices."""
    spans = (
        ((-1.1, -1.1), (1.1, -0.7), 0.1),
        ((-1.1, 0.7), (1.1, 1.1), 0.1),
        ((-1.1, -0.8), (-0.7, 0.8), 0.09),
        ((0.7, -0.8), (1.1, 0.8), 0.09),
    )
    return [box(f"bar {i}", (*low, 0.001), (*high, top)) for i, (low, high, top) in enumerate(spans)]


def test_covered_samples_move_to_an_open_place_of_their_faces(monkeypatch):
    monkeypatch.setattr(contact_cuts, "SMALLEST", 10.0)  # the frame does not cut the panel
    # Every vertex of the panel lies under a frame; its middle is open. The plate is covered whole.
    panel = wall(name="panel")
    plate, lid = wall(name="plate", z=5), box("lid", (-2, -2, 5.001), (2, 2, 5.1))
    scene = scene_of(panel, *frame_bars(), plate, lid)
    display = refine(scene, 1.5)
    moved = Clearance(scene, display).cleared(display)
    own = display.vertex_mesh == 0
    outer = own & (np.abs(display.points[:, :2]).max(axis=1) > 0.99)
    assert (covered_samples(Surfaces(scene, display)) & own == outer).all()
    assert not (covered_samples(Surfaces(scene, moved)) & own).any()
    assert (np.abs(moved.sample_points[outer, :2]) < 0.7).all()
    assert (moved.sample_points[outer, 2] == 0).all()
    on_plate = display.vertex_mesh == 5
    np.testing.assert_array_equal(moved.sample_points[on_plate], display.sample_points[on_plate])
    np.testing.assert_array_equal(moved.points, display.points)


def test_covered_samples_of_a_movable_move_whatever_stands_near_it():
    def framed(name, **options):
        meshes = [wall(), *frame_bars()]
        first = np.cumsum([0, *(len(m.vertices) for m in meshes)])
        vertices = np.concatenate([m.vertices for m in meshes])
        triangles = np.concatenate([m.triangles + at for m, at in zip(meshes, first, strict=False)])
        return Mesh(name, vertices, triangles, material="grey", **options)

    def moved(*meshes):
        scene = scene_of(*meshes)
        display = refine(scene, 1.5)
        return display, Clearance(scene, display).cleared(display)

    alone = moved(framed("crate", movable=True))
    pose = np.eye(4)
    pose[:3, 3] = 3, 0, -2
    lid = box("lid", (1, -2, -1.999), (5, 2, -1.85))  # close to all of the crate, as loaded
    display, found = moved(framed("crate", movable=True, pose=pose), lid)
    own = display.vertex_mesh == 0
    assert (found.sample_points[own] != display.sample_points[own]).any()
    np.testing.assert_allclose(found.sample_points[own], alone[1].sample_points, atol=1e-12)


def test_automatic_exposure_is_independent_of_the_unit():
    scene = scene_of(box("room", (-1, -1, -1), (1, 1, 1), inward=True), box("b", (-0.3, -1, -0.3), (0, 0, 0)))
    display = refine(scene, 0.3)
    values = (1.2 + display.points[:, :1]) * np.ones(3)
    camera = camera_at((0.8, 0.5, 0.9), (0, -0.3, 0))
    one = outputs.render(scene, display, values, camera=camera, size=SIZE)
    many = outputs.render(scene, display, 1e4 * values, camera=camera, size=SIZE)
    assert np.abs(one.pixels.astype(int) - many.pixels).max() <= 1
    assert one.exposure == pytest.approx(1e4 * many.exposure)
    assert 60 < one.pixels.mean() < 190
    again = outputs.render(scene, display, 2 * values, camera=camera, size=SIZE, exposure=one.exposure)
    assert again.pixels.mean() > one.pixels.mean() + 10


def test_wrong_values_and_sizes_are_refused():
    scene = scene_of(wall())
    display = refine(scene, 1)
    with pytest.raises(OptionError, match=rf"expected \({len(display.points)}, 3\)"):
        outputs.render(scene, display, flat(display)[:-1])
    with pytest.raises(OptionError, match=r"found size \(0, 10\)"):
        outputs.render(scene, display, flat(display), size=(0, 10))


# ---- tone and colour ---------------------------------------------------------------------------


@settings(max_examples=200)
@given(st.lists(st.floats(0, 1e5), min_size=3, max_size=3), st.floats(1e-4, 10))
def test_tone_curve_stays_in_range_and_rises_with_light(colour: list[float], exposure: float):
    one, brighter = tone_map(np.array([colour, np.array(colour) * 1.5]), exposure)
    assert (one >= 0).all() and (one <= 1).all()
    assert photopic(brighter) >= photopic(one) - 1e-9


def test_tone_curve_keeps_hue_and_ends_white():
    dim = tone_map(np.array([0.02, 0.01, 0.005]), 1)
    assert dim[0] / dim[1] == pytest.approx(2)
    assert dim[1] / dim[2] == pytest.approx(2)
    np.testing.assert_allclose(tone_map(np.array([90.0, 60, 30]), 1), 1)
    assert (tone_map(np.zeros(3), 1) == 0).all()
    assert automatic_exposure(np.zeros(4)) == 1


def test_light_sources_are_metered_where_there_is_nothing_else():
    luminance, lamp = np.array([2.0, 8, 400]), np.array([False, False, True])
    assert metered(luminance, lamp) == automatic_exposure(luminance[:2])
    for others in (np.zeros(2), np.zeros(0)):
        all_seen = np.r_[others, 400.0]
        assert metered(all_seen, np.arange(len(all_seen)) == len(others)) == automatic_exposure(all_seen)


def test_srgb_round_trip():
    every = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(encode_srgb(LINEAR_OF_BYTE[every]), every)
    assert encode_srgb(np.array([0.2140]))[0] == 127  # middle grey


def test_false_colours_can_be_read_back_through_the_scale():
    scene = scene_of(box("room", (-1, -1, -1), (1, 1, 1), inward=True))
    display = refine(scene, 0.4)
    scale = ColourScale(0, 500)
    for value in (40.0, 260.0, 480.0):
        picture = outputs.render(
            scene, display, flat(display, (value, value, value)), camera=camera_at((0, 0, 0), (0, 0, -1)),
            size=SIZE, false_colour=True, scale=scale,
        )  # fmt: skip
        shown = picture.pixels[:, : SIZE[0]]
        assert (shown == encode_srgb(scale.colours(np.array([value])))).all()
        assert picture.pixels.shape[1] > SIZE[0] + 20  # the legend
        assert picture.scale == scale


def test_isolux_lines_lie_where_a_level_is_crossed():
    scene = scene_of(wall())
    display = refine(scene, 10)
    values = np.repeat((display.points[:, :1] + 1) * 100, 3, axis=1)  # 100 in the middle
    size, scale = (200, 120), ColourScale(0, 200)
    plain, lined = (
        outputs.render(scene, display, values, camera=FROM_FRONT, size=size, false_colour=True, scale=scale,
                       isolux=lines).pixels[60, : size[0]].astype(int)
        for lines in (False, True)
    )  # fmt: skip
    changed = np.flatnonzero(np.abs(plain - lined).sum(axis=1))
    step = 2 * np.tan(0.45) * 3 / size[1]
    crossings = [size[0] / 2 + (level / 100 - 1) / step for level in scale.ticks()[1:-1]]
    assert len(changed) == len(crossings)
    assert np.abs(changed - np.array(crossings)).max() <= 1


def test_difference_is_grey_where_nothing_changed_and_coloured_by_sign():
    scene = scene_of(wall())
    display = refine(scene, 1)
    before = flat(display, (100, 100, 100))
    for sign in (-1, 0, 1):
        picture = outputs.difference(
            scene, display, before, before * (1 + 0.5 * sign), camera=FROM_FRONT, size=SIZE
        )
        red, green, blue = middle(picture)
        assert np.sign(red - blue) == sign
        assert ((red, green, blue) == (34, 34, 34)) == (sign == 0)
        assert picture.scale is not None
        assert picture.scale.low == -picture.scale.high


def test_outlines_show_on_the_grey_of_what_stays():
    scene = scene_of(box("room", (-1, -1, -1), (1, 1, 1), inward=True))
    display = refine(scene, 0.4)
    same, camera = flat(display, (9, 9, 9)), camera_at((0, 0, 0.9), (0, 0, -1))
    picture = outputs.difference(scene, display, same, same, camera=camera, size=SIZE)
    assert set(picture.pixels[:, : SIZE[0]].ravel().tolist()) == {34, 57}


def test_pictures_side_by_side():
    one = outputs.Picture(np.full((30, 40, 3), 200, dtype=np.uint8), exposure=2.0)
    both = outputs.side_by_side([one, one], ["before", "after"])
    assert both.pixels.shape[1] > 80
    assert both.exposure == 2.0
    assert (both.pixels == 200).all(axis=2).sum() == 2 * 30 * 40
    with pytest.raises(OptionError, match="1 labels"):
        outputs.side_by_side([one, one], ["before"])
    other = outputs.Picture(np.zeros((20, 40, 3), dtype=np.uint8))
    with pytest.raises(OptionError, match=r"heights \[20, 30\]"):
        outputs.side_by_side([one, other], ["a", "b"])


def test_grid_picture_shows_values_and_holes():
    values = np.add.outer(np.zeros(6), np.linspace(0, 100, 12))
    values[2, 3] = np.nan
    picture = outputs.grid_picture(values, "lux", scale=ColourScale(0, 100), isolux=False, longest=240)
    cell, top = 20, (200 - 120) // 2
    hole = picture.pixels[top + 2 * cell + 10, 3 * cell + 10]
    assert hole.tolist() == encode_srgb(np.full(3, SURROUNDINGS)).tolist()
    shown = LINEAR_OF_BYTE[picture.pixels[top + 5 * cell + 10, 10 : 12 * cell : cell]]
    expected = ColourScale(0, 100).colours(np.linspace(0, 100, 12))
    np.testing.assert_allclose(shown, expected, atol=0.03)
    for shape in ((1, 1), (1, 5), (7, 1)):
        assert outputs.grid_picture(np.ones(shape), "W/m2").pixels.ndim == 3
    with pytest.raises(OptionError, match=r"shape \(4,\)"):
        outputs.grid_picture(np.ones(4), "lux")


# ---- cameras -----------------------------------------------------------------------------------


def chosen(scene: Scene) -> tuple[Camera, Surfaces, DisplayMesh]:
    display = refine(scene)
    surfaces = Surfaces(scene, display)
    return automatic_camera(surfaces, np.ones(len(display.points))), surfaces, display


def test_a_room_is_seen_from_inside_and_across():
    room = box("room", (0, 0, 0), (7, 2.8, 4), inward=True)
    table, cupboard = box("table", (3, 0.7, 1), (4.5, 0.75, 2)), box("cupboard", (6.4, 0, 0), (7, 2, 1.5))
    camera, _, _ = chosen(scene_of(room, table, cupboard))
    eye = camera.pose[:3, 3]
    assert (eye > 0.1).all() and (eye < (6.9, 2.7, 3.9)).all()
    assert eye[1] == pytest.approx(1.6)
    ahead = -camera.pose[:3, 2]
    assert (np.array([3.5, 1.4, 2]) - eye) @ ahead > 0
    assert abs(camera.pose[1, 0]) < 1e-12  # level


def test_an_object_is_seen_whole_from_outside_and_above():
    camera, surfaces, _ = chosen(scene_of(box("cupboard", (0, 0, 0), (1, 2, 0.5))))
    eye = camera.pose[:3, 3]
    assert eye[1] > 2
    local = (np.array(np.meshgrid((0, 1), (0, 2), (0, 0.5))).reshape(3, -1).T - eye) @ camera.pose[:3, :3]
    reach = np.tan(camera.vertical_fov / 2)
    assert (np.abs(local[:, 1] / local[:, 2]) < reach).all()
    assert (np.abs(local[:, 0] / local[:, 2]) < 1.6 * reach).all()
    hits = surfaces.intersect(eye[None], -camera.pose[None, :3, 2])
    assert hits.facing.all()


def test_an_open_box_is_seen_through_its_open_side():
    room = box("room", (-1, 0, -1), (1, 2, 1), inward=True, skip=5)  # open towards +z
    camera, _, _ = chosen(scene_of(room, box("block", (-0.6, 0, -0.6), (-0.1, 1.2, -0.1))))
    assert -camera.pose[2, 2] < 0
    assert camera.pose[2, 3] > 0


def test_the_movable_is_in_the_picture():
    room = box("room", (0, 0, 0), (14, 3, 6), inward=True)
    partition = box("partition", (2.4, 0, 0), (2.5, 3, 4.6))
    chair = box("chair", (0.6, 0, 0.6), (1.2, 0.9, 1.2), movable=True)
    camera, surfaces, display = chosen(scene_of(room, partition, chair))
    hits = surfaces.intersect(
        *camera_rays(camera, (96, 60), *np.indices((60, 96)).reshape(2, -1)[::-1] + 0.5)
    )
    assert (display.attached[display.triangles[hits.triangle[hits.hit], 0]] == 2).mean() > 0.005


def test_the_scenes_own_camera_comes_first():
    scene = scene_of(wall(), cameras=[FROM_BACK, FROM_FRONT])
    display = refine(scene, 1)
    assert outputs.render(scene, display, flat(display), size=SIZE).camera is FROM_BACK


# ---- files -------------------------------------------------------------------------------------


def test_png_of_a_scene_and_of_a_grid(tmp_path: Path):
    scene = scene_of(wall(), cameras=[FROM_FRONT], unit="lux")
    display = refine(scene, 1)
    count = len(display.points)
    result = Result(display.points, display.normals, flat(display), flat(display), np.ones(count), "lux",
                    {"command": "deltalux bake wall.glb -o a.png"})  # fmt: skip
    for name, false_colour in (("lit.png", False), ("false.png", True)):
        given_ = outputs.Baked(result, scene, display, size=(60, 40), false_colour=false_colour)
        outputs.write(tmp_path / name, given_)
        with Image.open(tmp_path / name) as image:
            assert image.size[1] == 40
            assert (image.size[0] > 60) == false_colour
            assert json.loads(image.text["deltalux"])["command"] == "deltalux bake wall.glb -o a.png"
    plane = Samples.on_grid((0, 0, 0), (3, 0, 0), (0, 0, 2), 1.0)
    grid = Result(np.zeros((6, 3)), np.zeros((6, 3)), np.ones((6, 3)), np.ones((6, 3)), np.ones(6), "lux")
    outputs.write(tmp_path / "grid.png", outputs.Baked(grid, scene, grid=plane))
    with Image.open(tmp_path / "grid.png") as image:
        assert image.size[0] > 300
