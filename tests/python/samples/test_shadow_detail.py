# SPDX-License-Identifier: Apache-2.0
"""What is shown is refined at the edges of shadows and pools, stays exact under edits, and cracks nowhere."""

from __future__ import annotations

import warnings
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.mesh.surfaces import Surfaces
from deltalux.outputs.of_session import baked_of
from deltalux.outputs.vertex_colors import write_glb
from meshes_for_tests import GREY, box, quad
from test_contact_cuts import DEPTH, FLOOR, HEIGHT, WIDTH
from test_display_mesh import areas, edge_lengths, rotation

SPACING = 0.25
SPOT, HALF_ANGLE = (1.2, 2.5, 1.5), 0.26
LOW, HIGH = (2.3, 0.72, 1.0), (3.3, 0.75, 1.7)  # of a table
SUN = (-0.5, -1.0, 0.1)


def lit_room(*more: dl.Mesh) -> dl.Scene:
    """Open to one side: the pool of a spot on the floor, and the shadow of a table in the sun."""
    w, h, d = WIDTH, HEIGHT, DEPTH
    walls = (
        quad("ceiling", (0, h, 0), (w, h, 0), (w, h, d), (0, h, d)),
        quad("left", (0, 0, 0), (0, h, 0), (0, h, d), (0, 0, d)),
        quad("back", (0, 0, 0), (w, 0, 0), (w, h, 0), (0, h, 0)),
        quad("front", (0, 0, d), (0, h, d), (w, h, d), (w, 0, d)),
    )
    lights = [
        dl.SpotLight("spot", SPOT, (0, -1, 0), (300, 300, 300), 0.25, 0.27),
        dl.SunLight("sun", SUN, (5, 5, 5)),
    ]
    return dl.Scene([FLOOR, *walls, box("table", LOW, HIGH), *more], [GREY], lights=lights)


def beside_the_pool(random: np.random.Generator) -> np.ndarray:
    turn = random.uniform(0, 2 * np.pi, 3000)
    radius = SPOT[1] * np.tan(HALF_ANGLE) + random.uniform(-0.12, 0.12, 3000)
    return np.column_stack([SPOT[0] + radius * np.cos(turn), 0 * turn, SPOT[2] + radius * np.sin(turn)])


def beside_the_shadow(random: np.random.Generator) -> np.ndarray:
    """Along the four edges that a table casts onto the floor."""
    low, high = (np.array(at)[[0, 2]] + LOW[1] * np.array(SUN)[[0, 2]] for at in (LOW, HIGH))
    along = random.uniform(low, high, (3000, 2))
    axis, end = random.integers(0, 2, 3000), random.integers(0, 2, 3000)
    along[np.arange(3000), axis] = np.where(end, high[axis], low[axis]) + random.uniform(-0.12, 0.12, 3000)
    return np.column_stack([along[:, 0], np.zeros(3000), along[:, 1]])


def error_at(session: dl.Session, places: np.ndarray) -> float:
    """Mean absolute error of the shown light (green) against direct light there, without what is indirect."""
    display = session.samples.display
    assert display is not None
    hits = Surfaces(session.scene, display).intersect(
        places + np.array([0, 0.01, 0]), np.broadcast_to((0.0, -1.0, 0.0), places.shape)
    )
    corners = display.triangles[hits.triangle]
    up = np.broadcast_to((0.0, 1.0, 0.0), places.shape)
    truth = session.at(places, up, part="direct")[:, 1]
    own = session.samples
    indirect = session.at(own.points, own.normals, part="direct")[:, 1]
    indirect = display.at_vertices(session.irradiance[:, 1] - indirect)
    direct = (session.vertex_irradiance[:, 1] - indirect)[corners]
    return float(np.abs(np.einsum("kc,kc->k", direct, hits.weights) - truth).mean())


@pytest.fixture(scope="module")
def sessions():
    scene = lit_room()
    made = []
    for detail in (None, "auto"):
        samples = dl.Samples.on_vertices(scene, spacing=SPACING, detail=detail)
        session = dl.Session(scene, samples, paths=30_000, gather=64)
        session.bake()
        made.append(session)
    yield made
    for session in made:
        session.close()


@pytest.mark.parametrize("places", [beside_the_pool, beside_the_shadow])
def test_edges_are_three_times_nearer_to_the_truth(sessions, places):
    plain, detailed = (error_at(session, places(np.random.default_rng(1))) for session in sessions)
    assert detailed < plain / 3


def test_samples_and_their_light_are_those_without_detail(sessions):
    plain, detailed = sessions
    np.testing.assert_array_equal(plain.samples.points, detailed.samples.points)
    np.testing.assert_array_equal(plain.irradiance, detailed.irradiance)
    assert plain.digest() == detailed.digest()
    display = detailed.samples.display
    few = plain.samples.display.points
    assert len(few) < len(display.points) <= 2 * len(few)
    np.testing.assert_array_equal(display.points[display.sample_vertices], few)
    kept = np.setdiff1d(np.arange(len(display.points)), display.detail)
    np.testing.assert_array_equal(detailed.vertex_irradiance[kept], plain.irradiance)


def test_detail_cracks_nothing(sessions):
    plain, detailed = (session.samples.display for session in sessions)
    np.testing.assert_allclose(areas(detailed).sum(), areas(plain).sum(), rtol=1e-12)
    assert edge_lengths(detailed).max() <= SPACING * (1 + 1e-5)
    # Where floor, walls and table end they are refined together, so all that is open stays so.
    for mesh in range(6):
        triangles = detailed.triangles[detailed.triangle_mesh == mesh]
        border = plain.triangles[plain.triangle_mesh == mesh]
        assert border_length(detailed, triangles) == pytest.approx(border_length(plain, border), rel=1e-9)


def border_length(mesh: DisplayMesh, triangles: np.ndarray) -> float:
    """Of edges that, by position, belong to one triangle; a crack would add its sides."""
    _, place = np.unique(np.round(mesh.points, 9) + 0.0, axis=0, return_inverse=True)
    place = place.reshape(-1)[triangles]
    ends = np.sort(np.stack([place, place[:, (1, 2, 0)]], axis=-1), axis=-1).reshape(-1, 2)
    _, index, count = np.unique(ends, axis=0, return_index=True, return_counts=True)
    corners = mesh.points[triangles]
    lengths = np.linalg.norm(corners - corners[:, (1, 2, 0)], axis=2).ravel()
    return float(lengths[index[count == 1]].sum())


def test_choice_does_not_follow_movables():
    displays = []
    for x in (0.5, 1.2):
        pose = rotation(0.3)
        pose[:3, 3] = (x, 0, 1.4)
        chair = box("chair", (0, 0, 0), (0.3, 0.5, 0.3), movable=True, pose=pose)
        displays.append(dl.Samples.on_vertices(lit_room(chair), spacing=SPACING, detail="auto").display)
    np.testing.assert_array_equal(displays[0].triangles, displays[1].triangles)
    np.testing.assert_array_equal(displays[0].points, displays[1].points)
    assert (displays[0].attached[displays[0].detail] == -1).all()
    assert (np.diff(displays[0].vertex_mesh) >= 0).all()


def test_updates_give_what_a_bake_gives_there_and_files_keep_it(tmp_path: Path):
    chair = box("chair", (0, 0, 0), (0.3, 0.5, 0.3), movable=True)
    scene = lit_room(chair)
    samples = dl.Samples.on_vertices(scene, spacing=SPACING, detail="auto")
    pose = rotation(0.4)
    pose[:3, 3] = (1.4, 0, 1.4)
    with dl.Session(scene, samples, paths=20_000, gather=64, threads=2) as session:
        session.bake()
        before = session.vertex_irradiance
        session.move("chair", pose)
        session.dim("sun", 0.5)
        session.update()
        after = session.vertex_irradiance
        # The chair's shadow lies on vertices without samples, too.
        assert (after != before)[samples.display.detail].any()
        session.recompute()
        np.testing.assert_array_equal(session.vertex_irradiance, after)
        session.save(tmp_path / "a.dlx")
        glb = tmp_path / "a.glb"
        write_glb(glb, baked_of(session, "test"))
    with dl.Session.open(tmp_path / "a.dlx", threads=1) as opened:
        np.testing.assert_array_equal(opened.samples.display.detail, samples.display.detail)
        np.testing.assert_array_equal(opened.vertex_irradiance, after)
    assert glb.stat().st_size > 32 * len(samples.display.points)


@pytest.mark.parametrize("detail", [0.0, -1.0, float("nan"), "fine"])
def test_a_wrong_detail_is_named(detail):
    with pytest.raises(dl.OptionError, match="detail: found"):
        dl.Samples.on_vertices(lit_room(), spacing=SPACING, detail=detail)


def test_a_dark_scene_has_no_detail():
    assert (
        dl.Samples.on_vertices(dl.Scene([FLOOR], [GREY]), spacing=0.5, detail="auto").display.detail is None
    )


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1.0, 30.0, 1e3, 1e6, 1e8])
@pytest.mark.parametrize("detail", ["auto", 5e-324, 1e-308, 1e-30, 1e10])
@pytest.mark.parametrize("power", [1e-30, 1.0, 1e30])
def test_no_size_overflows(scale, detail, power):
    """NumPy says nothing, and the refinement in other units is the same one."""
    floor = scale * np.array([(-2, 0, -2), (2, 0, -2), (2, 0, 2), (-2, 0, 2.0)])
    triangles = [(0, 2, 1), (0, 3, 2)]
    meshes = [
        dl.Mesh("floor", floor, triangles, "grey"),
        dl.Mesh("table", 0.25 * floor + (0, 0.7 * scale, 0), triangles, "grey"),
    ]
    lamp = dl.PointLight("lamp", scale * np.array((0.3, 2, 0.1)), (power,) * 3)
    scene = dl.Scene(meshes, [dl.Material("grey")], [lamp])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        samples = dl.Samples.on_vertices(scene, spacing=0.5 * scale, detail=detail)
    assert np.isfinite(samples.display.points).all()
    assert np.isfinite(samples.points).all()
