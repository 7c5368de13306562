# SPDX-License-Identifier: Apache-2.0
"""Half of the paths of a luminous sky are aimed: at what is lit through a window, not at the site."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import box, translation
from session_files import assert_refused, assert_threads_and_files_make_no_difference, number

SKY = 1000.0  # radiance
HALF = 100.0  # of the sky's box
WINDOW = (1.2, 0.9)  # metres


def room(*, block: bool = False) -> dl.Scene:
    """4 x 3 x 4 m of single sheets with a window in the wall z = 2, in the middle of a luminous box."""
    xs, ys = (
        np.array([low, -side / 2, side / 2, -low]) for low, side in zip((-2, -1.5), WINDOW, strict=True)
    )
    quads = [
        [(xs[i], ys[k], 2), (xs[i], ys[k + 1], 2), (xs[i + 1], ys[k + 1], 2), (xs[i + 1], ys[k], 2)]
        for i in range(3)
        for k in range(3)
        if (i, k) != (1, 1)
    ]
    walls, sides = box((4, 3, 4), inward=True)
    keep = ~np.isclose(walls[sides][:, :, 2], 2).all(axis=1)
    vertices = np.concatenate([walls, *quads])
    first = len(walls)
    triangles = [*sides[keep]]
    for k in range(first, len(vertices), 4):
        triangles += [(k, k + 1, k + 2), (k, k + 2, k + 3)]
    meshes = [
        dl.Mesh("walls", vertices, triangles, "grey"),
        dl.Mesh("sky", *box((2 * HALF,) * 3, inward=True), "sky"),
    ]
    if block:
        pose = translation(0.2, -1.1, 0.5)
        meshes.append(dl.Mesh("block", *box((0.4, 0.5, 0.4)), "grey", pose=pose, movable=True))
    materials = [dl.Material("grey", (0.5,) * 3), dl.Material("sky", (0, 0, 0), (SKY,) * 3)]
    return dl.Scene(meshes, materials, unit="lux")


INSIDE = np.array([(x, -1.499, z) for x in np.linspace(-1.8, 1.8, 12) for z in np.linspace(-1.8, 1.8, 12)])
SAMPLES = dl.Samples(INSIDE, np.tile((0.0, 1, 0), (len(INSIDE), 1)))


def entering(segments: dl.Segments) -> tuple[float, float]:
    """Power of first flights through the window, and their share of all first flights."""
    first = segments.bounce == 0
    origin, w = segments.origin[first], segments.direction[first]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (2 - origin[:, 2]) / w[:, 2]
        at = origin + w * t[:, None]
    through = (
        (w[:, 2] < 0)
        & (t > 0)
        & (t < segments.length[first])
        & (abs(at[:, :2]) < np.divide(WINDOW, 2)).all(1)
    )
    return float(segments.power[first, 0][through].sum()), float(through.mean())


def test_many_paths_enter_and_their_power_is_that_of_the_window():
    """Null hypothesis: unbiased. Twelve seeds' mean misses by three standard errors once in 80."""
    power, share = np.transpose([entering(dl.trace(room(), 20_000, seed=seed)) for seed in range(12)])
    expected = np.pi * SKY * np.prod(WINDOW)
    error = np.std(power, ddof=1) / np.sqrt(len(power))
    assert share.min() > 2e-3  # of paths that are not aimed: 2e-6
    assert error < 0.03 * expected
    assert abs(power.mean() - expected) < 3 * error


def test_no_path_carries_more_than_twice_the_mean():
    segments = dl.trace(room(), 20_000)
    power = segments.power[segments.bounce == 0, 0]
    assert 1.9 * power.mean() < power.max() < 2.1 * power.mean()


def test_a_luminous_ceiling_of_the_room_itself_is_not_aimed():
    """Its paths reach everything."""
    walls = dl.Mesh("walls", *box((4, 3, 4), inward=True), "grey")
    lamp = dl.Mesh(
        "lamp", [(-1.9, 1.49, -1.9), (1.9, 1.49, -1.9), (1.9, 1.49, 1.9), (-1.9, 1.49, 1.9)],
        [(0, 1, 2), (0, 2, 3)], "sky",
    )  # fmt: skip
    segments = dl.trace(dl.Scene([walls, lamp], room().materials, unit="lux"), 4000)
    power = segments.power[segments.bounce == 0, 0]
    assert power.min() == power.max()


@pytest.fixture(scope="module")
def session():
    scene = room(block=True)
    without_sky = [mesh for mesh in scene.meshes if mesh.name != "sky"]
    vertices = dl.Samples.on_vertices(dl.Scene(without_sky, scene.materials), spacing=0.8)
    samples = dl.Samples(vertices.points, vertices.normals, None, vertices.attached)
    with dl.Session(scene, samples, paths=4000, gather=16, threads=2) as session:
        session.bake()
        yield session


def moved(session: dl.Session, x: float) -> np.ndarray:
    session.move("block", translation(x, -1.1, 0.2))
    session.update()
    return session.irradiance


def test_updates_equal_recomputes(session: dl.Session):
    start, before = session.pose("block"), session.irradiance
    light, digest = moved(session, 0.5), session.digest()
    assert (light != before).any()
    session.recompute()
    assert session.digest() == digest
    np.testing.assert_array_equal(session.irradiance, light)
    session.move("block", start)
    session.update()
    np.testing.assert_array_equal(session.irradiance, before)


@pytest.mark.slow
def test_threads_and_files_make_no_difference(session: dl.Session, tmp_path):
    assert_threads_and_files_make_no_difference(
        session, tmp_path / "a.dlx", lambda own: moved(own, -0.4), paths=4000, gather=16
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (number("aim_targets", 0, np.nan), "not finite"),
        (number("aim_targets", 3, -1), "without size"),
        (number("aim_chances", 5, np.nan), "do not grow"),
        (number("aim_chances", 0, 0.5), "do not grow"),
        (number("aims", 0, 64, "<u4"), "more targets"),
        (number("aims", 0, 1, "<u4"), "aim_targets"),
        (number("aims", 0, 0, "<u4"), "aim_targets"),
    ],
)
def test_maps_that_no_bake_made_are_refused(session: dl.Session, tmp_path, change, said: str):
    assert_refused(session, tmp_path / "a.dlx", change, said)
