# SPDX-License-Identifier: Apache-2.0
"""Patch sums: exact, signed, order-free; power is neither lost nor counted twice."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from oracles import patches
from rooms import room, translation
from scenes_for_tests import furnace, grey, quad

SPACING = 0.5


@pytest.fixture(scope="module")
def scene():
    return room()


@pytest.fixture(scope="module")
def segments(scene):
    return dl.trace(scene, paths=5000, seed=3)


def test_equals_the_reference(scene, segments):
    some = segments.select(np.arange(0, len(segments), 8))
    found = dl.estimate.patch_sum(some, scene, spacing=SPACING)
    points, _ = found.display.world(scene)
    sums, hits, sure = patches.sums(some, points[found.display.triangles])
    assert found.stats["hits"] == hits
    assert sure.mean() > 0.9
    np.testing.assert_array_equal(found.sums[sure], sums[sure])


def test_hits_lie_on_the_triangle_that_the_tracer_hit(scene, segments):
    """Each patch's sum comes from segments whose own record names the patch's source triangle."""
    found = dl.estimate.patch_sum(segments, scene, spacing=SPACING)
    order = sorted(scene.meshes, key=lambda m: m.movable)
    first = {m.name: sum(len(n.triangles) for n in order[:i]) for i, m in enumerate(order)}
    source = np.array([first[scene.meshes[m].name] for m in found.display.triangle_mesh])
    source = source + found.display.source_triangle
    count = sum(len(m.triangles) for m in order)
    by_patch = np.zeros(count, np.int64)
    np.add.at(by_patch, source, found.sums[:, 0])
    by_record = np.zeros(count, np.int64)
    hit = segments.primitive != 0xFFFFFFFF
    np.add.at(by_record, segments.primitive[hit], segments.quanta[hit, 0].astype(np.int64))
    # Hits within rounding of an edge may be given to the neighbour, hits of unlit sides to none.
    assert np.abs(by_patch - by_record).sum() < 2e-3 * by_record.sum()


def test_power_adds_up(scene, segments):
    found = dl.estimate.patch_sum(segments, scene, spacing=SPACING)
    assert found.stats["hits"] + found.stats["elsewhere"] == len(segments)
    assert found.stats["elsewhere"] < 0.01 * len(segments)
    np.testing.assert_allclose(
        (found.irradiance * found.area[:, None]).sum(axis=0),
        found.sums.sum(axis=0) * found.quantum,
        rtol=1e-12,
    )
    third = np.bincount(found.display.triangles.ravel(), np.repeat(found.area, 3) / 3)
    np.testing.assert_allclose(
        (found.vertex_irradiance * third[:, None]).sum(axis=0),
        found.sums.sum(axis=0) * found.quantum,
        rtol=1e-9,
    )


def test_an_edit_equals_a_recompute():
    """A block moves: its old segments are removed in the old pose, the new ones added in the new pose."""
    scene = room()
    pose = translation(0.2, 0.4, -0.3)
    meshes = [
        dl.Mesh(m.name, m.vertices, m.triangles, m.material, m.material_index,
                pose if m.name == "block" else m.pose, m.movable)
        for m in scene.meshes
    ]  # fmt: skip
    after_scene = dl.Scene(meshes, scene.materials, scene.lights)
    before, after = (dl.trace(s, paths=3000, seed=2) for s in (scene, after_scene))
    kept = dl.estimate.PatchSum(scene, SPACING)
    kept.add(before)
    kept.remove(before)
    kept.add(after, poses={"block": pose})
    whole = dl.estimate.PatchSum(scene, display=kept.display)
    whole.add(after, poses={"block": pose})
    np.testing.assert_array_equal(kept.estimate.sums, whole.estimate.sums)
    on_block = kept.display.attached >= 0
    assert whole.estimate.vertex_irradiance[on_block].sum() > 0


def test_a_removed_movable_takes_no_light(scene, segments):
    kept = dl.estimate.PatchSum(scene, SPACING)
    kept.add(segments, poses={"block": None})
    estimate = kept.estimate
    block = [m.name for m in scene.meshes].index("block")
    assert not estimate.sums[estimate.display.triangle_mesh == block].any()
    assert estimate.stats["elsewhere"] > 100


def test_both_sides_of_a_sheet_are_patches_of_their_own():
    sheet = quad((-1, 0, -1), (0, 0, 2), (2, 0, 0)).mesh("sheet", "grey")
    scene = dl.Scene([sheet], [grey()], [dl.PointLight("a", (0, 2, 0)), dl.PointLight("b", (0, -2, 0))])
    light = dl.Segments(
        [(0.3, 1, 0.2)] * 3 + [(0.3, -1, 0.2)] * 2,
        [(0, -1, 0)] * 3 + [(0, 1, 0)] * 2,
        np.ones(5),
        [1.0] * 5,
    )
    found = dl.estimate.patch_sum(light, scene, spacing=3.0)
    per_hit = int(light.quanta[0, 0])
    back = found.display.reversed
    assert found.sums[~back, 0].sum() == 3 * per_hit
    assert found.sums[back, 0].sum() == 2 * per_hit


def test_irradiance_in_a_furnace():
    """Null hypothesis: every patch has the furnace's irradiance pi / (1 - 0.5).

    Patches get Poisson numbers of equal photons; chi-square of the patches, false-alarm rate 1e-4. Photons of
    one path repel each other a little, if anything, and the total is fixed.
    """
    from scipy import stats

    scene, _ = furnace()
    segments = dl.trace(scene, paths=100_000, seed=1)
    found = dl.estimate.patch_sum(segments, scene, spacing=0.5)
    exact = np.pi / (1 - 0.5)
    power = segments.power[:, 0]
    expected = exact * found.area
    variance = (power**2).sum() / power.sum() * expected
    chi2 = ((found.irradiance[:, 0] * found.area - expected) ** 2 / variance).sum()
    assert stats.chi2.sf(chi2, len(expected)) > 1e-4
    assert stats.chi2.cdf(chi2, len(expected)) > 1e-4


def test_nothing_gives_nothing(scene, segments):
    found = dl.estimate.patch_sum(segments.select([]), scene, spacing=SPACING)
    assert found.vertex_irradiance.shape == (len(found.display.points), 3)
    assert not found.vertex_irradiance.any()


def test_ends_in_free_air_are_elsewhere(scene):
    lost = dl.Segments([(0, 1, 0)] * 2, [(0, -1, 0)] * 2, [0.5, np.inf], 1.0)
    found = dl.estimate.patch_sum(lost, scene, spacing=SPACING)
    assert (found.stats["hits"], found.stats["elsewhere"]) == (0, 2)
    landed = dl.estimate.patch_sum(dl.trace(scene, paths=1000), scene, spacing=SPACING)
    assert landed.stats["triangle_tests"] >= landed.stats["hits"] > 1000


def test_first_bounce_leaves_direct_light_out(scene, segments):
    found = dl.estimate.patch_sum(segments, scene, spacing=SPACING, first_bounce=1)
    expected = dl.estimate.patch_sum(segments.select(segments.bounce >= 1), scene, spacing=SPACING)
    np.testing.assert_array_equal(found.sums, expected.sums)


def test_wrong_use_is_refused(scene, segments):
    with pytest.raises(dl.OptionError, match="spacing"):
        dl.estimate.patch_sum(segments, scene, spacing=-1.0)
    with pytest.raises(dl.OptionError, match="scene: found None"):
        dl.estimate.patch_sum(segments, None)
    with pytest.raises(dl.OptionError, match="threads"):
        dl.estimate.patch_sum(segments, scene, threads=0)
    kept = dl.estimate.PatchSum(scene, SPACING)
    kept.add(segments)
    with pytest.raises(dl.OptionError, match="quantum"):
        kept.add(dl.Segments([(0, 1, 0)], [(0, -1, 0)], [1.0], 1.0))
    with pytest.raises(dl.OptionError, match="poses"):
        kept.add(segments, poses={"walls": None})


def test_a_cancelled_call_adds_nothing(scene):
    kept = dl.estimate.PatchSum(scene, 0.1)
    with pytest.raises(dl.Cancelled):
        kept.add(dl.trace(scene, paths=200_000), progress=lambda stage, share: False)
    assert not kept.estimate.sums.any()
    assert kept.estimate.stats == {"hits": 0, "elsewhere": 0, "triangle_tests": 0}
