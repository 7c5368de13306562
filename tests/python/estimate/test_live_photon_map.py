# SPDX-License-Identifier: Apache-2.0
"""The photon map that keeps valid photons: what it keeps, and how it differs from a recompute."""

from __future__ import annotations

from functools import cache

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene import replace_scene
from rooms import room, translation


def moved(scene, name, pose):
    """The same scene with a movable elsewhere."""
    meshes = [
        dl.Mesh(
            m.name, m.vertices, m.triangles, m.material, m.material_index,
            pose if m.name == name else m.pose, m.movable, m.smooth_angle,
        )
        for m in scene.meshes
    ]  # fmt: skip
    return replace_scene(scene, meshes=meshes)


def rows(segments):
    """The bytes of each segment."""
    columns = (
        segments.path, segments.bounce, segments.length, segments.origin, segments.direction, segments.quanta,
    )  # fmt: skip
    count = len(segments)
    parts = [np.ascontiguousarray(c).reshape(count, -1).view(np.uint8) for c in columns]
    return [row.tobytes() for row in np.concatenate(parts, axis=1)]


def changes(before, after):
    """Masks: segments that are gone, and segments that are new."""
    old, new = rows(before), rows(after)
    had, has = set(old), set(new)
    return np.array([row not in has for row in old]), np.array([row not in had for row in new])


@cache
def edit():
    """A block of a small room moves by 30 cm."""
    scene = room()
    after = moved(scene, "block", translation(0.7, 0.31, 0.1))
    before, after = (dl.trace(s, paths=20_000, seed=5) for s in (scene, after))
    gone, new = changes(before, after)
    assert 0.02 < gone.mean() < 0.5
    rng = np.random.default_rng(1)
    points = np.concatenate([
        np.stack([rng.uniform(-2, 2, 500), np.zeros(500), rng.uniform(-1.5, 1.5, 500)], axis=1),
        np.stack([rng.uniform(-2, 2, 500), np.full(500, 2.0), rng.uniform(-1.5, 1.5, 500)], axis=1),
    ])  # fmt: skip
    normals = np.repeat([(0.0, 1, 0), (0.0, -1, 0)], 500, axis=0)
    return before, after, gone, new, dl.Samples(points, normals)


def test_starts_as_the_photon_map():
    before, *_, samples = edit()
    for options in ({}, {"kernel": "cone", "unbiased": False}, {"k": 9, "compression": 3.0}):
        live = dl.estimate.PhotonMap(before, samples, **options)
        once = dl.estimate.photon_map(before, samples, **options)
        np.testing.assert_array_equal(live.estimate.irradiance, once.irradiance)
        assert live.estimate.stats["hits"] == once.stats["hits"]


@pytest.mark.parametrize("form", ["mask", "numbers"])
def test_a_requery_equals_a_recompute(form):
    before, after, gone, new, samples = edit()
    live = dl.estimate.PhotonMap(before, samples)
    live.update(gone if form == "mask" else np.flatnonzero(gone), after.select(new))
    assert len(live.segments) == len(after)
    live.requery()
    expected = dl.estimate.photon_map(after, samples).irradiance
    np.testing.assert_array_equal(live.estimate.irradiance, expected)


def test_an_update_keeps_valid_photons_and_asks_for_the_others():
    before, after, gone, new, samples = edit()
    live = dl.estimate.PhotonMap(before, samples)
    old = live.estimate.irradiance
    report = live.update(gone, after.select(new))
    assert (report.removed, report.added) == (gone.sum(), new.sum())
    assert report.requeried + report.changed + report.kept == len(samples)
    assert min(report.requeried, report.changed, report.kept) > 10
    found = live.estimate.irradiance
    expected = dl.estimate.photon_map(after, samples).irradiance
    equal = (found == expected).all(axis=1)
    assert (~equal).sum() <= report.changed  # nothing else may differ
    assert equal.sum() >= report.kept
    assert ((found == old).all(axis=1)).sum() >= report.kept


@pytest.mark.parametrize("requery", [True, False])
def test_the_difference_from_a_recompute_is_noise(requery):
    """Null hypothesis: kept photons and recomputed ones have one expectation.

    Over 16 seeds the mean relative difference of the samples that differ has its own
    standard error; four of those are allowed (Student's t, 15 degrees of freedom: 1.2e-3).
    """
    scene = room()
    after_scene = moved(scene, "block", translation(0.7, 0.31, 0.1))
    samples = edit()[-1]
    difference, spread = [], []
    for seed in range(16):
        before, after = (dl.trace(s, paths=4000, seed=seed, threads=1) for s in (scene, after_scene))
        gone, new = changes(before, after)
        live = dl.estimate.PhotonMap(before, samples, threads=1)
        live.update(gone, after.select(new), requery=requery)
        found, expected = (
            e.irradiance.mean(axis=1)
            for e in (live.estimate, dl.estimate.photon_map(after, samples, threads=1))
        )
        differs = found != expected
        assert differs.sum() > 4
        difference.append((found - expected)[differs].mean() / expected.mean())
        spread.append(((found - expected)[differs] / expected[differs]).std())
    error = np.std(difference, ddof=1) / 4
    assert abs(np.mean(difference)) < 4 * error
    assert 0.005 < np.mean(spread) < 0.15  # of the order of 1 / sqrt(50), the noise of either


def test_without_a_requery_samples_keep_their_radius():
    """What is weighed are the photons within the old radius, no more and no less."""
    before, after, gone, new, samples = edit()
    live = dl.estimate.PhotonMap(before, samples, k=20)
    report = live.update(gone, after.select(new), requery=False)
    assert report.requeried == 0
    assert report.changed > 100
    again = live.update(np.zeros(len(after), bool), after.select([]), requery=False)
    assert (again.changed, again.kept) == (0, len(samples))

    def photons(segments, i):
        end = segments.origin.astype(float) + segments.length[:, None].astype(float) * segments.direction
        facing = segments.direction.astype(float) @ samples.normals[i] < 0
        return np.linalg.norm(end - samples.points[i], axis=1), facing

    for i in range(0, len(samples), 100):
        distance, facing = photons(before, i)
        radius = np.sort(distance[facing])[19]
        distance, facing = photons(after, i)
        inside = after.quanta[facing & (distance < radius)].astype(float).sum(axis=0) * after.quantum
        np.testing.assert_allclose(live.estimate.irradiance[i], inside / (np.pi * radius**2), rtol=1e-9)


def test_a_sample_that_lost_its_farthest_photon_is_asked_anew():
    """That one defines the radius, though it is not weighed."""
    origin = [(x, 1.0, 0.0) for x in (1, 2, 4)]
    segments = dl.Segments(origin, [(0, -1, 0)] * 3, [1.0] * 3, [1.0] * 3)
    live = dl.estimate.PhotonMap(segments, dl.Samples([(0, 0, 0)], [(0, 1, 0)]), k=2)
    np.testing.assert_allclose(live.estimate.irradiance, 1 / (4 * np.pi), rtol=1e-6)
    assert live.update([1], segments.select([])).requeried == 1
    np.testing.assert_allclose(live.estimate.irradiance, 1 / (16 * np.pi), rtol=1e-6)


def test_threads_do_not_matter():
    before, after, gone, new, samples = edit()
    found = []
    for threads in (1, 2, 4):
        live = dl.estimate.PhotonMap(before, samples, threads=threads)
        live.update(gone, after.select(new))
        found.append(live.estimate.irradiance)
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])


def test_removing_everything_leaves_nothing_and_it_may_come_back():
    before, *_, samples = edit()
    live = dl.estimate.PhotonMap(before, samples)
    first = live.estimate.irradiance
    report = live.update(np.ones(len(before), bool), before.select([]))
    assert (report.requeried, report.kept) == (len(samples), 0)
    assert not live.estimate.irradiance.any()
    live.update([], before)
    np.testing.assert_array_equal(live.estimate.irradiance, first)


def test_wrong_edits_are_refused():
    before, *_, samples = edit()
    live = dl.estimate.PhotonMap(before, samples)
    other = dl.Segments([(0, 1, 0)], [(0, -1, 0)], [1.0], 1.0)
    for removed in ([len(before)], [-1], [0.5], np.zeros(3, bool), [[0]]):
        with pytest.raises(dl.OptionError, match="removed: found"):
            live.update(removed, before.select([]))
    with pytest.raises(dl.OptionError, match="quantum"):
        live.update([], other)
