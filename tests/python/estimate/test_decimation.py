# SPDX-License-Identifier: Apache-2.0
"""Decimation of lit meshes: the tolerance holds, the shape stays, flat irradiance collapses."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.mesh.display_mesh import refine
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes_for_tests import furnace
from thoroughness import examples


def grid(cells, jitter=0.0, seed=0):
    """A unit square in the plane y = 0 as triangles."""
    side = np.linspace(0, 1, cells + 1)
    x, z = (a.ravel() for a in np.meshgrid(side, side))
    inside = (x > 0) & (x < 1) & (z > 0) & (z < 1)
    move = np.random.default_rng(seed).uniform(-jitter, jitter, (len(x), 2)) / cells * inside[:, None]
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    triangles = np.concatenate([
        np.stack([a, a + cells + 1, a + 1], axis=1),
        np.stack([a + 1, a + cells + 1, a + cells + 2], axis=1),
    ])  # fmt: skip
    return np.stack([x + move[:, 0], 0 * x, z + move[:, 1]], axis=1), triangles


def area(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2


def interpolated(points, triangles, values, at):
    """Values at points of the plane y = 0, by a search of all triangles."""
    a, b, c = (points[triangles[:, k]][:, ::2] for k in range(3))
    e, f = b - a, c - a
    whole = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]
    found = []
    for p in at[:, ::2]:
        q = p - a
        v = (q[:, 0] * f[:, 1] - q[:, 1] * f[:, 0]) / whole
        w = (e[:, 0] * q[:, 1] - e[:, 1] * q[:, 0]) / whole
        best = np.argmax(np.minimum(np.minimum(v, w), 1 - v - w))
        weights = np.array([1 - v[best] - w[best], v[best], w[best]])
        assert weights.min() > -1e-6
        found.append(weights @ values[triangles[best]])
    return np.array(found)


@settings(max_examples=examples(40))
@given(
    seed=st.integers(0, 1000),
    jitter=st.sampled_from([0.0, 0.2]),
    tolerance=st.sampled_from([0.0, 0.01, 0.1, 1.0, 10.0]),
)
def test_the_tolerance_holds_and_the_square_stays(seed, jitter, tolerance):
    points, triangles = grid(10, jitter, seed)
    rng = np.random.default_rng(seed)
    smooth = np.sin(3 * points[:, 0] + rng.uniform(0, 6)) + np.cos(4 * points[:, 2])
    values = np.stack([smooth, smooth**2, rng.normal(0, 0.05, len(points))], axis=1)
    kept, left = dl.estimate.decimate(points, triangles, values, tolerance)
    assert (np.diff(kept) > 0).all()
    up = area(points[kept], left)[:, 1]
    assert (up * area(points, triangles)[0, 1] > 0).all()  # nothing is turned over
    np.testing.assert_allclose(np.abs(up).sum(), 1, rtol=1e-9)
    error = np.abs(interpolated(points[kept], left, values[kept], points) - values)
    assert error.max() <= tolerance + 1e-9
    if tolerance == 10:
        assert 40 <= len(kept) <= 44  # the border, and a vertex in its corners
    if tolerance == 0 and jitter:
        assert len(kept) == len(points)


def test_linear_irradiance_needs_the_border_only():
    points, triangles = grid(20, 0.2)
    kept, left = dl.estimate.decimate(points, triangles, 1 + points[:, 0] - 2 * points[:, 2], 1e-9)
    assert 80 <= len(kept) <= 84
    assert len(left) == 2 * len(kept) - 80 - 2


def test_the_shape_of_a_room_stays():
    scene, _ = furnace()
    mesh = refine(scene, 0.25)
    kept, left = dl.estimate.decimate(mesh.points, mesh.triangles, np.ones(len(mesh.points)), 0.1)
    assert len(kept) < 0.6 * len(mesh.points)
    new, old = area(mesh.points[kept], left), area(mesh.points, mesh.triangles)
    np.testing.assert_allclose(np.linalg.norm(new, axis=1).sum(), np.linalg.norm(old, axis=1).sum())
    np.testing.assert_allclose(np.abs(new).sum(axis=0), np.abs(old).sum(axis=0))
    edges = (abs(abs(mesh.points) - 1) < 1e-9).sum(axis=1) >= 2
    assert edges[kept].sum() == edges.sum()


def test_nothing_and_vertices_without_triangles():
    none = np.zeros((0, 3))
    kept, left = dl.estimate.decimate(none, none.astype(int), np.zeros(0), 1.0)
    assert kept.shape == (0,)
    assert left.shape == (0, 3)
    kept, left = dl.estimate.decimate(np.eye(3), none.astype(int), np.zeros(3), 1.0)
    np.testing.assert_array_equal(kept, [0, 1, 2])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tolerance": -1.0}, "tolerance: found -1.0"),
        ({"tolerance": np.nan}, "tolerance: found nan"),
        ({"irradiance": np.zeros(3)}, "one row for each point"),
        ({"triangles": [(0, 1, 99)]}, "found vertex 99"),
        ({"triangles": [(0.0, 1.0, 2.0)]}, "expected \\(m, 3\\) integers"),
        ({"irradiance": np.full(9, np.nan)}, "not finite"),
    ],
)
def test_wrong_input_is_refused(change, words):
    points, triangles = grid(2)
    good = {"points": points, "triangles": triangles, "irradiance": np.zeros(9), "tolerance": 0.1}
    with pytest.raises(dl.OptionError, match=words):
        dl.estimate.decimate(**{**good, **change})


def test_a_callback_stops_it():
    points, triangles = grid(20)
    with pytest.raises(dl.Cancelled):
        dl.estimate.decimate(points, triangles, points[:, 0], 0.1, progress=lambda stage, share: False)
