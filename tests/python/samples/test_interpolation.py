# SPDX-License-Identifier: Apache-2.0
"""Irradiance between samples: exact where it must be, hidden samples left out, old poses forgotten."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.samples.interpolation import Interpolator
from rooms import box, room, translation, turn

UP = np.array([0.0, 1, 0])


def everything(a, b):
    return np.ones(len(a), bool)


def plane(count=9, size=2.0):
    x, z = np.meshgrid(*[np.linspace(-size, size, count)] * 2)
    points = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    return points, np.tile(UP, (len(points), 1))


def test_a_point_on_a_sample_takes_its_value():
    points, normals = plane()
    values = np.random.default_rng(1).uniform(1, 2, (len(points), 3))
    found = Interpolator(points, normals)(points, normals, values, None, everything)
    np.testing.assert_allclose(found, values, rtol=1e-4)


def test_constants_are_kept_and_gradients_make_it_exact_for_linear_fields():
    points, normals = plane()
    slope = np.array([[0.3, 0, -0.2], [0.1, 0, 0.1], [0.0, 0, 0.25]])
    gradients = np.tile(slope, (len(points), 1, 1))
    values = 2 + points @ slope.T
    rng = np.random.default_rng(2)
    asked = rng.uniform((-2, 0, -2), (2, 0, 2), (200, 3))
    up = np.tile(UP, (200, 1))
    interpolator = Interpolator(points, normals)
    same = interpolator(asked, up, np.full_like(values, 7.0), None, everything)
    np.testing.assert_allclose(same, 7.0, rtol=1e-12)
    exact = 2 + asked @ slope.T
    np.testing.assert_allclose(interpolator(asked, up, values, gradients, everything), exact, rtol=1e-12)
    assert np.abs(interpolator(asked, up, values, None, everything) - exact).max() > 0.01


def test_weights_are_the_split_sphere_models():
    points, normals = plane()
    interpolator = Interpolator(points, normals)
    asked, towards = np.array([[0.1, 0, 0.2]]), np.array([[0.3, 1, 0.0]])
    towards /= np.linalg.norm(towards)
    index, weight = interpolator.weights(asked, towards, everything)
    distance = np.linalg.norm(asked - points[index[0]], axis=1)
    bound = distance / interpolator.reach[index[0]] + np.sqrt(1 - normals[index[0]] @ towards[0])
    np.testing.assert_allclose(weight[0], (1 / bound) / (1 / bound).sum(), rtol=1e-12)


def test_other_normals_and_samples_in_front_do_not_count():
    floor, up = plane()
    wall = floor[:, [0, 2, 1]] + np.array([0, 0.5, 0.1])
    above = floor + np.array([0.05, 0.4, 0])
    points = np.concatenate([floor, wall, above])
    normals = np.concatenate([up, np.tile((0, 0, -1.0), (len(wall), 1)), up])
    values = np.repeat([[1.0], [50.0], [90.0]], len(floor), axis=0) * np.ones(3)
    found = Interpolator(points, normals)(floor + np.array([0.1, 0, 0.1]), up, values, None, everything)
    np.testing.assert_allclose(found, 1.0)


def test_light_does_not_come_through_a_thin_wall():
    """Two rooms, one lit; every point takes samples of its own room only."""
    wall = [(0.0, 0, -1), (0, 2, -1), (0, 2, 1), (0, 0, 1)]
    scene = dl.Scene(
        [
            dl.Mesh("rooms", *box((4, 2, 2), (0, 1, 0), inward=True), "grey"),
            dl.Mesh("wall", wall, [(0, 1, 2), (0, 2, 3)], "grey"),
        ],
        [dl.Material("grey", (0.5, 0.5, 0.5))],
        [dl.PointLight("bulb", (-1, 1, 0), (10, 10, 10))],
    )
    x, z = np.meshgrid(np.linspace(-1.9, 1.9, 20), np.linspace(-0.9, 0.9, 10))
    points = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    with dl.Session(scene, dl.Samples(points, UP, radius=0.1), paths=20_000, gather="off") as session:
        session.bake()
        asked = np.array([(0.02, 0, 0.03), (0.04, 0, -0.5), (-0.02, 0, 0.03)])
        found = session.at(asked, np.tile(UP, (3, 1)))
        assert (found[:2] == 0).all()
        assert (found[2] > 1).all()


def test_samples_stand_at_the_poses_of_their_movables():
    at, normal = (0.1, 0.3, -0.05), (0.6, 0.0, 0.8)
    samples = dl.Samples([at] * 3, [normal] * 3, 0.1, ["block", None, "lamp"])
    with dl.Session(room(), samples, paths=1000, gather="off") as session:
        session.move("block", translation(-0.5, 0.5, 0.2) @ turn(np.pi / 2))  # (x, y, z) to (z, y, -x)
        points, normals = session.world()
    np.testing.assert_allclose(points, [(-0.55, 0.8, 0.1), at, (-0.9, 0.9, -0.55)], atol=1e-12)
    np.testing.assert_allclose(normals, [(0.8, 0, -0.6), normal, normal], atol=1e-12)


def test_it_follows_moved_and_removed_objects():
    scene = room()
    attached = dl.Samples([(x, 0.3, z) for x in (-0.2, 0, 0.2) for z in (-0.1, 0.1)], UP, 0.1, "block")
    floor = dl.Samples([(x, 0.0, z) for x in np.linspace(-1.8, 1.8, 9) for z in (-1, 0, 1.0)], UP, radius=0.2)
    with dl.Session(scene, dl.Samples.concatenate([floor, attached]), paths=20_000, gather="off") as session:
        session.bake()
        top = np.array([[0.7, 0.61, 0.4]])
        before = session.at(top, UP)
        np.testing.assert_allclose(before, session.irradiance[27:].mean(axis=0)[None], rtol=0.3)
        session.move("block", translation(-0.5, 0.5, 0.2))
        moved = session.at(np.array([[-0.5, 0.8, 0.2]]), UP)
        np.testing.assert_allclose(moved, session.irradiance[27:].mean(axis=0)[None], rtol=0.3)
        session.remove("block")
        _, weight = session._interpolation()[1].weights(top, UP[None], everything)
        assert len(session._interpolation()[0]) == len(floor)
        assert np.isfinite(session.at(top, UP, gradients=True)).all()
        assert weight.sum() == pytest.approx(1)


def test_wrong_input_is_refused():
    with dl.Session(room(), dl.Samples([(0, 0.3, 0)], UP, 0.1, "block"), paths=500, gather="off") as session:
        with pytest.raises(dl.OptionError, match="bake"):
            session.at([(0, 0, 0)], UP)
        session.bake()
        with pytest.raises(dl.OptionError, match="nan"):
            session.at([(0, np.nan, 0)], UP)
        with pytest.raises(dl.OptionError, match="zero"):
            session.at([(0, 0, 0)], (0, 0, 0))
        assert session.at(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0, 3)
        session.remove("block")
        with pytest.raises(dl.OptionError, match="no sample"):
            session.at([(0, 0, 0)], UP)
