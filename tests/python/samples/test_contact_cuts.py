# SPDX-License-Identifier: Apache-2.0
"""Surfaces are cut where others stand on them: no cracks, no light past a wall's foot."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.mesh.covered_places import Cover
from deltalux.mesh.display_mesh import BOTH, DisplayMesh, refine
from deltalux.mesh.surfaces import Surfaces
from deltalux.samples.clearance import Clearance
from deltalux.samples.shared_samples import shared
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes_for_tests import GREY, box, quad, scene_of
from test_display_mesh import areas, edge_lengths, open_edges, rotation
from thoroughness import examples, slow

LAMP = dl.Material("lamp", reflectance=(0, 0, 0), emission=(20, 20, 20))
WIDTH, HEIGHT, DEPTH = 4.0, 2.6, 3.0
FOOT = 2.11  # where the partition stands, x
FLOOR = quad("floor", (0, 0, 0), (0, 0, DEPTH), (WIDTH, 0, DEPTH), (WIDTH, 0, 0))


def partition(thick: float, *, to: float = 2.3) -> dl.Mesh:
    if thick:
        return box("partition", (FOOT - thick / 2, 0, 0), (FOOT + thick / 2, 2.2, to))
    return quad("partition", (FOOT, 0, 0), (FOOT, 2.2, 0), (FOOT, 2.2, to), (FOOT, 0, to))


def divided_room(thick: float) -> dl.Scene:
    """A lamp on one side of a partition that ends before the front wall, on a floor of two triangles."""
    w, h, d = WIDTH, HEIGHT, DEPTH
    walls = (
        quad("ceiling", (0, h, 0), (w, h, 0), (w, h, d), (0, h, d)),
        quad("left", (0, 0, 0), (0, h, 0), (0, h, d), (0, 0, d)),
        quad("right", (w, 0, 0), (w, 0, d), (w, h, d), (w, h, 0)),
        quad("back", (0, 0, 0), (w, 0, 0), (w, h, 0), (0, h, 0)),
        quad("front", (0, 0, d), (0, h, d), (w, h, d), (w, 0, d)),
    )
    corners = [(0.7, 2.5, 1.2), (1.1, 2.5, 1.2), (1.1, 2.5, 1.6), (0.7, 2.5, 1.6)]
    lamp = dl.Mesh("lamp", corners, [[0, 1, 2], [0, 2, 3]], material="lamp")
    return dl.Scene([FLOOR, *walls, partition(thick), lamp], [GREY, LAMP])


def at_floor(scene: dl.Scene, display: DisplayMesh, light: np.ndarray, places: np.ndarray) -> np.ndarray:
    """What the display shows of `light` at its vertices, below places (k, 3) close above the floor."""
    down = np.broadcast_to((0.0, -1.0, 0.0), places.shape)
    hits = Surfaces(scene, display).intersect(places + np.array([0, 0.01, 0]), down)
    assert hits.hit.all()
    return np.einsum("kc,kc->k", light[display.triangles[hits.triangle]], hits.weights)


@pytest.mark.parametrize("thick", [0.1, slow(0.03), 0.0])
def test_no_light_is_interpolated_past_the_foot_of_a_partition(thick: float):
    scene = divided_room(thick)
    samples = dl.Samples.on_vertices(scene, spacing=0.3)
    random = np.random.default_rng(5)
    beside = FOOT + thick / 2 + random.uniform(0.02, 0.5, 400)
    places = np.column_stack([beside, np.zeros(400), random.uniform(0.1, 2.2, 400)])
    with dl.Session(scene, samples, paths=100_000, gather=512) as session:
        session.bake()
        truth = session.at(places, [[0, 1, 0]] * len(places))[:, 1]
        display = samples.display
        shown = at_floor(scene, display, display.at_vertices(session.irradiance)[:, 1], places)
    assert (shown <= 1.5 * truth).all()
    assert (shown >= 0.7 * truth).all()


def floor_of(mesh: DisplayMesh) -> np.ndarray:
    return mesh.triangles[mesh.triangle_mesh == 0]


@pytest.mark.parametrize("thick", [0.1, 0.0])
def test_a_foot_is_an_edge_of_the_floor_and_nothing_cracks(thick: float):
    scene = scene_of(FLOOR, partition(thick))
    mesh, alone = refine(scene, 0.3), refine(scene_of(FLOOR), 0.3)
    floor, before = floor_of(mesh), floor_of(alone)
    assert edge_lengths(mesh).max() <= 0.3 * (1 + 1e-5)
    border = open_edges(alone.points, before)
    # The foot of the partition ends at the back of the floor: where it does, the border has points more.
    assert open_edges(mesh.points, floor) == border + (2 if thick else 1)
    assert areas(mesh)[mesh.triangle_mesh == 0].sum() == pytest.approx(WIDTH * DEPTH, rel=1e-12)
    corners = mesh.points[floor]
    middle = corners.mean(axis=1)
    for foot in {FOOT - thick / 2, FOOT + thick / 2}:
        crossing = (corners[..., 0].min(axis=1) < foot - 0.01) & (corners[..., 0].max(axis=1) > foot + 0.01)
        assert not (crossing & (middle[:, 2] < 2.2)).any()


def test_samples_stand_on_the_open_side_and_on_both_of_a_sheet():
    for thick, sides in ((0.1, 1), (0.0, 2)):
        mesh = refine(scene_of(FLOOR, partition(thick)), 0.3, sides=None if thick else [BOTH] * 4)
        on_foot = (np.abs(mesh.points[:, 0] - FOOT - thick / 2) < 1e-9) & (mesh.points[:, 2] < 2.2)
        above = on_foot & (mesh.vertex_mesh == 0) & (mesh.normals[:, 1] > 0.9)
        places = mesh.points[above].round(6)
        assert len(places) == sides * len(np.unique(places, axis=0))
        aside = mesh.sample_points[above, 0] - FOOT - thick / 2
        assert (np.abs(aside) > 0.001).all()
        assert ((aside > 0).mean() == 1) if sides == 1 else ((aside > 0).mean() == 0.5)


@pytest.mark.parametrize("turned", [False, True])
def test_a_sheet_covers_neither_of_its_sides_whichever_way_its_triangles_are_listed(turned: bool):
    low = np.array([(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)], dtype=float)
    lid = low + np.array([0, 0.001, 0])
    up, down = np.array([(0, 2, 1), (0, 3, 2)]), np.array([(0, 1, 2), (0, 2, 3)])
    sheet = np.vstack([down, up] if turned else [up, down])
    second = np.arange(4) >= 2
    # So near that every ray meets it, from above and from below.
    points, normals = np.array([(0.4, 0.05, 0.3), (0.4, -0.05, 0.3)]), np.array([(0.0, -1, 0), (0, 1, 0)])
    assert not Cover.of(low, sheet, second, 0.3).covers(points, normals).any()
    # Under a lid that is one-sided, and lies on it: what meets the lid meets its back.
    points, normals = np.array([(0.5, 0, 0.5)] * 2), np.array([(0.0, 1, 0), (0, -1, 0)])
    both = np.vstack([sheet, up + 4])
    cover = Cover.of(np.vstack([low, lid]), both, np.append(second, [False] * 2), 0.3)
    np.testing.assert_array_equal(cover.covers(points, normals), [True, False])


@settings(max_examples=examples(30), deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_boxes_at_random_stay_closed(seed: int):
    random = np.random.default_rng(seed)
    meshes = []
    for i in range(random.integers(2, 6)):
        low = np.round(random.uniform(0, 1, 3), random.integers(0, 3))
        size = np.round(random.uniform(0.05, 1, 3), 2) + 0.01
        solid = box(f"b{i}", low, low + size)
        if random.random() < 0.5:
            solid = dl.Mesh(solid.name, solid.vertices @ rotation(random.uniform(0, 6))[:3, :3],
                            solid.triangles, material="grey")  # fmt: skip
        meshes.append(solid)
    mesh = refine(scene_of(*meshes), random.uniform(0.1, 0.5))
    for i, solid in enumerate(meshes):
        own = mesh.triangle_mesh == i
        assert open_edges(mesh.points, mesh.triangles[own]) == 0
        whole = refine(scene_of(solid), 10.0)
        assert areas(mesh)[own].sum() == pytest.approx(areas(whole).sum(), rel=1e-9)
    assert np.isfinite(mesh.sample_points).all()


def test_meshes_side_by_side_are_cut_at_the_same_places():
    left = quad("left", (0, 0, 0), (0, 0, 3), (2, 0, 3), (2, 0, 0))
    right = quad("right", (2, 0, 0), (2, 0, 3), (4, 0, 3), (4, 0, 0))
    across = box("across", (0.5, 0, 1.31), (2.05, 1, 1.36))  # ends just beyond the seam
    mesh = refine(scene_of(left, right, across), 0.4)
    both = np.isin(mesh.triangle_mesh, (0, 1))
    assert open_edges(mesh.points, mesh.triangles[both]) == open_edges(
        *(lambda m: (m.points, m.triangles))(refine(scene_of(left, right), 0.4))
    )


def joined(name: str, *parts: dl.Mesh, **options) -> dl.Mesh:
    """One mesh of several."""
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    triangles = [part.triangles + number for part, number in zip(parts, first, strict=False)]
    vertices = np.concatenate([part.vertices for part in parts])
    return dl.Mesh(name, vertices, np.concatenate(triangles), material="grey", **options)


def cupboard(rim: float, turned: float, **options) -> dl.Mesh:
    """A body with a door that leaves a rim of its front free, and a knob on the door."""
    body = box("body", (0, 0, 0), (0.5, 0.7, 0.5))
    door = box("door", (rim, rim, 0.5), (0.5 - rim, 0.7 - rim, 0.52))
    knob = box("knob", (0.4, 0.3, 0.515), (0.43, 0.33, 0.55))
    whole = joined("cupboard", body, door, knob)
    return dl.Mesh(
        "cupboard", whole.vertices @ rotation(turned)[:3, :3], whole.triangles, material="grey", **options
    )


@pytest.mark.parametrize("rim", [0.004, 0.006, 0.02, 0.1])
@pytest.mark.parametrize("turned", [0.0, 0.4])
def test_a_movable_is_cut_at_its_own_contacts_as_a_static_thing_is(rim: float, turned: float):
    """Wherever it stands, and whatever else can be moved: a crate whose own coordinates overlap with its."""
    pose = rotation(2.0)
    pose[:3, 3] = (3, 0.2, 1)
    crate = box("crate", (0.2, 0.2, 0.1), (0.9, 0.45, 0.9), movable=True)
    moving = cupboard(rim, turned, movable=True, pose=pose)
    mesh, alone = refine(scene_of(FLOOR, crate, moving), 0.1), refine(scene_of(cupboard(rim, turned)), 0.1)
    assert len(alone.points) > len(refine(scene_of(box("body", (0, 0, 0), (0.5, 0.7, 0.5))), 0.1).points)
    kept = mesh.triangle_mesh == 2
    for name in ("points", "sample_points", "normals"):
        np.testing.assert_array_equal(
            getattr(mesh, name)[mesh.triangles[kept]], getattr(alone, name)[alone.triangles], err_msg=name
        )
    only = refine(scene_of(crate), 0.1)
    np.testing.assert_array_equal(
        mesh.points[mesh.triangles[mesh.triangle_mesh == 1]], only.points[only.triangles]
    )


@pytest.mark.parametrize("rim", [0.006, 0.015])
def test_no_frame_around_a_movable_s_door_is_black(rim: float):
    """As `Session.at` gives it where the frame is: no less than a fifth of that, as on static things."""
    pose = np.eye(4)
    pose[:3, 3] = (1.7, 0, 0.3)
    room = box("room", (0, 0, 0), (4, 2.7, 3))
    room = dl.Mesh("room", room.vertices, room.triangles[:, ::-1], material="grey")
    lights = [dl.PointLight("bulb", (2, 2.4, 2), (80, 80, 80))]
    scene = dl.Scene([room, cupboard(rim, 0.0, movable=True, pose=pose)], [GREY], lights)
    with dl.Session(scene, dl.Samples.on_vertices(scene, 0.1), paths=20_000, gather=64) as session:
        session.bake()
        display, light = session.samples.display, session.vertex_irradiance[:, 1]
        points, normals = display.world(scene)
        x, y, z = (points - pose[:3, 3]).T
        front = (display.vertex_mesh == 1) & (normals[:, 2] > 0.9) & (np.abs(z - 0.5) < 1e-6) & (y > 0.1)
        frame = front & ((x < rim + 1e-6) | (x > 0.5 - rim - 1e-6) | (y > 0.7 - rim - 1e-6))
        middle = pose[:3, 3] + (rim / 2, 0.35, 0.5001)
        least = session.at([middle], [(0, 0, 1)])[0, 1] / 5
    assert frame.sum() > 20
    assert np.mean(light[frame] < least) < 0.02


def test_movables_neither_cut_nor_are_cut():
    pose = rotation(0.3)
    pose[:3, 3] = (1, 0, 1)
    chair = box("chair", (0, 0, 0), (0.4, 0.5, 0.4), movable=True, pose=pose)
    mesh = refine(scene_of(FLOOR, chair), 0.3)
    for i, own in enumerate((FLOOR, chair)):
        alone = refine(scene_of(own), 0.3)
        kept = mesh.triangle_mesh == i
        np.testing.assert_array_equal(mesh.points[mesh.triangles[kept]], alone.points[alone.triangles])


def test_a_wall_welded_into_the_floor_parts_its_light():
    points = [(0, 0, 0), (0, 0, 2), (1, 0, 2), (1, 0, 0), (2, 0, 2), (2, 0, 0), (1, 1, 0), (1, 1, 2)]
    floor = [(0, 1, 2), (0, 2, 3), (3, 2, 4), (3, 4, 5)]
    wall = [(3, 6, 7), (3, 7, 2)]
    whole = refine(scene_of(dl.Mesh("m", points, floor, material="grey")), 0.5)
    mesh = refine(scene_of(dl.Mesh("m", points, floor + wall, material="grey")), 0.5)
    on_foot = [(m.points[:, 0] == 1) & (m.points[:, 1] == 0) & (m.normals[:, 1] > 0.9) for m in (whole, mesh)]
    assert on_foot[1].sum() == 2 * on_foot[0].sum()


def test_vertices_share_no_sample_behind_a_partition():
    # Among very many vertices, so that groups are as large as they get.
    scene = divided_room(0.0)
    display = refine(scene, 0.3)
    few = shared(display, Clearance(scene, display).covered, most=100)
    theirs = display.points[few.sample_vertices][few.sharing.samples]
    side = np.sign(display.sample_points[:, 0] - FOOT)
    floor = (display.vertex_mesh == 0) & (display.points[:, 2] < 1.7) & (side != 0)
    other = side[few.sample_vertices][few.sharing.samples]
    taken = few.sharing.weights > 0.0
    assert (theirs[floor][taken[floor]][:, 1] == 0).all()
    assert (other[floor] == side[floor][:, None])[taken[floor]].all()
