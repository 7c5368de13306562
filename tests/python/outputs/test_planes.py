# SPDX-License-Identifier: Apache-2.0
"""Working planes: what lies inside of solids or near walls, grids with holes, plans with axes and values."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux import outputs
from deltalux.errors import FormatError, OptionError
from deltalux.outputs.plans import Axis, grid_picture, plan_axes
from deltalux.solid_places import inside_solids, near_walls
from session_files import rewrite


def shell(low, high, inward: bool) -> tuple[np.ndarray, np.ndarray]:
    """The six faces of a box, their fronts inside or outside."""
    low, high = np.array(low, float), np.array(high, float)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    return low + corners * (high - low), triangles[:, ::-1] if inward else triangles


def room(inward: bool = True, lamp: bool = True) -> dl.Scene:
    """Four by three metres with a cupboard on the floor and a movable one, single sheets all of them."""
    parts = {
        "walls": (*shell((0, 0, 0), (4, 2.5, 3), inward), False),
        "cupboard": (*shell((1, 0, 1), (2, 1, 2), False), False),
        "chest": (*shell((3, 0, 0), (3.5, 1, 0.5), False), True),
    }
    return dl.Scene(
        [dl.Mesh(name, v, t, material="grey", movable=m) for name, (v, t, m) in parts.items()],
        [dl.Material("grey")],
        [dl.PointLight("lamp", (2.6, 2.2, 2.5), (100, 100, 100))] if lamp else [],
    )


POINTS = np.array(
    [(0.5, 0.8, 0.5), (1.5, 0.8, 1.5), (1.05, 0.98, 1.05), (3.2, 0.5, 0.2), (1.5, 1.1, 1.5), (4.5, 0.8, 1.5)]
)
INSIDE = [False, True, True, True, False, True]  # the last one is behind the wall


@pytest.mark.parametrize("inward", [True, False])
@pytest.mark.parametrize("far", [0.0, 1e5])
def test_what_no_light_reaches_is_inside(inward: bool, far: float) -> None:
    """Whichever way a room is wound, and wherever it stands."""
    scene = room(inward)
    meshes = [
        dl.Mesh(m.name, m.vertices + far, m.triangles, m.material, movable=m.movable) for m in scene.meshes
    ]
    lamp = dl.PointLight("lamp", scene.lights[0].position + far, (100, 100, 100))
    moved = dl.Scene(meshes, scene.materials, [lamp])
    assert inside_solids(moved, POINTS + far).tolist() == INSIDE


def test_nothing_is_inside_in_the_dark_or_in_the_open() -> None:
    assert not inside_solids(room(lamp=False), POINTS).any()
    floor = dl.Mesh(
        "floor", [(0, 0, 0), (0, 0, 9), (9, 0, 9), (9, 0, 0)], [(0, 1, 2), (0, 2, 3)], material="grey"
    )
    lamp = dl.PointLight("lamp", (4, 3, 4), (100, 100, 100))
    open_air = dl.Scene([floor], [dl.Material("grey")], [lamp])
    points = np.array([(1, 0.8, 1), (4, 0.8, 4), (20, 1, 20)])
    assert not inside_solids(open_air, points).any()


def test_margins_are_horizontal_and_at_the_height_of_the_points() -> None:
    points = np.array([(0.4, 0.8, 1.5), (1.5, 0.8, 0.6), (2.6, 0.8, 1.5), (1.5, 1.1, 1.5), (1.5, 0.1, 2.45)])
    assert near_walls(room(), points, 0.5).tolist() == [True, True, False, False, True]


def grid() -> dl.Samples:
    """Three rows of four cells, of which two are left out."""
    whole = dl.Samples.on_grid((1, 0.8, 2), (2, 0, 0), (0, 0, 1.5), 0.5)
    return whole.without(np.isin(np.arange(12), (1, 6)))


def test_a_grid_keeps_its_shape_around_holes() -> None:
    samples = grid()
    assert samples.grid_shape == (3, 4)
    assert samples.grid_cells.tolist() == [0, 2, 3, 4, 5, 7, 8, 9, 10, 11]
    values = samples.in_grid(samples.points[:, 0])
    assert np.argwhere(np.isnan(values)).tolist() == [[0, 1], [1, 2]]
    np.testing.assert_allclose(values[2], [1.25, 1.75, 2.25, 2.75])
    again = samples.without(np.arange(10) == 0)
    assert again.grid_cells.tolist() == samples.grid_cells.tolist()[1:]
    np.testing.assert_allclose(samples.areas, 0.25)
    whole = dl.Samples.on_grid((1, 0.8, 2), (2, 0, 0), (0, 0, 1.5), 0.5).without(np.zeros(12, bool))
    assert whole.grid_cells is None
    with pytest.raises(OptionError, match=r"expected those of Samples\.on_grid"):
        dl.Samples([(0, 0, 0)], (0, 1, 0)).in_grid([1.0])
    with pytest.raises(OptionError, match="expected a grid or samples from arrays"):
        dl.Samples.on_vertices(room()).without(np.zeros(3, bool))


def test_a_session_file_keeps_the_holes(tmp_path) -> None:
    path = tmp_path / "a.dlx"
    with dl.Session(room(), grid(), paths=500) as session:
        session.bake()
        session.save(path)
        light = session.irradiance
    with dl.Session.open(path) as session:
        assert session.samples.grid_cells.tolist() == grid().grid_cells.tolist()
        np.testing.assert_array_equal(session.irradiance, light)
    for cells, message in (([0] * 10, "cells that do not rise"), ([*range(9), 12], "grid_cells")):
        rewrite(
            path, arrays=lambda arrays, c=cells: arrays.update({"samples/grid_cells": np.array(c, np.int64)})
        )
        with pytest.raises(FormatError, match=message):
            dl.Session.open(path)


def test_axes_are_those_of_the_world_where_the_grid_is_aligned() -> None:
    along, down = plan_axes(grid())
    assert (along.name, down.name) == ("X", "Z")
    np.testing.assert_allclose((along.first, along.step, down.first, down.step), (1.25, 0.5, 2.25, 0.5))
    tilted = dl.Samples.on_grid((0, 0, 0), (3, 0, 4), (0, 2, 0), 1.0)
    along, down = plan_axes(tilted)
    assert (along.name, down.name) == ("", "Y")
    assert along.step == pytest.approx(1.0)
    row = dl.Samples.on_grid((0, 0, 0), (3, 0, 0), (0, 0, 0.5), 1.0)
    assert plan_axes(row)[1].step == pytest.approx(0, abs=1e-9)


def test_a_plan_has_holes_axes_and_values() -> None:
    values = np.full((6, 8), 500.0)
    values[2, 3] = np.nan
    axes = (Axis("X", 0.25, 0.5), Axis("Z", 0.25, 0.5))
    bare = grid_picture(values, "lux", longest=400)
    plan = grid_picture(values, "lux", longest=400, axes=axes)
    assert plan.pixels.shape[0] > bare.pixels.shape[0]  # a margin below and above
    assert plan.pixels.shape[1] > bare.pixels.shape[1] + 20
    shown = [
        grid_picture(
            np.full((6, 8), value), "lux", scale=plan.scale, isolux=False, longest=400, axes=axes
        ).pixels
        for value in (444.0, 444.2, 447.0)
    ]
    changed = [(np.abs(shown[0].astype(int) - other) > 60).any(axis=2).sum() for other in shown[1:]]
    assert changed[0] == 0  # three digits are shown
    assert changed[1] > 48  # and differ in each of the 48 cells
    shifted = grid_picture(values, "lux", longest=400, axes=(Axis("X", 7.25, 0.5), axes[1]))
    assert plan.pixels.tobytes() != shifted.pixels.tobytes()
    assert outputs.grid_picture is grid_picture


def test_holes_do_not_darken_their_neighbours() -> None:
    values = np.full((5, 5), 100.0)
    values[2, 2] = np.nan
    whole, holed = (
        grid_picture(v, "lux", longest=100, isolux=False) for v in (np.full((5, 5), 100.0), values)
    )
    same = (whole.pixels == holed.pixels).all(axis=2)
    assert (~same[:, :100]).sum() == 20 * 20
