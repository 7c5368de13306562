# SPDX-License-Identifier: Apache-2.0
"""After an edit the mesh that is shown can be refined where shadows lie now; light and samples stay."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
import pytest
from deltalux.rendering import render_session
from meshes_for_tests import GREY, box
from session_files import read_parts, write_parts
from test_shadow_detail import LOW, SPACING, beside_the_shadow, error_at, lit_room

AWAY = 1.4  # metres along -X


def place(x: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = (x, 0, 0)
    return pose


def room_with_stool() -> dl.Scene:
    """The room's table, and the like beside it that can move, at first where the table's shadow is not."""
    low, high = (LOW[0], 0.72, 1.0), (LOW[0] + 1.0, 0.75, 1.7)
    stool = box("stool", low, high, movable=True, pose=place(-AWAY))
    scene = lit_room()
    meshes = [mesh for mesh in scene.meshes if mesh.name != "table"]
    return dl.Scene([*meshes, stool], [GREY], lights=scene.lights)


def assert_same_mesh(one: Any, two: Any) -> None:
    """Display meshes, and what belongs to them."""
    for field in dataclasses.fields(one):
        a, b = getattr(one, field.name), getattr(two, field.name)
        if dataclasses.is_dataclass(a):
            assert_same_mesh(a, b)
        else:
            np.testing.assert_array_equal(a, b, err_msg=field.name)


@pytest.fixture(scope="module")
def moved():
    """A session that was refined before its stool moved to where `beside_the_shadow` looks."""
    scene = room_with_stool()
    samples = dl.Samples.on_vertices(scene, spacing=SPACING, detail="auto")
    with dl.Session(scene, samples, paths=20_000, gather=64) as session:
        session.bake()
        session.refine()
        session.move("stool", place(0.0))
        session.update()
        yield session


def test_refinement_follows_what_moved(moved):
    places = beside_the_shadow(np.random.default_rng(1))
    before, light, digest = error_at(moved, places), moved.irradiance, moved.digest()
    added = moved.refine()
    assert error_at(moved, places) < before / 3
    assert added == len(moved.samples.display.detail) > 0
    np.testing.assert_array_equal(moved.irradiance, light)
    assert moved.digest() == digest


def test_refined_as_a_session_that_began_there(moved):
    moved.refine()
    scene = moved.scene
    stool = dataclasses.replace(next(m for m in scene.meshes if m.name == "stool"), pose=place(0.0))
    there = dl.Scene([*(m for m in scene.meshes if not m.movable), stool], [GREY], lights=scene.lights)
    samples = dl.Samples.on_vertices(there, spacing=SPACING)
    with dl.Session(there, samples, paths=1000, gather=64) as session:
        session.bake()
        session.refine()
        assert_same_mesh(session.samples.display, moved.samples.display)


def test_dimmed_light_casts_no_edges(moved):
    moved.refine()
    own = moved.samples.display.detail
    with_sun = len(own)
    moved.dim("sun", 0.0)
    assert moved.refine() < with_sun / 2
    moved.dim("sun", 1.0)
    moved.refine()
    np.testing.assert_array_equal(moved.samples.display.detail, own)


@pytest.mark.parametrize("most", [60_000, 300])
def test_detail_can_be_taken_back(monkeypatch, most):
    """Also where vertices share samples."""
    monkeypatch.setattr("deltalux.samples.shared_samples.shared.__defaults__", (most,))
    plain = dl.Samples.on_vertices(lit_room(), spacing=SPACING).display
    detailed = dl.Samples.on_vertices(lit_room(), spacing=SPACING, detail="auto").display
    assert (plain.sharing is None) == (most == 60_000)
    assert len(detailed.points) > len(plain.points)
    assert_same_mesh(detailed.without_detail(), plain)
    assert plain.without_detail() is plain


def test_detail_lies_between_corners_that_are_always_there(moved):
    moved.refine()
    display = moved.samples.display
    corners, weights = display.detail_in_plain()
    assert len(corners) == len(display.detail) > 0
    assert not np.isin(corners, display.detail).any()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-12)
    assert weights.min() >= 0
    made = np.einsum("dc,dcx->dx", weights, display.points[corners])
    np.testing.assert_allclose(made, display.points[display.detail], atol=1e-12)
    none, _ = display.without_detail().detail_in_plain()
    assert none.shape == (0, 3)


def test_refinement_that_is_stopped_changes_nothing(moved, monkeypatch):
    moved.refine()
    monkeypatch.setattr("deltalux.session.places.ASKED_TOGETHER", 100)
    before, light = moved.samples.display, moved.vertex_irradiance
    heard = []
    moved.progress = lambda stage, _: heard.append(stage) or len(heard) < 5
    with pytest.raises(dl.Cancelled, match=r"refine: cancelled; the mesh is as it was"):
        moved.refine(0.02)
    moved.progress = None
    assert heard == ["refine shadows"] * 5
    assert moved.samples.display is before
    np.testing.assert_array_equal(moved.vertex_irradiance, light)
    moved.refine(before.detail_length)  # places are asked for a few at a time: the mesh is the same
    assert_same_mesh(moved.samples.display, before)


def test_pictures_do_not_depend_on_it(moved):
    moved.refine(0.2)
    before = render_session(moved, size=(48, 30), keep=False)
    moved.refine(0.05)
    after = render_session(moved, size=(48, 30), keep=False)
    np.testing.assert_array_equal(before.direct, after.direct)
    np.testing.assert_array_equal(before.indirect, after.indirect)


def test_files_keep_what_undoes_it(moved, tmp_path: Path):
    moved.refine()
    moved.save(tmp_path / "a.dlx")
    with dl.Session.open(tmp_path / "a.dlx") as opened:
        assert_same_mesh(opened.samples.display, moved.samples.display)
        opened.move("stool", place(-AWAY))
        opened.refine()
        moved.move("stool", place(-AWAY))
        moved.refine()
        assert_same_mesh(opened.samples.display, moved.samples.display)
    moved.move("stool", place(0.0))
    moved.update()


def test_sessions_that_cannot_be_refined_say_so():
    scene = lit_room()
    with dl.Session(scene, dl.Samples((1, 1, 1), (0, 1, 0)), paths=1000) as session:
        session.bake()
        with pytest.raises(dl.OptionError, match="refine: found other samples"):
            session.refine()
    samples = dl.Samples.on_vertices(scene, spacing=0.5)
    with dl.Session(scene, samples, paths=1000, gather="off") as session:
        session.bake()
        with pytest.raises(dl.OptionError, match='refine: found a session of gather="off"'):
            session.refine()
    with dl.Session(scene, samples, paths=1000, gather=16) as session:
        with pytest.raises(dl.OptionError, match="no light yet"):
            session.refine()
        session.bake()
        with pytest.raises(dl.OptionError, match="detail: found -1"):
            session.refine(-1)


SPOILED = {
    "a plain triangle at a detail": (
        "display/plain_triangles",
        lambda old, detail: np.full_like(old, detail),
    ),
    "a plain triangle beyond": ("display/plain_triangles", lambda old, detail: old + 10**6),
    "a part of none": ("display/plain_triangle", lambda old, detail: old + 10**6),
    "a triangle without parts": ("display/plain_triangle", lambda old, detail: np.zeros_like(old)),
    "no plain vertex": ("display/detail", lambda old, detail: np.zeros_like(old)),
}


@pytest.mark.parametrize("name", SPOILED)
def test_files_whose_refinement_cannot_be_undone_are_refused(moved, tmp_path: Path, name: str):
    moved.refine()
    moved.save(tmp_path / "a.dlx")
    index, arrays = read_parts(tmp_path / "a.dlx")
    array, spoiled = SPOILED[name]
    arrays[array] = spoiled(arrays[array], moved.samples.display.detail[0])
    write_parts(tmp_path / "b.dlx", index, arrays)
    with pytest.raises(dl.FormatError, match="display/"):
        dl.Session.open(tmp_path / "b.dlx")
