# SPDX-License-Identifier: Apache-2.0
"""What studies are built of: counting indices, crossings of curves, times, samples, changed segments."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.studies.curves import agreement, crossings, power_law
from deltalux.studies.experiments import experiment
from deltalux.studies.indices import DiscGrid, kd_tree, octree
from deltalux.studies.moved_scene import changed_segments, joined, with_moved
from deltalux.studies.runner import settings_of
from deltalux.studies.scene_samples import static_distance, uniform_on_surfaces
from deltalux.studies.series import Series, series_table
from deltalux.studies.timing import Timing, interleaved, median
from deltalux.studies.uniform_samples import in_cube
from rooms import room
from thoroughness import slow


def lit_room():
    scene = room()
    return dl.trace(scene, 400, seed=3), uniform_on_surfaces(
        scene, 300, 4, static_distance(scene, 300), movables=False
    )


def lines_in_a_cube():
    return dl.uniform_lines(500, seed=5), in_cube(400, "volume", 6)


def axial_rays():
    """Along the axes, through cells' borders, from inside; rays with zeros in their directions."""
    steps = np.linspace(-0.9, 0.9, 7)
    origin = np.array(
        [(x, y, -1.0) for x in steps for y in steps] + [(-1.0, x, y) for x in steps for y in steps]
    )
    direction = np.repeat([(0, 0, 1), (1, 0, 0)], 49, axis=0)
    samples = dl.Samples([(x, y, 0.0) for x in steps for y in steps], (-1, 0, -1), 0.3)
    return dl.Segments(origin, direction, np.full(98, 1.5), np.ones(98)), samples


@pytest.mark.parametrize("inputs", [lit_room, lines_in_a_cube, axial_rays])
@pytest.mark.parametrize("build", [DiscGrid, octree, kd_tree])
def test_every_index_finds_what_brute_force_finds(inputs, build):
    segments, samples = inputs()
    exact = dl.estimate.brute_force(segments, samples, segment_end="first")
    costs = build(samples).cast(segments, samples)
    assert exact.sums.sum() > 0
    assert (costs.sums == exact.sums).all()
    assert costs.steps.shape == costs.tests.shape == (len(segments),)
    # An index may test a disc in several cells, but spares most of the pairs.
    assert exact.stats["hits"] <= costs.tests.sum() < 0.7 * len(segments) * len(samples)


def test_grid_of_one_cell_counts_one_step():
    samples = dl.Samples([(0, 0, 0)], [(0, 0, 1)], 0.5)
    ray = dl.Segments([(0, 0, 1)] * 2, [(0, 0, -1), (0, 0, 1)], [2, 2], [1, 1])
    costs = DiscGrid(samples).cast(ray, samples)
    assert costs.tests.tolist() == [2, 0] or costs.tests.tolist() == [1, 0]
    assert costs.steps[0] >= 1
    assert costs.steps[1] == 0
    assert costs.sums[0, 0] == ray.quanta[0, 0]


def test_crossings():
    x = [1, 2, 4, 8]
    assert crossings(x, [1, 2, 4, 8], [2, 2.8284271, 4, 5.6568542]) == pytest.approx([4])
    assert crossings(x, [1, 4, 1, 4], [2] * 4) == pytest.approx([2**0.5, 8**0.5, 32**0.5])
    assert crossings(x, [3] * 4, [2] * 4) == []


def test_power_law():
    x = np.array([1.0, 2, 4, 8])
    assert power_law(x, 3 * x**-0.5) == pytest.approx((-0.5, 0), abs=1e-12)
    assert np.isnan(power_law(x[:2], x[:2])[1])
    assert power_law(x, x * [1, 1.1, 0.9, 1])[1] > 0.01


def test_agreement():
    assert agreement(0.52, 0.1, 0.5, 0.05) == "confirmed"
    assert agreement(0.6, 0.03, 0.5, 0.05) == "open"
    assert agreement(0.6, 0.02, 0.5, 0.05) == "refuted"


def test_times():
    assert median([1.0]) == Timing(1.0, 0.0)
    assert median([3.0, 1.0, 2.0]).seconds == 2
    difference = Timing(5, 0.3) - Timing(2, 0.4)
    assert (difference.seconds, difference.error) == pytest.approx((3, 0.5))
    assert difference.known  # by six standard errors
    assert not (Timing(5, 0.3) - Timing(3.1, 0.4)).known
    assert not (Timing(2.5, 0.3) - Timing(2, 0.4)).known
    assert Timing(4, 0.4).over(Timing(2, 0)) == pytest.approx((2, 0.2))


def test_median_errs_as_its_error_says():
    """Null hypothesis: the error's mean square is the median's, normal law; 4,000 medians of 15: ± 2.5 %.

    Quartiles of few values are biased, by some 5 % here, hence the 20 %.
    """
    values = np.random.default_rng(7).normal(10, 1, (4000, 15))
    found = [median(list(row)) for row in values]
    spread = np.std([one.seconds for one in found])
    assert np.sqrt(np.mean([one.error**2 for one in found])) == pytest.approx(spread, rel=0.2)


def test_interleaved_calls_take_turns():
    calls: list[str] = []
    found = interleaved({name: lambda name=name: calls.append(name) for name in "ab"}, 2)
    assert calls == list("ababab")
    assert set(found) == {"a", "b"}


def test_series():
    series = Series.of_times("it", [Timing(1.0, 0.1), Timing(0.1, 0.1)])
    assert series.curve(np.array([1, 2])).x == [1]
    table = series_table("t", "x", np.array([1, 2]), [series])
    assert table.columns == ["x", "it [ms]", "it, standard error [ms]"]
    assert table.rows == [[1.0, 1000.0, 100.0], [2.0, None, None]]
    assert Series("theory", "1", np.ones(2), theory=True).curve(np.ones(2)).style == "theory"
    assert Series.of_seeds("one seed", "1", [[1.0, 2.0]]).error is None


def test_changed_segments_are_those_of_an_update():
    scene, samples = room(), dl.Samples([(0, 0.01, 0)], [(0, 1, 0)], 0.2)
    offset = (0.1, 0.0, 0.05)
    moved = with_moved(scene, "block", offset)
    assert moved.mesh("block").pose[:3, 3] - scene.mesh("block").pose[:3, 3] == pytest.approx(offset)
    before, after = (dl.trace(each, 2000, seed=2) for each in (scene, moved))
    old, new = changed_segments(before, after)
    assert len(before) - len(old) == len(after) - len(new)
    with dl.Session(scene, samples, paths=2000, seed=2, direct="paths") as session:
        session.bake()
        session.move("block", moved.mesh("block").pose)
        frame = session.update()
    # A session also removes what would come back unchanged after the first changed segment: nothing, mostly.
    assert 0 < len(old) <= frame.removed_segments <= 1.5 * len(old)
    both = joined(old, new)
    assert len(both) == len(old) + len(new)
    np.testing.assert_array_equal(both.origin[: len(old)], old.origin)
    assert [len(part) for part in changed_segments(before, before)] == [0, 0]


@pytest.mark.parametrize("name", ["hybrid-estimate", slow("index-choice")])
def test_findings_do_not_depend_on_threads(name):
    study = experiment(name)
    one, two = (study.run(settings_of(study, quick=True, seeds=[1], threads=n), None) for n in (1, 2))
    assert one == two


@pytest.mark.parametrize("name", [slow("moving-object"), slow("ray-map-cost")])
def test_counts_of_timed_experiments_do_not_depend_on_threads(name):
    """Their first tables hold counts."""
    study = experiment(name)
    one, two = (study.run(settings_of(study, quick=True, seeds=[1], threads=n), None) for n in (1, 2))
    assert one.tables[0] == two.tables[0]
