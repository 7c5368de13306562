# SPDX-License-Identifier: Apache-2.0
"""A sun's paths go where they bring light: through a hole in the ceiling, not onto the roof."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import box, translation
from session_files import assert_refused, assert_threads_and_files_make_no_difference, number

SUN = 1e5  # lux
DOWN = np.array([-0.5, -1.0, -0.2]) / np.linalg.norm((-0.5, -1.0, -0.2))
HOLE = (0.6, 0.3)  # x and z of its middle
BULB = (-1.0, 2.5, -1.0)


def room(side: float, *, block: bool = False) -> dl.Scene:
    """4 x 3 x 4 m of single sheets, a square hole in the ceiling, a sun and a weak bulb."""
    xs, zs = (np.array([-2, middle - side / 2, middle + side / 2, 2]) for middle in HOLE)
    quads = [
        [(xs[i], 3, zs[k]), (xs[i + 1], 3, zs[k]), (xs[i + 1], 3, zs[k + 1]), (xs[i], 3, zs[k + 1])]
        for i in range(3)
        for k in range(3)
        if (i, k) != (1, 1)
    ]
    quads += [
        [(-2, 0, -2), (-2, 0, 2), (2, 0, 2), (2, 0, -2)],
        [(-2, 0, -2), (2, 0, -2), (2, 3, -2), (-2, 3, -2)],
        [(-2, 0, 2), (-2, 3, 2), (2, 3, 2), (2, 0, 2)],
        [(-2, 0, -2), (-2, 3, -2), (-2, 3, 2), (-2, 0, 2)],
        [(2, 0, -2), (2, 0, 2), (2, 3, 2), (2, 3, -2)],
    ]
    triangles = [t for k in range(0, 4 * len(quads), 4) for t in ((k, k + 1, k + 2), (k, k + 2, k + 3))]
    meshes = [dl.Mesh("walls", np.concatenate(quads), triangles, "grey")]
    if block:
        pose = translation(0.2, 0.4, 0.5)
        meshes.append(dl.Mesh("block", *box((0.4, 0.5, 0.4)), "grey", pose=pose, movable=True))
    return dl.Scene(
        meshes,
        [dl.Material("grey", (0.5, 0.5, 0.5))],
        [dl.PointLight("bulb", BULB, (20,) * 3), dl.SunLight("sun", DOWN, (SUN,) * 3)],
        unit="lux",
    )


def sun_flights(segments: dl.Segments) -> tuple[np.ndarray, np.ndarray]:
    """Power of the sun's first flights (k,), and which end on the floor."""
    first = (segments.bounce == 0) & (np.abs(segments.origin - BULB).max(axis=1) > 1e-3)
    end = segments.origin + segments.direction * segments.length[:, None]
    floor = (np.abs(end[:, 1]) < 0.01) & (np.abs(end[:, (0, 2)]) < 1.99).all(axis=1)
    return segments.power[first, 0], floor[first]


def test_many_paths_enter_and_their_power_is_that_of_the_hole():
    """Null hypothesis: unbiased. Twelve seeds' mean misses by three standard errors once in 80."""
    side, entered = 0.2, []
    for seed in range(12):
        power, floor = sun_flights(dl.trace(room(side), 20_000, seed=seed))
        assert floor.sum() > 0.3 * len(power)  # evenly: two in a thousand
        entered.append(power[floor].sum())
    expected = SUN * side**2 * -DOWN[1]
    error = np.std(entered, ddof=1) / np.sqrt(len(entered))
    assert error < 0.01 * expected
    assert abs(np.mean(entered) - expected) < 3 * error + 1e-3 * expected  # the floor's rim is left out


def test_no_path_carries_more_than_four_times_the_mean():
    power, _ = sun_flights(dl.trace(room(0.2), 20_000))
    assert 3.9 * power.mean() < power.max() < 4.1 * power.mean()
    assert power.max() > 100 * power.min()


def test_a_lawn_gets_even_paths_and_a_stone_on_it_more():
    """A lawn alone lights nothing; beside a stone it does. Weights make up for the densities."""
    lawn = dl.Mesh(
        "lawn", [(-20, 0, -20), (20, 0, -20), (20, 0, 20), (-20, 0, 20)], [(0, 2, 1), (0, 3, 2)], "g"
    )
    stone = dl.Mesh("stone", *box((1, 1, 1), (2, 0.5, 3)), "g")

    def flights(*meshes):
        scene = dl.Scene(
            meshes, [dl.Material("g", (0.5,) * 3)], [dl.SunLight("s", DOWN, (SUN,) * 3)], unit="lux"
        )
        segments = dl.trace(scene, 5000)
        first = segments.bounce == 0
        ends = segments.origin[first] + segments.direction[first] * segments.length[first, None]
        return segments.power[first, 0] * (segments.primitive[first] != 0xFFFFFFFF), ends

    power, _ = flights(lawn)
    assert power[power > 0].min() == power.max()
    power, ends = flights(lawn, stone)
    assert np.mean(np.hypot(ends[:, 0] - 2, ends[:, 2] - 3) < 3) > 0.4  # evenly: 0.02
    # Null hypothesis: unbiased. A batch is independent, eight of them: Student's t.
    arrived = power.reshape(8, -1).sum(axis=1) * 8
    on_ground = SUN * 1600 * -DOWN[1]
    assert abs(arrived.mean() - on_ground) < 5 * arrived.std(ddof=1) / np.sqrt(8)


@pytest.mark.slow
@pytest.mark.parametrize("side", [0.06, 0.2])
def test_light_by_a_patch_of_sun_is_not_noisy(side: float):
    """RMS of three seeds: 2 to 3 % and 2 %; with even paths 20 to 25 and 21 %."""
    rng = np.random.default_rng(3)
    y, x = rng.uniform(0.1, 2.9, 200), rng.uniform(-1.9, 1.9, 200)
    points = np.concatenate([np.c_[x, y, np.full(200, -1.999)], np.c_[np.full(200, 1.999), y, x]])
    normals = np.repeat([(0, 0, 1.0), (-1.0, 0, 0)], 200, axis=0)

    def light(rays: int, seed: int, paths: int) -> np.ndarray:
        with dl.Session(
            room(side), dl.Samples(points, normals), paths=paths, gather=rays, seed=seed
        ) as session:
            session.bake()
            return session.irradiance[:, 0]

    expected = light(4096, 100, 1_000_000)
    found = [np.sqrt(np.mean((light(128, seed, 200_000) / expected - 1) ** 2)) for seed in (1, 2, 3)]
    assert np.median(found) < 0.05


@pytest.fixture(scope="module")
def session():
    scene = room(0.3, block=True)
    samples = dl.Samples.on_vertices(scene, spacing=0.8)
    with dl.Session(scene, samples, paths=4000, gather=16, threads=2) as session:
        session.bake()
        yield session


def moved(session: dl.Session, x: float) -> str:
    session.move("block", translation(x, 0.4, 0.2))
    session.update()
    return session.digest()


def test_updates_equal_recomputes(session: dl.Session):
    before = session.digest()
    start = session.pose("block")
    digest = moved(session, 0.5)
    assert digest != before
    session.recompute()
    assert session.digest() == digest
    session.dim("sun", 0.3)
    session.set_reflectance("grey", (0.6, 0.4, 0.5))
    session.update()
    digest = session.digest()
    session.recompute()
    assert session.digest() == digest
    session.dim("sun", 1)
    session.set_reflectance("grey", (0.5, 0.5, 0.5))
    session.move("block", start)
    session.update()
    assert session.digest() == before


def test_threads_and_files_make_no_difference(session: dl.Session, tmp_path):
    assert_threads_and_files_make_no_difference(
        session, tmp_path / "a.dlx", lambda own: moved(own, -0.4), paths=4000, gather=16
    )


def leaves(index: int, field: int, value: float):
    return number("sun_maps", 4 * index + field, value)


def count(light: int, value: int):
    return number("sun_map_leaves", light, value, "<u4")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (leaves(0, 0, np.nan), "beyond its rectangle"),
        (leaves(0, 2, 2.0), "beyond its rectangle"),
        (leaves(1, 3, -1.0), "do not grow"),
        (leaves(0, 3, 0.5), "do not grow"),
        (leaves(-1, 3, 1.0), "do not grow"),
        (leaves(0, 2, 1e-3), "do not fill|hardly any"),
        (count(0, 1), "no sun"),
        (count(1, 2**31), "sun_maps"),
        (count(1, 0), "sun_maps"),
    ],
)
def test_maps_that_no_bake_made_are_refused(session: dl.Session, tmp_path, change, said: str):
    assert_refused(session, tmp_path / "a.dlx", change, said)
