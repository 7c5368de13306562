# SPDX-License-Identifier: Apache-2.0
"""Dense vertices share samples: fewer of them, in their places, with the same light within a little."""

from __future__ import annotations

from dataclasses import replace

import deltalux as dl
import numpy as np
import pytest
from deltalux import outputs
from deltalux.mesh.display_mesh import DisplayMesh, refine
from deltalux.outputs.of_session import baked_of
from deltalux.samples import shared_samples
from deltalux.samples.clearance import Clearance
from deltalux.samples.shared_samples import shared

MOST = 1500


def ball(rings: int, radius: float, centre: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """A closed sphere of rings, each of twice as many quads, wound outward."""
    up, turn = np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    grid = np.array([[(np.sin(a) * np.cos(b), np.cos(a), np.sin(a) * np.sin(b)) for b in turn] for a in up])
    number = np.arange(grid.shape[0] * grid.shape[1]).reshape(grid.shape[:2])
    a, b = number[:-1], number[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, d, b), (d, c, b))])
    return radius * grid.reshape(-1, 3) + centre, triangles


def room(rings: int = 40) -> dl.Scene:
    """A closed room of 4 x 3 x 4 m, a lamp, two dense balls of 30 and 20 cm, the second movable."""
    walls = np.array([(x, y, z) for x in (-2, 2) for y in (0, 3) for z in (-2, 2)], float)
    quads = [(0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6), (0, 4, 6, 2), (1, 3, 7, 5)]
    inward = [t for a, b, c, d in quads for t in ((a, c, b), (a, d, c))]
    return dl.Scene(
        [
            dl.Mesh("walls", walls, inward, "grey"),
            dl.Mesh("ball", *ball(rings, 0.3, (-0.7, 0.6, 0)), "grey", smooth_angle=60),
            dl.Mesh("small ball", *ball(rings, 0.2, (0.9, 0.5, 0)), "grey", movable=True, smooth_angle=60),
        ],
        [dl.Material("grey", reflectance=(0.6, 0.5, 0.4))],
        [dl.PointLight("bulb", (0.3, 2.5, 0.4), (100, 100, 100))],
        unit="lux",
    )


@pytest.fixture(scope="module")
def scene() -> dl.Scene:
    return room()


@pytest.fixture(scope="module")
def full(scene: dl.Scene) -> DisplayMesh:
    return refine(scene, 0.5)


@pytest.fixture(scope="module")
def few(scene: dl.Scene, full: DisplayMesh) -> DisplayMesh:
    return shared(full, Clearance(scene, full).covered, MOST)


def test_few_samples_serve_all_vertices(full: DisplayMesh, few: DisplayMesh):
    sharing = few.sharing
    assert sharing is not None
    assert MOST / 2 < len(few.sample_vertices) <= MOST < len(full.points) / 3
    np.testing.assert_allclose(sharing.weights.sum(axis=1), 1, atol=1e-6)
    assert (np.diff(sharing.vertices) > 0).all()
    # A vertex that has a sample shows that sample and nothing else.
    np.testing.assert_array_equal(sharing.at_vertices(np.eye(len(sharing.vertices)))[sharing.vertices],
                                  np.eye(len(sharing.vertices)))  # fmt: skip


def test_a_vertex_takes_light_from_its_own_surface_and_side(few: DisplayMesh):
    sharing = few.sharing
    assert sharing is not None
    mine = np.repeat(np.arange(len(few.points)), 4)[sharing.weights.ravel() > 0]
    theirs = few.sample_vertices[sharing.samples.ravel()[sharing.weights.ravel() > 0]]
    assert (few.vertex_mesh[mine] == few.vertex_mesh[theirs]).all()
    assert np.einsum("kc,kc->k", few.normals[mine], few.normals[theirs]).min() > 0.5
    assert np.linalg.norm(few.points[mine] - few.points[theirs], axis=1).max() < 2 * few.spacing


def test_a_plain_room_keeps_all_its_samples(scene: dl.Scene):
    display = refine(replace_meshes(scene, scene.meshes[:1]), 0.05)
    nothing = np.zeros(len(display.points), dtype=bool)
    assert shared(display, nothing, len(display.points)) is display
    half = shared(display, nothing, len(display.points) // 2)
    # Cubes of half the spacing hold several vertices near edges at most.
    assert len(half.sample_vertices) > 0.4 * len(display.points)


def replace_meshes(scene: dl.Scene, meshes: list[dl.Mesh]) -> dl.Scene:
    return dl.Scene(list(meshes), list(scene.materials), list(scene.lights), unit=scene.unit)


def test_covered_samples_share_with_their_like_alone(full: DisplayMesh):
    covered = np.arange(len(full.points)) % 2 == 0
    sharing = shared(full, covered, MOST).sharing
    assert sharing is not None
    used = sharing.weights > 0
    same = covered[sharing.vertices][sharing.samples] == covered[:, None]
    assert same[used].all()


def test_lonely_covered_samples_have_their_own(full: DisplayMesh):
    covered = np.zeros(len(full.points), dtype=bool)
    covered[np.flatnonzero(full.vertex_mesh == 1)[::97]] = True
    sharing = shared(full, covered, MOST).sharing
    assert sharing is not None
    same = covered[sharing.vertices][sharing.samples] == covered[:, None]
    assert same[sharing.weights > 0].all()


def test_both_sides_of_a_thin_thing_are_kept_apart():
    points, triangles = ball(40, 0.5, (0, 0, 0))
    plate = dl.Mesh("plate", points * (1, 0.01, 1), triangles, "grey", smooth_angle=180)
    display = refine(dl.Scene([plate], [dl.Material("grey")], [], unit="lux"), 0.5)
    sharing = shared(display, np.zeros(len(display.points), dtype=bool), 200).sharing
    assert sharing is not None
    theirs = display.normals[sharing.vertices][sharing.samples]
    turn = np.einsum("kc,kjc->kj", display.normals, theirs)
    assert turn[sharing.weights > 0].min() > 0.3


def test_areas_add_up(full: DisplayMesh, few: DisplayMesh):
    assert few.sample_areas().sum() == pytest.approx(full.vertex_areas().sum(), rel=1e-6)
    assert (few.sample_areas() > 0).all()


def test_smooth_light_is_kept(full: DisplayMesh, few: DisplayMesh):
    """Of a light that varies slowly over places and normals, vertices show it within some per cent."""
    light = 10 + full.points @ (1.0, 2.0, 0.5) + full.normals @ (0.5, 1.0, -1.0)
    shown = few.at_vertices(light[few.sample_vertices])
    assert np.sqrt(np.mean((shown / light - 1) ** 2)) < 0.015
    assert np.abs(shown / light - 1).max() < 0.1


@pytest.fixture(scope="module")
def baked(scene: dl.Scene, few: DisplayMesh):
    with dl.Session(scene, dl.Samples.on_vertices(scene, display=few), paths=20_000, gather=32) as session:
        session.bake()
        yield session


def test_a_session_bakes_the_samples_that_there_are(baked: dl.Session, few: DisplayMesh):
    assert len(baked.samples) == len(few.sample_vertices) == len(baked.irradiance)
    own = few.sample_vertices
    np.testing.assert_array_equal(baked.samples.points, few.sample_points[own])
    on_ball = few.vertex_mesh[own] == 2
    assert (baked.samples.attached[on_ball] == "small ball").all()
    assert (baked.samples.attached[~on_ball] == None).all()  # noqa: E711, elementwise


def test_files_keep_how_samples_are_shared(baked: dl.Session, few: DisplayMesh, tmp_path):
    baked.save(tmp_path / "a.dlx")
    with dl.Session.open(tmp_path / "a.dlx") as opened:
        display = opened.samples.display
        assert display is not None and display.sharing is not None and few.sharing is not None
        for name in ("vertices", "samples", "weights"):
            np.testing.assert_array_equal(getattr(display.sharing, name), getattr(few.sharing, name))
        assert opened.digest() == baked.digest()
        pose = opened.pose("small ball")
        pose[:3, 3] += (0.2, 0.1, 0)
        opened.move("small ball", pose)
        opened.update()
        digest = opened.digest()
        opened.recompute()
        assert opened.digest() == digest


def test_meshes_and_pictures_show_every_vertex(baked: dl.Session, few: DisplayMesh, tmp_path):
    outputs.write(tmp_path / "a.glb", baked_of(baked, "test"))
    outputs.write(tmp_path / "a.png", baked_of(baked, "test"))
    lit = dl.load(tmp_path / "a.glb")
    assert sum(len(m.triangles) for m in lit.meshes) == len(few.triangles)
    outputs.write(tmp_path / "a.npz", baked_of(baked, "test"))
    assert len(np.load(tmp_path / "a.npz")["irradiance"]) == len(few.sample_vertices)


def test_by_default_dense_meshes_share(monkeypatch: pytest.MonkeyPatch, scene: dl.Scene):
    monkeypatch.setattr(shared_samples.shared, "__defaults__", (MOST,))
    samples = dl.Samples.on_vertices(scene, spacing=0.5)
    assert len(samples) <= MOST
    every = dl.Samples.on_vertices(scene, spacing=0.5, share=False)
    assert every.display is not None and len(every) == len(every.display.points) > 3 * MOST
    assert every.display.sharing is None


def test_one_sample_serves_a_ball_smaller_than_a_cube():
    tiny = dl.Mesh("tiny", *ball(12, 1e-3, (0, 0, 0)), "grey", smooth_angle=180)
    scene = dl.Scene([tiny], [dl.Material("grey")], [], unit="lux")
    display = refine(scene, 1.0)
    sharing = shared(display, np.zeros(len(display.points), dtype=bool), 1).sharing
    assert sharing is not None
    assert len(sharing.vertices) <= 6  # one for each way to look
    np.testing.assert_allclose(sharing.weights.sum(axis=1), 1, atol=1e-6)


def test_odd_weights_in_files_are_refused(baked: dl.Session, few: DisplayMesh, tmp_path):
    assert few.sharing is not None
    given = baked.samples.display
    for name, value, said in (
        ("weights", np.full_like(few.sharing.weights, 0.3), "does not add up to 1"),
        ("samples", np.full_like(few.sharing.samples, 10**6), "beyond what there is"),
        ("vertices", np.full_like(few.sharing.vertices, -1), "beyond what there is"),
    ):
        baked.samples.display = replace(few, sharing=replace(few.sharing, **{name: value}))
        try:
            baked.save(tmp_path / "b.dlx")
        finally:
            baked.samples.display = given
        with pytest.raises(dl.FormatError, match=said):
            dl.Session.open(tmp_path / "b.dlx")
