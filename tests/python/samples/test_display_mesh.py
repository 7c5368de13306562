# SPDX-License-Identifier: Apache-2.0
"""Display mesh: no cracks, spacing kept, creases split, samples inside the surface, sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deltalux.errors import OptionError, SceneError
from deltalux.mesh.closed_meshes import closed_meshes
from deltalux.mesh.display_mesh import BACK, BOTH, FRONT, DisplayMesh, refine
from deltalux.scene import Mesh, Scene
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes_for_tests import GREY, box, quad, scene_of
from thoroughness import examples


def rotation(angle: float) -> np.ndarray:
    pose = np.eye(4)
    pose[0, 0] = pose[2, 2] = np.cos(angle)
    pose[0, 2] = np.sin(angle)
    pose[2, 0] = -np.sin(angle)
    return pose


def sphere(name: str, rings: int, **options) -> Mesh:
    """Unit sphere with doubled vertices along its seam and at its poles."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * rings + 1), np.linspace(0, np.pi, rings + 1))
    points = np.stack([np.sin(v) * np.cos(u), np.cos(v), np.sin(v) * np.sin(u)], axis=-1).reshape(-1, 3)
    index = np.arange(len(points)).reshape(u.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return Mesh(name, points, triangles, material="grey", **options)


def edge_lengths(mesh: DisplayMesh) -> np.ndarray:
    corners = mesh.points[mesh.triangles]
    return np.linalg.norm(corners - corners[:, (1, 2, 0)], axis=2)


def areas(mesh: DisplayMesh) -> np.ndarray:
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def face_normals(mesh: DisplayMesh) -> np.ndarray:
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    return cross / np.linalg.norm(cross, axis=1, keepdims=True)


def open_edges(points: np.ndarray, triangles: np.ndarray) -> int:
    """Edges, by position, that do not occur equally often in both directions."""
    _, position = np.unique(np.round(points, 9) + 0.0, axis=0, return_inverse=True)
    position = position.reshape(-1)
    directed: dict[tuple[int, int], int] = {}
    for a, b, c in position[triangles].tolist():
        for edge in ((a, b), (b, c), (c, a)):
            directed[edge] = directed.get(edge, 0) + 1
    return sum(directed.get((b, a), 0) != n for (a, b), n in directed.items())


def test_box_is_refined_to_the_spacing_without_cracks():
    mesh = refine(scene_of(box("b", (0, 0, 0), (3, 1, 2))), 0.3)
    assert edge_lengths(mesh).max() <= 0.3 * (1 + 1e-5)
    assert areas(mesh).sum() == pytest.approx(2 * (3 + 2 + 6), rel=1e-12)
    assert open_edges(mesh.points, mesh.triangles) == 0
    assert mesh.spacing == 0.3


@settings(max_examples=examples(60))
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 3))
def test_random_closed_surface_stays_closed(seed: int, spacing: float):
    random = np.random.default_rng(seed)
    shaken = sphere("s", 4)
    points = np.round(shaken.vertices * random.uniform(0.5, 2, 3) @ rotation(random.uniform(0, 6))[:3, :3], 6)
    mesh = refine(scene_of(Mesh("s", points, shaken.triangles, material="grey")), spacing)
    assert edge_lengths(mesh).max() <= spacing * (1 + 1e-5)
    assert open_edges(mesh.points, mesh.triangles) == 0


def test_meshes_with_common_end_points_are_cut_alike():
    # A floor and a wall of different triangle shapes, the wall placed by a pose.
    floor = quad("floor", (0, 0, 0), (0, 0, 1.7), (2.3, 0, 1.7), (2.3, 0, 0))
    turn = rotation(0.7)
    inverse = np.linalg.inv(turn)[:3, :3]
    wall_points = np.array([(0, 0, 0), (2.3, 0, 0), (2.3, 9, 0), (0, 9, 0)]) @ inverse.T
    wall = Mesh("wall", wall_points, [[0, 1, 2], [0, 2, 3]], material="grey", pose=turn)
    mesh = refine(scene_of(floor, wall), 0.13)
    points = mesh.points
    on_edge = (np.abs(points[:, 1]) < 1e-9) & (np.abs(points[:, 2]) < 1e-9)
    of_floor = np.sort(points[on_edge & (mesh.vertex_mesh == 0), 0])
    of_wall = np.sort(points[on_edge & (mesh.vertex_mesh == 1), 0])
    assert len(of_floor) >= 18
    np.testing.assert_allclose(of_floor, of_wall, atol=1e-12)


def test_meshes_without_a_border_are_closed():
    whole = box("whole", (0, 0, 0), (1, 2, 3))
    lid = Mesh("without a triangle", whole.vertices, whole.triangles[1:], "grey")
    turned = whole.triangles.copy()
    turned[3] = turned[3, ::-1]
    turned = replace(whole, name="one turned over", triangles=turned)
    inward = replace(whole, name="from within", triangles=whole.triangles[:, ::-1])
    sheet = quad("sheet", (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
    nothing = Mesh("nothing", whole.vertices, whole.triangles[:0], "grey")
    scene = scene_of(whole, lid, turned, inward, nothing, sheet)
    for spacing in (5.0, 0.3):
        found = closed_meshes(refine(scene, spacing), len(scene.meshes))
        assert found.tolist() == [True, False, False, True, True, False]
    lit = [refine(scene_of(sheet), 0.3, sides=[side, side]) for side in (FRONT, BACK, BOTH)]
    assert [closed_meshes(mesh, 1)[0] for mesh in lit] == [False, False, True]


def test_edge_of_exactly_the_spacing_is_cut_on_neither_side():
    square = np.array([(0, 0, 0), (0, 0, 0.5), (0.5, 0, 0.5), (0.5, 0, 0)])
    turns = [rotation(0.1 * i) for i in range(30)]  # their rounding differs
    meshes = [
        Mesh(f"m{i}", square @ turn[:3, :3], [[0, 1, 2], [0, 2, 3]], material="grey", pose=turn)
        for i, turn in enumerate(turns)
    ]
    mesh = refine(scene_of(*meshes), 0.5)
    assert (np.bincount(mesh.triangle_mesh) == 4).all()  # only the diagonals are cut


def test_children_name_their_source_material_and_mesh():
    first = box("first", (0, 0, 0), (1, 1, 1), material=("grey", "red"), material_index=[0] * 6 + [1] * 6)
    mesh = refine(scene_of(first, box("second", (2, 0, 0), (3, 1, 1), material="red")), 0.4)
    assert (np.diff(mesh.triangle_mesh) >= 0).all()
    assert (np.diff(mesh.source_triangle[mesh.triangle_mesh == 0]) >= 0).all()
    expected = np.where((mesh.triangle_mesh == 0) & (mesh.source_triangle < 6), 0, 1)
    np.testing.assert_array_equal(mesh.triangle_material, expected)
    for number in range(12):
        own = (mesh.triangle_mesh == 0) & (mesh.source_triangle == number)
        assert areas(mesh)[own].sum() == pytest.approx(0.5)
    np.testing.assert_array_equal(
        mesh.vertex_mesh[mesh.triangles], np.repeat(mesh.triangle_mesh, 3).reshape(-1, 3)
    )


def test_creases_split_and_flat_material_borders_do_not():
    mesh = refine(scene_of(box("b", (0, 0, 0), (1, 1, 1))), 10)
    assert len(mesh.points) == 24
    np.testing.assert_allclose(np.abs(mesh.normals).max(axis=1), 1)
    strip = Mesh(
        "strip", [(0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0), (2, 0, 1), (2, 0, 0)],
        [(0, 1, 2), (0, 2, 3), (3, 2, 4), (3, 4, 5)], material=("grey", "red"), material_index=[0, 0, 1, 1],
    )  # fmt: skip
    assert len(refine(scene_of(strip), 10).points) == 6


@pytest.mark.parametrize(("angle", "vertices"), [(30, 4), (40, 6)])
def test_smooth_angle_decides_about_a_crease(angle: float, vertices: int):
    a = np.radians(angle)
    fold = Mesh(
        "fold", [(0, 0, 0), (1, 0, 0), (0.5, 0, 1), (0.5, np.sin(a), -np.cos(a))],
        [(0, 2, 1), (0, 1, 3)], material="grey", smooth_angle=35,
    )  # fmt: skip
    assert len(refine(scene_of(fold), 10).points) == vertices


def test_smooth_sphere_has_one_vertex_per_position_and_radial_normals():
    mesh = refine(scene_of(sphere("s", 24)), 10)
    assert len(np.unique(np.round(mesh.points, 9), axis=0)) == len(mesh.points) == 48 * 23 + 2
    assert np.einsum("ij,ij->i", mesh.normals, mesh.points).min() > 0.9999
    np.testing.assert_array_equal(mesh.sample_points, mesh.points)


def test_flat_shading_of_a_sphere_splits_every_corner():
    mesh = refine(scene_of(sphere("s", 8, smooth_angle=0)), 10)
    # Two triangles of each quad between the poles are coplanar and share the two ends of their diagonal.
    assert len(mesh.points) == 16 * 6 * 4 + 2 * 16 * 3


def test_samples_on_borders_move_into_their_own_surface():
    spacing = 0.5
    mesh = refine(scene_of(box("room", (0, 0, 0), (2, 2, 2))), spacing)
    shift = mesh.sample_points - mesh.points
    on_crease = ((np.abs(mesh.points - 1) > 1 - 1e-9).sum(axis=1)) >= 2
    assert (np.linalg.norm(shift[~on_crease], axis=1) == 0).all()
    length = np.linalg.norm(shift[on_crease], axis=1)
    assert length.min() > 0.01
    assert length.max() <= 0.15 * spacing + 1e-12
    assert np.abs(np.einsum("ij,ij->i", shift, mesh.normals)).max() < 1e-12
    inside = np.sort(np.abs(mesh.sample_points[on_crease] - 1), axis=1)
    assert inside[:, 1].max() < 1 - 0.005


def test_samples_at_a_reflex_corner_stay_on_the_floor():
    # L-shaped floor around a pillar that occupies x > 1, z > 1.
    outline = [(0, 0, 0), (2, 0, 0), (2, 0, 1), (1, 0, 1), (1, 0, 2), (0, 0, 2)]
    floor = Mesh("floor", outline, [(0, 3, 1), (1, 3, 2), (0, 5, 4), (0, 4, 3)], material="grey")
    mesh = refine(scene_of(floor), 0.25)
    assert mesh.normals[:, 1].min() == pytest.approx(1)
    x, _, z = mesh.sample_points.T
    assert (np.minimum(x, z) > 1e-3).all()
    assert (np.maximum(x, z) < 2 - 1e-3).all()
    corner = np.linalg.norm(mesh.points - (1, 0, 1), axis=1) < 1e-9
    assert corner.sum() == 1
    assert (mesh.sample_points[corner, (0, 2)] < 1).all()
    assert not ((x > 1 - 1e-6) & (z > 1 - 1e-6)).any()


def test_samples_on_a_straight_border_move_square_to_it():
    # Triangles of very different angles meet at (1, 0, 0).
    points = [(0, 0, 0), (1, 0, 0), (3, 0, 0), (0.2, 0, 0.4), (0.3, 0, 1), (3, 0, 1)]
    fan = Mesh("fan", points, [(0, 3, 1), (3, 4, 1), (4, 5, 1), (5, 2, 1)], material="grey")
    mesh = refine(scene_of(fan), 10)
    at = np.flatnonzero((mesh.points == (1, 0, 0)).all(axis=1))
    assert len(at) == 1
    shift = (mesh.sample_points - mesh.points)[at[0]]
    assert shift[2] > 0.01
    np.testing.assert_allclose(shift[:2], 0, atol=1e-12)


def test_overlapping_faces_do_not_smooth_each_other():
    folded = Mesh("m", [(0, 0, 0), (1, 0, 0), (0, 0, 1), (1, 0, 1)], [(0, 2, 1), (0, 3, 1)], material="grey")
    assert len(refine(scene_of(folded), 10).points) == 6


def test_thin_sliver_limits_the_inset():
    mesh = refine(scene_of(box("rim", (0, 0, 0), (1, 0.01, 1))), 0.3)
    height = mesh.sample_points[np.abs(mesh.normals[:, 1]) < 0.5, 1]
    assert ((height > 0) & (height < 0.01)).all()


def test_movable_stays_local_and_is_posed_on_request():
    pose = rotation(np.pi / 2)
    pose[:3, 3] = (5, 0, 0)
    scene = scene_of(
        box("room", (-9, -9, -9), (9, 9, 9)), box("chair", (0, 0, 0), (1, 1, 1), pose=pose, movable=True)
    )
    mesh = refine(scene, 20)
    own = mesh.attached == 1
    assert own.sum() == 24
    assert (mesh.attached[~own] == -1).all()
    assert mesh.points[own].min() == 0
    points, normals = mesh.world(scene)
    np.testing.assert_allclose(points[own].min(axis=0), (5, 0, -1), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    outward = points[own] - points[own].mean(axis=0)
    np.testing.assert_allclose((outward * normals[own]).sum(axis=1), 0.5)
    moved = np.eye(4)
    moved[:3, 3] = (0, 3, 0)
    np.testing.assert_allclose(mesh.world(scene, {"chair": moved})[0][own].min(axis=0), (0, 3, 0))
    assert (mesh.present(scene, {"chair": None}) == (mesh.triangle_mesh == 0)).all()
    with pytest.raises(OptionError, match=r"poses: found \['table'\]"):
        mesh.world(scene, {"table": None})


def test_static_meshes_are_in_world_space():
    pose = np.eye(4)
    pose[:3, 3] = (0, 7, 0)
    mesh = refine(scene_of(box("b", (0, 0, 0), (1, 1, 1), pose=pose)), 10)
    assert mesh.points[:, 1].min() == 7
    assert (mesh.attached == -1).all()


def test_sides_reverse_or_double_triangles():
    scene = scene_of(quad("sheet", (0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0)))
    front, back, both = (refine(scene, 0.6, sides=[s, s]) for s in (FRONT, BACK, BOTH))
    assert front.normals[:, 1].min() == pytest.approx(1)
    assert back.normals[:, 1].max() == pytest.approx(-1)
    assert face_normals(back)[:, 1].max() == pytest.approx(-1)
    assert not front.reversed.any() and back.reversed.all()
    assert len(both.points) == 2 * len(front.points)
    assert both.reversed.sum() * 2 == len(both.triangles)
    assert areas(both).sum() == pytest.approx(2)
    with pytest.raises(OptionError, match=r"sides: found shape \(1,\)"):
        refine(scene, 0.6, sides=[1])


def test_default_spacing_makes_a_sane_number_of_samples():
    for scale in (0.01, 1.0, 50.0):
        mesh = refine(scene_of(box("room", (0, 0, 0), scale * np.array([6, 3, 5]))))
        assert 25_000 <= len(mesh.points) <= 70_000
        assert edge_lengths(mesh).max() <= mesh.spacing * (1 + 1e-5)


def test_default_spacing_withstands_long_slivers():
    slats = [box(f"slat {i}", (0, 0.02 * i, 0), (30, 0.02 * i + 0.001, 0.001)) for i in range(200)]
    mesh = refine(scene_of(box("room", (0, 0, 0), (3, 3, 3)), *slats))
    assert len(mesh.points) <= 100_000


def test_dense_mesh_is_left_alone():
    dense = sphere("dense", 250)
    mesh = refine(scene_of(dense))
    kept = sum(1 for area in dense.triangle_areas() if area > 1e-12)
    assert len(mesh.triangles) == kept


def test_too_fine_a_spacing_is_refused_with_one_that_fits():
    scene = scene_of(box("room", (0, 0, 0), (6, 3, 5)))
    with pytest.raises(OptionError, match=r"spacing: found 1e-05 m, which needs more than 20000") as error:
        refine(scene, 1e-5, max_samples=20_000)
    fits = float(str(error.value).split("a spacing of ")[1].split(" m")[0])
    assert 10_000 / 4 <= len(refine(scene, fits, max_samples=20_000).points) <= 20_000
    with pytest.raises(OptionError, match="own vertices are more"):
        refine(scene, 1.0, max_samples=10)


@pytest.mark.parametrize("spacing", [0, -1, np.nan, np.inf])
def test_bad_spacing_is_refused(spacing: float):
    with pytest.raises(OptionError, match=r"spacing: found .* expected a positive number"):
        refine(scene_of(box("b", (0, 0, 0), (1, 1, 1))), spacing)


def test_degenerate_triangles_are_dropped():
    flat = Mesh(
        "m", [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)], [(0, 1, 2), (0, 1, 3), (1, 1, 3)], material="grey"
    )
    mesh = refine(scene_of(flat), 10)
    assert mesh.source_triangle.tolist() == [1]
    assert np.isfinite(mesh.normals).all()
    with pytest.raises(SceneError, match="no triangle with an area"):
        refine(scene_of(Mesh("m", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)], material="grey")))
    with pytest.raises(SceneError, match="without triangles"):
        refine(Scene([], [GREY]))
    with pytest.raises(SceneError, match="without triangles"):
        refine(Scene([Mesh("m", np.zeros((0, 3)), np.zeros((0, 3), int), material="grey")], [GREY]))


def test_refinement_is_deterministic():
    scene = scene_of(sphere("s", 12), box("room", (-4, -4, -4), (4, 4, 4)))
    one, two = refine(scene, 0.3), refine(scene, 0.3)
    for name in ("points", "sample_points", "normals", "triangles"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes()


# Three slivers, 2 µm wide and nearly in one plane: a cut along one of them leaves pieces without an area.
SLIVERS = np.array(
    [
        (1.0578112, 1.8849482, 1.9175195), (1.218664, 1.957135, 1.9175193), (1.2178364, 1.8849477, 1.917519),
        (1.2473095, 1.8979932, 1.9462438), (1.180425, 1.8982809, 1.9462443), (1.2473096, 1.897991, 1.9462451),
        (1.2186664, 1.9571353, 1.9175204), (1.2178362, 1.8849477, 1.9175192),
        (1.2186634, 1.9571344, 1.9175193),
    ]
)  # fmt: skip


@pytest.mark.parametrize("scale", [1.0, 0.25, 8.0])
@pytest.mark.parametrize("share", [0.2, 0.3, 0.45])
def test_slivers_that_are_cut_have_finite_normals(scale, share):
    slivers = Mesh("slivers", scale * SLIVERS, np.arange(9).reshape(-1, 3), material="grey")
    corners = scale * np.array([(-4, 0, -9), (-4, 0, 2), (5, 0, 2), (5, 0, -9)])
    mesh = refine(scene_of(quad("floor", *corners), slivers), share * scale)
    for array in (mesh.points, mesh.normals, mesh.sample_points):
        assert np.isfinite(array).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, rtol=1e-9)
