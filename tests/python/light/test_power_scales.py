# SPDX-License-Identifier: Apache-2.0
"""Light is right whatever stands beside it: lamps on sunny sites of kilometres, lamps of far other power."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import box
from thoroughness import slow

LOW, HIGH = np.array((-2, 0.2, -1.5)), np.array((2, 2.9, 1.5))
SIZE = HIGH - LOW
AREA = 2 * (SIZE[0] * SIZE[1] + SIZE[1] * SIZE[2] + SIZE[2] * SIZE[0])


def faces(count: int, low=LOW, high=HIGH, seed: int = 1) -> dl.Samples:
    """About `count` points, by area, on the inner faces of a box."""
    size = np.subtract(high, low)
    rng, points, normals = np.random.default_rng(seed), [], []
    whole = 2 * sum(size[a] * size[b] for a, b in ((0, 1), (1, 2), (2, 0)))
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (low, high):
            own = rng.uniform(low, high, (round(count * size[u] * size[v] / whole), 3))
            own[:, axis] = end[axis]
            points.append(own)
            normals.append(np.tile(np.eye(3)[axis] * (1 if end is low else -1), (len(own), 1)))
    return dl.Samples(np.concatenate(points), np.concatenate(normals))


def grey(name: str, reflectance: float) -> dl.Material:
    return dl.Material(name, (reflectance,) * 3)


def land(half: float, y: float = 0.0, hole: float = 0.0) -> dl.Mesh:
    """Level ground of `half` metres to each side."""
    corners = [(-half, y, -half), (-half, y, half), (half, y, half), (half, y, -half)]
    return dl.Mesh("land", corners, [(0, 1, 2), (0, 2, 3)], "land")


def closed_room_on(half: float, lumens: float, sun: float) -> dl.Scene:
    meshes = [
        dl.Mesh("room", *box(SIZE, (LOW + HIGH) / 2, inward=True), "wall"),
        dl.Mesh("shell", *box(SIZE + 0.3, (LOW + HIGH) / 2), "land"),
    ]
    lights = [dl.PointLight("lamp", (0.3, 1.7, 0.2), (lumens / (4 * np.pi),) * 3, group="lamp")]
    if half:
        meshes.append(land(half))
        lights.append(dl.SunLight("sun", (0.3, -1, 0.2), (sun,) * 3, group="sun"))
    return dl.Scene(meshes, [grey("wall", 0.6), grey("land", 0.25)], lights, unit="lux")


def mean_and_error(session: dl.Session) -> tuple[float, float]:
    """Mean of the green channel, and a bound of its claimed error: as if errors were all alike."""
    return session.irradiance[:, 1].mean(), session.standard_error[:, 1].mean()


@pytest.mark.parametrize(
    ("half", "lumens", "sun"),
    [(0, 700, 0), slow(15, 700, 1e5), (300, 3, 1e5), slow(5000, 0.02, 1e5), (5000, 900, 4)],
)
def test_a_lamp_in_a_closed_room_on_a_sunny_site(half, lumens, sun):
    """Energy balance: the mean irradiance of a closed room is flux / (area (1 - reflectance))."""
    right = lumens / (AREA * (1 - 0.6))
    with dl.Session(closed_room_on(half, lumens, sun), faces(240), paths=20_000, gather=64) as session:
        session.bake()
        mean, error = mean_and_error(session)
        assert mean == pytest.approx(right, rel=0.015)
        assert abs(mean - right) < 3 * error
        if half:
            session.dim("sun", 0)
            session.update()
            assert mean_and_error(session)[0] == pytest.approx(mean, rel=1e-6)
            session.dim("lamp", 1e-6)
            session.update()
            assert mean_and_error(session)[0] == pytest.approx(1e-6 * mean, rel=1e-4)
            before = session.digest()
            session.recompute()
            assert session.digest() == before


@pytest.mark.parametrize(
    ("gather", "ratio"), [slow("off", 1e6), ("off", 1e12), slow(64, 1e6), (64, 1e12), (64, 1e-9)]
)
def test_two_rooms_whose_lamps_differ_by_far(gather, ratio):
    """Each room has the light of its own lamp, by discs and by a gather; energy adds up exactly."""
    shift = np.array((SIZE[0] + 1, 0, 0))
    meshes = [
        dl.Mesh(f"room{i}", *box(SIZE, (LOW + HIGH) / 2 + i * shift, inward=True), "wall") for i in range(2)
    ]
    lamps = [
        dl.PointLight(f"lamp{i}", tuple((LOW + HIGH) / 2 + i * shift), (ratio**i,) * 3) for i in range(2)
    ]
    scene = dl.Scene(meshes, [grey("wall", 0.5)], lamps, unit="lux")
    samples = [faces(200, LOW + i * shift, HIGH + i * shift) for i in range(2)]
    points, normals = (np.concatenate([getattr(s, name) for s in samples]) for name in ("points", "normals"))
    direct = "paths" if gather == "off" else "auto"
    with dl.Session(scene, dl.Samples(points, normals), paths=40_000, gather=gather, direct=direct) as s:
        s.bake()
        found, claimed = s.irradiance[:, 1].reshape(2, -1).mean(axis=1), s.standard_error[:, 1]
        energy = s.energy
    right = 4 * np.pi / (AREA * (1 - 0.5)) * np.array((1, ratio))
    # Discs darken corners, see the README's limits.
    np.testing.assert_allclose(found, right, rtol=0.015 if gather != "off" else 0.05)
    assert (claimed > 0).all()
    for emitted, absorbed, escaped in zip(
        energy["emitted"], energy["absorbed"], energy["escaped"], strict=True
    ):
        assert emitted == absorbed + escaped
        assert emitted * energy["quantum"] == pytest.approx(4 * np.pi * (1 + ratio), rel=1e-6)


@pytest.mark.parametrize("lumens", [1e-6, slow(5.0), 1e10])
@pytest.mark.parametrize("kind", ["bright", "dark"])
def test_lamps_that_are_added_have_quanta_of_their_own(kind, lumens):
    """Far fainter or brighter than all others, or the first in the dark: right alone once these are dim."""
    scene = closed_room_on(300 if kind == "bright" else 0, 700, 1e5)
    side, half = 0.2, np.array((0.0, 0.1, 0.0))
    corners = [(-side, 0, -side), (side, 0, -side), (side, 0, side), (-side, 0, side)]
    radiance = lumens / (np.pi * 4 * side * side)
    materials = [*scene.materials, dl.Material("glow", emission=(radiance,) * 3, group="added")]
    lights = scene.lights if kind == "bright" else []
    scene = dl.Scene(scene.meshes, materials, lights, unit="lux")
    with dl.Session(scene, faces(200), paths=20_000, gather=64) as session:
        session.bake()
        pose = np.eye(4)
        pose[:3, 3] = HIGH * (0.1, 1, 0.1) - half
        session.add(dl.Mesh("plate", corners, [(0, 1, 2), (0, 2, 3)], "glow", pose=pose, movable=True))
        for name in session.dim_factors:
            if name != "added":
                session.dim(name, 0)
        session.update()
        found = session.irradiance
        # The plate is black, so that it takes what light falls on it: on both faces.
        lit = AREA * (1 - 0.6) + 2 * 4 * side * side
        assert found[:, 1].mean() == pytest.approx(lumens / lit, rel=0.03)
        before = session.digest()
        session.recompute()
        assert session.digest() == before
        np.testing.assert_array_equal(session.irradiance, found)


def house(half: float) -> dl.Scene:
    """A room with a window towards the sun, in the middle of black land."""
    width, low, high = 0.7, 0.8, 1.9  # of the window, in the wall x = 2
    quads = [
        [(2, LOW[1], -1.5), (2, low, -1.5), (2, low, 1.5), (2, LOW[1], 1.5)],
        [(2, high, -1.5), (2, HIGH[1], -1.5), (2, HIGH[1], 1.5), (2, high, 1.5)],
        [(2, low, -1.5), (2, high, -1.5), (2, high, -width), (2, low, -width)],
        [(2, low, width), (2, high, width), (2, high, 1.5), (2, low, 1.5)],
    ]
    vertices, triangles = box(SIZE, (LOW + HIGH) / 2, inward=True)
    triangles = triangles[~(vertices[triangles][:, :, 0] > 1.9).all(axis=1)]
    count = len(vertices)
    vertices = np.concatenate([vertices, *map(np.array, quads)])
    more = [(count + 4 * i + a, count + 4 * i + b, count + 4 * i + c)
            for i in range(4) for a, b, c in ((0, 2, 1), (0, 3, 2))]  # fmt: skip
    meshes = [dl.Mesh("room", vertices, np.concatenate([triangles, more]), "wall")]
    if half:
        meshes.append(land(half))
    sun = dl.SunLight("sun", (-0.8, -0.6, 0), (1e5,) * 3)
    return dl.Scene(meshes, [grey("wall", 0.5), grey("land", 0.0)], [sun], unit="lux")


@pytest.mark.parametrize("half", [slow(45), slow(400), 5000])
def test_sun_through_a_window_does_not_depend_on_the_land_around(half):
    """The room alone is the reference, with its own claimed error."""
    samples = faces(300)
    shade = samples.points[:, 0] < 1.999  # not on the wall of the window, of which a part is open
    samples = dl.Samples(samples.points[shade], samples.normals[shade])
    light = []
    for own in (0, half):
        with dl.Session(house(own), samples, paths=60_000, gather=128) as session:
            session.bake()
            indirect = session.at(samples.points, samples.normals, part="indirect")[:, 1]
            light.append((indirect, session.standard_error[:, 1]))
    (alone, error), (found, other) = light
    assert found.mean() == pytest.approx(alone.mean(), rel=0.03)
    assert np.median(other) < 2 * np.median(error)
    assert np.mean(np.abs(found - alone) > 5 * np.hypot(error, other)) < 0.02


@pytest.mark.parametrize("reflectance", [slow(0.95), 0.99])
def test_white_rooms_have_all_their_light(reflectance):
    """With a cap of 64 segments, a tenth and half of it were missing."""
    scene = closed_room_on(0, 100, 0)
    white = dl.Scene(scene.meshes, [grey("wall", reflectance), grey("land", 0)], scene.lights, unit="lux")
    with dl.Session(white, faces(100), paths=20_000, gather=64) as session:
        session.bake()
        right = 100 / (AREA * (1 - reflectance))
        assert session.irradiance[:, 1].mean() == pytest.approx(right, rel=0.01)


@pytest.mark.parametrize(("reflectance", "bounces"), [(0.5, 3), (0.9, 8), (0.8, 1), slow(0.999, 400)])
def test_light_of_paths_that_are_cut_is_in_the_claimed_error(reflectance, bounces):
    scene = closed_room_on(0, 100, 0)
    cut = dl.Scene(scene.meshes, [grey("wall", reflectance), grey("land", 0)], scene.lights, unit="lux")
    with dl.Session(cut, faces(100), paths=20_000, gather=128, max_bounces=bounces) as session:
        session.bake()
        right = 100 / (AREA * (1 - reflectance))
        mean, error = mean_and_error(session)
        assert right - mean > 0.03 * right
        # Chains of gather rays bring some of what paths lack, and the claim contains noise.
        assert 0.9 < error / (right - mean) < 1.6
