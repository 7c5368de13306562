# SPDX-License-Identifier: Apache-2.0
"""Sides that get samples: outward rooms, sheets lit from both sides, solids, movables, no light."""

from __future__ import annotations

from dataclasses import replace

import deltalux as dl
import numpy as np
import pytest
from deltalux.mesh.display_mesh import BACK, BOTH, FRONT
from deltalux.outputs.images import UNSAMPLED, render
from deltalux.outputs.tone import encode_srgb
from deltalux.samples.lit_sides import lit_sides
from rooms import translation, turn
from scenes_for_tests import Shape, box, grey, joined, quad, sphere, two_rooms
from thoroughness import slow

GLOW = dl.Material("glow", (0.2, 0.2, 0.2), (5, 5, 5))
ROOM = box((-2, 0, -2), (2, 3, 2))  # seen from inside
LAMP = quad((-0.5, 2.9, -0.5), (1, 0, 0), (0, 0, 1)).mesh("lamp", "glow")  # shines down
BULB = dl.PointLight("bulb", (0.3, 2.5, 0.2))


def scene_of(*meshes: dl.Mesh, lights=(), lamp: bool = True) -> dl.Scene:
    """Meshes in one grey, and a lamp below the ceiling of `ROOM`."""
    return dl.Scene([*meshes, *([LAMP] if lamp else [])], [grey(), GLOW], lights)


def sides_of(scene: dl.Scene, name: str) -> np.ndarray:
    first = 0
    for mesh in scene.meshes:
        if mesh.name == name:
            return lit_sides(scene)[first : first + len(mesh.triangles)]
        first += len(mesh.triangles)
    raise KeyError(name)


def grid(corner, u, v, cells: int) -> Shape:
    """A plane of 2 x cells x cells triangles that share vertices."""
    corner, u, v = (np.asarray(x, float) for x in (corner, u, v))
    j, i = np.divmod(np.arange((cells + 1) ** 2), cells + 1)
    points = corner + (i / cells)[:, None] * u + (j / cells)[:, None] * v
    a = np.flatnonzero((i < cells) & (j < cells))
    b, c, d = a + 1, a + cells + 2, a + cells + 1
    return Shape(points, np.concatenate([np.stack(t, axis=1) for t in ((a, b, c), (a, c, d))]))


def unsampled_pixels(picture) -> int:
    grey_level = encode_srgb(np.full(3, UNSAMPLED))
    return int((picture.pixels == grey_level).all(axis=2).sum())


# ---- static ----------------------------------------------------------------------------------------


def test_a_room_wound_outward_is_lit_as_one_wound_inward():
    inside, outside = (scene_of(s.mesh("room", "grey")) for s in (ROOM, ROOM.flipped()))
    points, light = [], []
    for scene in (inside, outside):
        with dl.Session(scene, dl.Samples.on_vertices(scene, 0.3), paths=20_000, gather=256) as session:
            session.bake()
            picture = render(scene, session.samples.display, session.irradiance, size=(90, 60))
            assert unsampled_pixels(picture) == 0
            points.append(np.unique(np.c_[session.samples.points, session.samples.normals].round(6), axis=0))
            light.append(session.irradiance.mean())
    assert (sides_of(inside, "room") == FRONT).all()
    assert (sides_of(outside, "room") == BACK).all()
    np.testing.assert_array_equal(*points)
    assert light[0] == pytest.approx(light[1], rel=0.005)


def test_a_sheet_in_the_middle_of_a_room_is_lit_from_both_sides():
    curtain = quad((0.6, 0.2, -1), (0, 2, 0), (0, 0, 2)).mesh("curtain", "grey")
    scene = scene_of(ROOM.mesh("room", "grey"), curtain)
    assert (sides_of(scene, "curtain") == BOTH).all()
    with dl.Session(scene, dl.Samples.on_vertices(scene, 0.3), paths=50_000, gather=256) as session:
        session.bake()
        display = session.samples.display
        assert (session.irradiance[display.vertex_mesh == 1] > 0).all()


@pytest.mark.parametrize(("lit", "side"), [("right", FRONT), ("left", BACK)])
def test_a_partition_is_sampled_on_the_side_of_the_lamp(lit, side):
    assert (sides_of(two_rooms(lit), "wall") == side).all()


def test_a_dim_room_beside_a_bright_one_is_sampled():
    """Of the light on a partition, one in a hundred particles comes round its end to the far side."""
    partition = quad((0.9, 0, -2), (0, 3, 0), (0, 0, 3.6)).mesh("partition", "grey")
    scene = scene_of(ROOM.mesh("room", "grey"), partition)
    assert (sides_of(scene, "partition") == BOTH).all()


def test_solids_are_sampled_outside():
    """Closed surfaces have one side: also inside-out ones, and beams that a lamp sticks in."""
    solid = box((-1, 0.5, -1), (-0.4, 1, -0.4))
    within = quad((1.1, 1.1, 1.1), (0.2, 0, 0), (0, 0, 0.2)).mesh("inner lamp", "glow")
    scene = scene_of(
        ROOM.mesh("room", "grey"),
        solid.flipped().mesh("solid", "grey"),
        Shape(solid.vertices + np.array([1.2, 0, 0]), solid.triangles).mesh("inside out", "grey"),
        box((1, 1, 1), (1.4, 1.4, 1.4)).flipped().mesh("beam", "grey"),
        within,
    )
    assert (sides_of(scene, "room") == FRONT).all()
    assert (sides_of(scene, "solid") == FRONT).all()
    assert (sides_of(scene, "inside out") == BACK).all()
    assert (sides_of(scene, "beam") == FRONT).all()


@pytest.mark.parametrize("shape", [sphere(50), sphere(50).flipped()], ids=["inward", "outward"])
def test_triangles_without_hits_follow_their_neighbours(shape):
    """20,000 triangles, most of which the pilot never meets."""
    scene = dl.Scene(
        [shape.mesh("cave", "grey")], [dl.Material("grey", (0, 0, 0))], [dl.PointLight("p", (0, 0, 0))]
    )
    first = shape.triangles[0]
    inward = np.linalg.det(shape.vertices[first]) < 0
    assert (lit_sides(scene) == (FRONT if inward else BACK)).all()


def test_a_fine_sheet_is_sampled_on_both_sides_all_over():
    veil = grid((-1, 0.2, 0.3), (2, 0, 0), (0, 2, 0), 150)  # 45,000 triangles
    scene = scene_of(ROOM.mesh("room", "grey"), veil.mesh("veil", "grey"))
    assert (sides_of(scene, "veil") == BOTH).all()


def test_a_fine_sheet_that_is_lit_from_behind_in_one_place_is_sampled_there():
    """A floor of 10,000 triangles is the ceiling of a lit closet of 0.4 % of its area."""
    floor = grid((-4, 0, 4), (8, 0, 0), (0, 0, -8), 70)
    closet = box((2, -1, 2), (2.5, 0, 2.5), ("left", "right", "floor", "back", "front"))
    lights = dl.PointLight("above", (0, 2, 0)), dl.PointLight("below", (2.25, -0.5, 2.25))
    scene = scene_of(floor.mesh("floor", "grey"), closet.mesh("closet", "grey"), lights=lights, lamp=False)
    x, _, z = floor.vertices[floor.triangles].mean(axis=1).T
    over = (abs(x - 2.25) < 0.24) & (abs(z - 2.25) < 0.24)
    assert over.sum() > 20
    assert (sides_of(scene, "floor")[over] == BOTH).all()


def test_a_sheet_that_was_doubled_is_not_sampled_twice():
    """Both windings in one place, of which a ray meets one or the other."""
    sheet = quad((-1, 1, -0.5), (1, 0, 0), (0, 0, 1))
    both = Shape(sheet.vertices, np.concatenate([sheet.triangles, sheet.triangles[:, ::-1]]))
    scene = scene_of(ROOM.mesh("room", "grey"), both.mesh("sheet", "grey"))
    assert list(sides_of(scene, "sheet")) == [BOTH, BOTH, FRONT, FRONT]
    with dl.Session(scene, dl.Samples.on_vertices(scene, 0.4), paths=5000, gather=256) as session:
        session.bake()
        below = dl.Camera("c", translation(-0.5, 0.2, 0) @ np.array(
            [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]))  # fmt: skip
        picture = render(scene, session.samples.display, session.irradiance, camera=below, size=(60, 60))
        assert unsampled_pixels(picture) == 0


def test_light_sources_keep_their_front():
    """A lamp that shines into the sky and is lit from below only."""
    lamp = quad((-1, 1, -1), (0, 0, 2), (2, 0, 0)).mesh("up", "glow")
    floor = quad((-3, 0, -3), (0, 0, 6), (6, 0, 0)).mesh("floor", "grey")
    scene = scene_of(lamp, floor, lights=[dl.PointLight("below", (0, 0.5, 0))], lamp=False)
    assert (sides_of(scene, "up") == BOTH).all()


@pytest.mark.parametrize("name", ["cornell_box", "office", "expo", slow("atrium")])
def test_well_made_scenes_have_samples_in_front_only(name):
    assert (lit_sides(getattr(dl.scenes, name)()) == FRONT).all()


# ---- movables --------------------------------------------------------------------------------------


def test_movables_are_sampled_where_they_are_seen_from_outside():
    cube = box((0, 0, 0), (0.5, 0.5, 0.5))
    core = box((0.2, 0.2, 0.2), (0.3, 0.3, 0.3), ("floor", "left"))
    shapes = {
        "solid": cube.flipped(),
        "inside out": cube,
        "sheet": quad((0, 0, 0), (1, 0, 0), (0, 1, 0)),
        "bucket": box((0, 0, 0), (0.5, 0.5, 0.5), ("left", "right", "floor", "back", "front")).flipped(),
        "hidden": joined(cube.flipped(), core),
    }
    movable = [s.mesh(n, "grey", movable=True, pose=translation(0, 1, 0)) for n, s in shapes.items()]
    scene = scene_of(ROOM.mesh("room", "grey"), *movable)
    found = {name: set(sides_of(scene, name)) for name in shapes}
    assert found == {
        "solid": {FRONT}, "inside out": {BACK}, "sheet": {BOTH}, "bucket": {BOTH}, "hidden": {FRONT}
    }  # fmt: skip


def test_samples_do_not_depend_on_where_movables_stand():
    """A block that hides the only lamp from a curtain or not; a lamp that moves."""
    curtain = quad((0.6, 0.2, -1), (0, 2, 0), (0, 0, 2)).mesh("curtain", "grey")
    glowing = box((-0.1,) * 3, (0.1,) * 3).flipped()
    displays = []
    for pose in (np.eye(4), translation(0, 2.85, 0), translation(1.5, 1, 1) @ turn(0.5)):
        block = (
            box((-0.6, 0, -0.6), (0.6, 0.03, 0.6)).flipped().mesh("block", "grey", movable=True, pose=pose)
        )
        torch = glowing.mesh("torch", "glow", movable=True, pose=pose @ translation(0, -0.5, 0))
        spot = dl.SpotLight("spot", (0, 0, 0), (0, -1, 0), attached_to="block")
        scene = scene_of(ROOM.mesh("room", "grey"), curtain, block, torch, lights=[spot])
        displays.append(dl.Samples.on_vertices(scene, 0.5).display)
    for other in displays[1:]:
        np.testing.assert_array_equal(other.sample_points, displays[0].sample_points)
        np.testing.assert_array_equal(other.triangles, displays[0].triangles)


@pytest.mark.parametrize("torch", [False, True])
def test_a_front_is_not_given_up_where_a_light_moves(torch):
    """A closed room under the sun, dark inside but for a torch that is carried around."""
    sun = dl.SunLight("sun", (0, -1, 0.2))
    spot = [dl.SpotLight("spot", (0, 0, 0), (0, -1, 0), attached_to="torch")] if torch else []
    body = (
        box((-0.1,) * 3, (0.1,) * 3).flipped().mesh("torch", "grey", movable=True, pose=translation(0, 1, 0))
    )
    scene = scene_of(ROOM.mesh("room", "grey"), body, lights=[sun, *spot], lamp=False)
    assert (sides_of(scene, "room") == (BOTH if torch else BACK)).all()


# ---- odd scenes and the keyword --------------------------------------------------------------------


def test_without_static_light_the_front_is_sampled():
    sheet = quad((0, 0, 0), (1, 0, 0), (0, 1, 0))
    dark = dl.PointLight("out", (0, 2, 0), (0, 0, 0))
    own = sheet.mesh("own", "glow", movable=True)
    for scene in (
        scene_of(sheet.mesh("sheet", "grey"), lamp=False),
        scene_of(sheet.mesh("sheet", "grey"), lights=[dark], lamp=False),
        scene_of(sheet.mesh("sheet", "grey"), own, lamp=False),
    ):
        assert (sides_of(scene, "sheet") == FRONT).all()


def test_triangles_without_area_are_left_alone():
    sheet = quad((-1, 1, 0), (2, 0, 0), (0, 1, 0))
    triangles = np.concatenate([[(0, 0, 1), (2, 2, 2)], sheet.triangles, [(1, 1, 1)]])
    scene = scene_of(ROOM.mesh("room", "grey"), Shape(sheet.vertices, triangles).mesh("sheet", "grey"))
    assert list(sides_of(scene, "sheet")) == [FRONT, FRONT, BOTH, BOTH, FRONT]
    nothing = dl.Mesh("nothing", np.zeros((0, 3)), np.zeros((0, 3), int), "grey")
    point = dl.Mesh("point", np.zeros((1, 3)), [(0, 0, 0)], "grey")
    assert len(lit_sides(dl.Scene([nothing], [grey()]))) == 0
    assert list(lit_sides(dl.Scene([point, nothing, replace(point, name="p", movable=True)], [grey()]))) == [
        1,
        1,
    ]


def test_equal_scenes_have_equal_sides():
    scene = scene_of(
        ROOM.mesh("room", "grey"), grid((-1, 1, 0), (2, 0, 0), (0, 1, 0), 20).mesh("veil", "grey")
    )
    np.testing.assert_array_equal(lit_sides(scene), lit_sides(scene))


def test_the_sides_can_be_given():
    scene = scene_of(ROOM.flipped().mesh("room", "grey"))
    room = {}
    for sides in ("auto", "front", "both"):
        display = dl.Samples.on_vertices(scene, 0.5, sides=sides).display
        room[sides] = display.reversed[display.triangle_mesh == 0]
    assert room["auto"].all()
    assert not room["front"].any()
    assert room["both"].mean() == 0.5
    with pytest.raises(
        dl.OptionError, match=r"sides: found 'back', expected one of \('auto', 'front', 'both'\)"
    ):
        dl.Samples.on_vertices(scene, 0.5, sides="back")
