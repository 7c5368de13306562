# SPDX-License-Identifier: Apache-2.0
"""A room in a landscape, far from zero or of another scale is lit as the room alone."""

from __future__ import annotations

import functools

import deltalux as dl
import numpy as np
import pytest
from deltalux.mesh.surfaces import Surfaces
from deltalux.scene import frame, make_movable
from rooms import box, room, translation
from thoroughness import all_but_slow, slow

X, Z = np.meshgrid((-1.5, -0.5, 0.5, 1.5), (-1.0, 0.0, 1.0))
POINTS = np.concatenate(
    [
        np.stack([X.ravel(), 0 * X.ravel(), Z.ravel()], axis=1),
        [(x, 1.0, -1.5) for x in (-1, 0, 1)],
        [(x, 2.0, 0.8) for x in (-1, 1)],
    ]
)
NORMALS = [(0, 1, 0)] * 12 + [(0, 0, 1)] * 3 + [(0, -1, 0)] * 2
PATHS, SEEDS = 100_000, (1, 2, 3, 4)


def with_lawn(half: float) -> dl.Scene:
    scene = room()
    corners = [(-half, -1, -half), (half, -1, -half), (half, -1, half), (-half, -1, half)]
    lawn = dl.Mesh("lawn", corners, [(0, 2, 1), (0, 3, 2)], "wall")
    return dl.Scene([*scene.meshes, lawn], scene.materials, scene.lights)


def under_sky(half: float) -> dl.Scene:
    """The room within a hull, within a luminous black sky: most triangles see the sky."""
    scene = room()
    hull = dl.Mesh("hull", *box((4.2, 2.2, 3.2), (0, 1, 0)), "wall")
    houses = [dl.Mesh(f"house {i}", *box((8, 6, 8), (x, 2, 30)), "wall") for i, x in enumerate((-20, 0, 20))]
    sky = dl.Mesh("sky", *box((2 * half, 2 * half, 2 * half), inward=True), "sky")
    glow = dl.Material("sky", (0, 0, 0), (1e-3, 1e-3, 1e-3))
    return dl.Scene([*scene.meshes, hull, *houses, sky], [*scene.materials, glow], scene.lights)


def moved(offset: np.ndarray) -> dl.Scene:
    """The room with its static vertices, and one movable's, given far from zero."""
    scene = room()
    meshes = []
    for m in scene.meshes:
        if m.movable and m.name == "block":  # its own space is far from zero, as of exported files
            meshes.append(dl.Mesh(m.name, m.world_vertices + offset, m.triangles, m.material, movable=True))
        elif m.movable:
            pose = translation(*offset) @ m.pose
            index = m.material_index
            meshes.append(dl.Mesh(m.name, m.vertices, m.triangles, m.material, index, pose, movable=True))
        else:
            meshes.append(dl.Mesh(m.name, m.vertices + offset, m.triangles, m.material))
    return dl.Scene(meshes, scene.materials, scene.lights)


def light(scene: dl.Scene, offset=(0, 0, 0), radius=None, direct="auto", gather="off") -> np.ndarray:
    """(seeds, points): of several seeds, since the spread of one says little."""
    samples = dl.Samples(POINTS + offset, NORMALS, radius=radius)
    found = []
    for seed in SEEDS:
        with dl.Session(scene, samples, paths=PATHS, direct=direct, seed=seed, gather=gather) as session:
            session.bake()
            if not any(mesh.name == "sky" for mesh in scene.meshes):  # the room is closed
                assert (np.asarray(session.energy["escaped"]) == 0).all()
            found.append(session.irradiance[:, 1])
    return np.stack(found)


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    """The room alone, small discs and many paths; its own error is below 1.5 % RMS."""
    samples = dl.Samples(POINTS, NORMALS, radius=0.1)
    with dl.Session(room(), samples, paths=2_000_000, gather="off") as session:
        session.bake()
        return session.irradiance[:, 1]


@functools.cache
def alone(direct: str = "auto", gather: str = "off") -> np.ndarray:
    return light(room(), direct=direct, gather=gather)


def rms(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.mean((found / truth - 1) ** 2)))


@pytest.mark.parametrize("direct", ["auto", "paths"])
@pytest.mark.parametrize("half", all_but_slow([10, 30, 100, 300, 1000, 20_000], 30, 20_000))
def test_a_lawn_around_the_house_changes_nothing(half, direct, truth):
    assert rms(light(with_lawn(half), direct=direct), truth) <= 1.2 * rms(alone(direct), truth) + 0.001


@pytest.mark.parametrize("half", [slow(30), 300, slow(2000)])
def test_a_lawn_changes_nothing_to_who_looks_around(half, truth):
    """Null hypothesis: 68 errors of equal spread each; their RMS' ratio is beyond 1.45 in 0.2 %."""
    found = light(with_lawn(half), gather="auto")
    assert rms(found, truth) <= 1.45 * rms(alone(gather="auto"), truth)


@pytest.mark.parametrize("gather", ["off", slow("auto")])
def test_cells_and_discs_of_a_room_do_not_grow_with_the_sky_around_it(gather, truth):
    """Null hypothesis as above; paths that light the houses are missing inside, twice at most."""
    found = light(under_sky(3000), gather=gather)
    assert rms(found, truth) <= 1.45 * np.sqrt(2) * rms(alone(gather=gather), truth)


@pytest.mark.parametrize("away", all_but_slow([1e3, 1e4, 1e5, 1e7], 1e5))
def test_far_from_zero_is_as_at_zero(away, truth):
    offset = np.array([away, 0.25 * away, -away])
    assert rms(light(moved(offset), offset), truth) <= 1.2 * rms(alone(), truth) + 0.001


@pytest.mark.parametrize("away", [slow(1e3), 1e5])
def test_updates_far_from_zero_equal_a_recompute(away, tmp_path):
    offset = np.array([away, 0, -away])
    scene = moved(offset)
    samples = dl.Samples.on_vertices(scene, spacing=0.5)
    with dl.Session(scene, samples, paths=5000, gather=64) as session:
        session.bake()
        pose = session.pose("block")
        np.testing.assert_array_equal(pose, np.eye(4))
        session.move("block", translation(-1.2, 0.2, -0.8))
        session.update()
        session.add(
            dl.Mesh(
                "stool",
                *box((0.3, 0.3, 0.3)),
                "paint",
                pose=translation(*np.add(offset, (0, 0.2, 1))),
                movable=True,
            )
        )
        session.update()
        digest, values = session.digest(), session.irradiance
        session.recompute()
        assert session.digest() == digest
        assert np.isfinite(values).all()
        middle = np.add(offset, (0.2, 0.8, 0.1))
        assert np.isfinite(session.at([middle], [(0, 1, 0)])).all()
        session.save(tmp_path / "far.dlx")
        with dl.Session.open(tmp_path / "far.dlx") as opened:
            assert opened.digest() == digest
            np.testing.assert_array_equal(opened.irradiance, values)
            for name in session.poses:
                np.testing.assert_allclose(opened.pose(name), session.pose(name), rtol=0, atol=1e-9)


@pytest.mark.parametrize("away", [0.0, 1e6])
def test_traced_segments_are_those_of_the_session(away):
    """Disc sums over `dl.trace` equal those of a session, far from zero as well."""
    offset = np.array([away, 0, away])
    scene = moved(offset)
    samples = dl.Samples(POINTS + offset, NORMALS, radius=0.15)
    segments = dl.trace(scene, paths=20_000)
    inside = np.abs(segments.origin - offset).max() < 3
    assert inside
    traced = dl.estimate.disc_index(segments, samples)
    with dl.Session(scene, samples, paths=20_000, direct="paths", disc_area="whole") as session:
        session.bake()
        assert rms(traced.irradiance[:12, 1], session.irradiance[:12, 1]) < 0.05
    np.testing.assert_array_equal(traced.sums, dl.estimate.sphere_cache(segments, samples).sums)
    np.testing.assert_array_equal(traced.sums, dl.estimate.brute_force(segments, samples).sums)


def test_what_single_precision_cannot_hold_is_told_or_refused():
    scene = room()
    coarse = dl.Mesh("bench", *box((1, 0.5, 0.5), (8000, 0, 0)), "wall")
    with_bench = dl.Scene([*scene.meshes, coarse], scene.materials, scene.lights)
    assert any('mesh "bench"' in text and "single precision" in text for text in with_bench.warnings)
    assert not scene.warnings
    with pytest.raises(dl.SceneError, match=r'mesh "shed": it lies .* m from the middle .* split it'):
        far = dl.Mesh("shed", *box((2, 2, 2), (1e7, 0, 0)), "wall")
        dl.trace(dl.Scene([*scene.meshes, far], scene.materials, scene.lights), paths=10)
    stool = dl.Mesh("stool", *box((0.3, 0.3, 0.3)), "wall", pose=translation(0, 1, 0), movable=True)
    gate = dl.Mesh("gate", *box((1, 1, 1), (2e6, 0, 0)), "wall", movable=True, pose=translation(-2e6, 1, 0))
    ground = dl.Mesh("ground", [(-1, 0, 0), (3e6, 0, 0), (0, 0, 1)], [(0, 2, 1)], "wall")
    site = dl.Scene([*scene.meshes, ground, stool, gate], scene.materials, scene.lights)
    with dl.Session(site, dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=0.3), paths=1000, gather=64) as session:
        session.bake()
        with pytest.raises(dl.OptionError, match=r'move "stool": single precision holds places there'):
            session.move("stool", translation(2e6, 0.5, 0))
        session.update()


def test_specks_are_told_at_most():
    """A light-emitting diode of half a millimetre, moved to the edge of a site of 40 km: no crash."""
    site = [(-20_000, 0, -20_000), (20_000, 0, -20_000), (20_000, 0, 20_000), (-20_000, 0, 20_000)]
    led = dl.Mesh("led", *box((0.0005,) * 3), "glow", pose=translation(0, 0.5, 0), movable=True)
    plan = dl.Scene(
        [dl.Mesh("ground", site, [(0, 2, 1), (0, 3, 2)], "wall"), led],
        [dl.Material("wall"), dl.Material("glow", (0, 0, 0), emission=(1000,) * 3)],
    )
    with dl.Session(plan, dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=0.3), paths=1000, gather=64) as session:
        session.bake()
        session.move("led", translation(19_000, 0.5, 19_000))
        session.update()
        digest = session.digest()
        session.recompute()
        assert session.digest() == digest
        assert np.isfinite(session.irradiance).all()


def test_samples_beyond_the_geometry_get_light():
    """Above a sunlit square floor, looking down: the form factor in closed form."""

    def form_factor(height: float, half: float = 2.0) -> float:
        t = half / np.hypot(half, height)
        return 4 / np.pi * t * np.arctan(t)

    corners = [(-2, 0, -2), (2, 0, -2), (2, 0, 2), (-2, 0, 2)]
    scene = dl.Scene(
        [dl.Mesh("floor", corners, [(0, 2, 1), (0, 3, 2)], "white")],
        [dl.Material("white", (0.8, 0.8, 0.8))],
        [dl.SunLight("sun", (0, -1, 0), (100, 100, 100))],
    )
    for height in (0.5, 1.05, 2.5, 4.0, 40.0):
        for direct in ("auto", "paths"):
            samples = dl.Samples([(0, height, 0), (0, height, 0)], [(0, -1, 0), (0, 1, 0)], radius=0.3)
            with dl.Session(scene, samples, paths=200_000, direct=direct) as session:
                session.bake()
                down, up = session.irradiance[:, 0]
                error = session.standard_error[:, 0]
                # Two looks of five standard errors, whose own spread over 8 batches is a quarter.
                assert abs(down - 80 * form_factor(height)) < 5 * 1.5 * error[0] + 0.1
                assert abs(up - 100) <= 5 * 1.5 * error[1]


LAMPS = {  # what lies 0.5 m below gets 400
    "point": dl.PointLight("lamp", (0, 0.5, 0), (100, 100, 100)),
    "spot": dl.SpotLight("lamp", (0, 0.5, 0), (0, -1, 0), (100, 100, 100), 0.3, 0.5),
    "panel": dl.Mesh(
        "lamp",
        *(
            [(-5e-4, 0.5, -5e-4), (5e-4, 0.5, -5e-4), (5e-4, 0.5, 5e-4), (-5e-4, 0.5, 5e-4)],
            [(0, 1, 2), (0, 2, 3)],
        ),
        "glow",
        movable=True,
    ),
}


@pytest.mark.parametrize("kind", LAMPS)
@pytest.mark.parametrize("half", [10, 2000, 20_000])
def test_a_small_light_over_vast_ground_is_as_bright_as_over_a_small_one(kind, half):
    """Integers that hold what the ground as a whole gets hold what lies right below the lamp, too."""
    corners = [(-half, 0, -half), (half, 0, -half), (half, 0, half), (-half, 0, half)]
    lamp, materials = LAMPS[kind], [dl.Material("grey"), dl.Material("glow", (0, 0, 0), emission=(1e8,) * 3)]
    ground, is_mesh = dl.Mesh("ground", corners, [(0, 2, 1), (0, 3, 2)], "grey"), isinstance(lamp, dl.Mesh)
    scene = dl.Scene([ground, *[lamp] * is_mesh], materials, [lamp] * (not is_mesh))
    samples = dl.Samples([(0, 0, 0), (0, 0.2, 0)], [(0, 1, 0)], radius=0.01)
    with dl.Session(scene, samples, paths=2000, direct="sampled") as session:
        session.bake()
        np.testing.assert_allclose(session.irradiance[:, 0], [400, 1e4 / 9], rtol=1e-4)
        at = session.at([(0, 0.2, 0)], [(0, 1, 0)], part="direct")
        np.testing.assert_allclose(at[:, 0], 1e4 / 9, rtol=1e-4)


def slivers(place: tuple[float, float, float]) -> dl.Mesh:
    vertices = [(0, 0, 0), (0.1, 0, 0), (0.1, 0, 0.1), (0, 0, 0.1), (0.05, 0, -1e-6)]
    return dl.Mesh(
        "lamp", vertices, [(0, 2, 1), (0, 3, 2), (0, 1, 4)], "glow", pose=translation(*place), movable=True
    )


def test_lamps_of_slivers_shine():
    walls = dl.Mesh("walls", *box((10, 3, 10), (50, 1.5, 50), inward=True), "wall")
    materials = [dl.Material("wall"), dl.Material("glow", emission=(1000,) * 3, group="g")]
    samples = dl.Samples([(51, 0, 51)], [(0, 1, 0)], radius=0.3)
    with dl.Session(
        dl.Scene([walls, slivers((50, 2.5, 50))], materials), samples, paths=1_000_000
    ) as session:
        session.bake()
        assert session.irradiance[0, 0] > 0.1
        assert (np.asarray(session.energy["escaped"]) == 0).all()


def test_where_coordinates_begin_is_found_once_for_a_scene_and_its_copies(monkeypatch):
    given = moved(np.array([1e4, 0, 0]))
    found = []

    def counting(points, far, original=frame._far_middle):
        found.extend([len(points)] * (far == frame.FAR))  # else of a movable's own space
        return original(points, far)

    monkeypatch.setattr(frame, "_far_middle", counting)
    scene = dl.Scene(given.meshes, given.materials, given.lights)
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=1.0), paths=1000) as session:
        session.bake()
        pose = scene.mesh("lamp").pose
        session.add(dl.Mesh("second", *box((0.2, 0.2, 0.2)), "wall", pose=pose, movable=True))
        Surfaces(session.scene, session.samples.display)
        assert session.origin.tolist() == scene.frame.origin.tolist() != [0, 0, 0]
    assert len(found) == 1

    corner = scene.mesh("ceiling lamp").vertices[:3]
    for copy in (
        make_movable(scene, ["walls"]),
        scene.with_mesh(dl.Mesh("far", corner, [(0, 1, 2)], "wall")),
    ):
        again = dl.Scene(copy.meshes, copy.materials, copy.lights).frame
        assert copy.frame.followed == tuple(m for m in copy.meshes if not m.movable) == again.followed
        assert (copy.frame.origin.tolist(), copy.frame.radius) == (again.origin.tolist(), again.radius)
    assert len(found) == 5
