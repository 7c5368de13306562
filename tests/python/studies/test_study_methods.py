# SPDX-License-Identifier: Apache-2.0
"""Verdicts of the experiments that compare methods: made-up data, in every outcome."""

from __future__ import annotations

import numpy as np
import pytest
from deltalux.studies.experiments import disc_spacing, index_choice, moving_object, ray_map_cost
from deltalux.studies.series import Series
from deltalux.studies.timing import Timing

SIZES = np.array([0.02, 0.1, 0.2, 0.35, 0.5, 1.0])


def cache_over_index(crossover: float) -> np.ndarray:
    """Costs relative to an index at 1, which cross it at one size."""
    return (SIZES / crossover) ** 2


@pytest.mark.parametrize(("crossover", "outcome"), [(0.35, "confirmed"), (0.2, "refuted"), (2.0, "refuted")])
def test_moving_object_crosses_where_printed(crossover, outcome):
    cache, index = cache_over_index(crossover), np.ones(len(SIZES))
    assert moving_object.count_verdict(SIZES, cache).outcome == outcome
    verdict = moving_object.real_verdict("counts", SIZES, cache, index)
    assert verdict.outcome == outcome
    assert ("no crossover" in verdict.text) == (crossover > 1)


def test_moving_object_the_other_way_round_is_no_confirmation():
    """The sphere cache dearer below 0.35 and cheaper above."""
    verdict = moving_object.real_verdict("counts", SIZES, 1 / cache_over_index(0.35), np.ones(len(SIZES)))
    assert verdict.outcome == "refuted"


def test_moving_object_leaves_out_unknown_times():
    index = np.where(SIZES < 0.1, np.nan, 1.0)
    assert "0.02" not in moving_object.real_verdict("times", SIZES, cache_over_index(0.35), index).text
    assert (
        moving_object.real_verdict("times", SIZES, cache_over_index(0.35), 0 * index * np.nan).outcome
        == "open"
    )


def test_moving_object_paper():
    assert moving_object.paper_verdict([0.352]).outcome == "confirmed"
    assert moving_object.paper_verdict([]).outcome == "refuted"
    assert moving_object.paper_verdict([0.2, 0.352]).outcome == "refuted"


def test_static_samples():
    index = np.array([1.0, np.nan, 1.0])
    assert moving_object.static_verdict("time", np.array([2.0, 0.1, 3.0]), index).outcome == "confirmed"
    assert moving_object.static_verdict("time", np.array([2.0, 4.0, 0.9]), index).outcome == "refuted"
    assert moving_object.static_verdict("time", np.array([2.0, 4.0, 0.9]), np.nan * index).outcome == "open"


WIDTHS = np.array([0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0])


def ratios(values, error=0.01) -> list[Series]:
    return [Series("case", "1", np.array(values, float), np.full(len(values), error))]


@pytest.mark.parametrize(
    ("values", "near", "far"),
    [
        ([0.5, 0.7, 1.5, 2.0, 1.5, 0.7, 0.5], "confirmed", "confirmed"),
        ([2.0, 2.0, 2.0, 2.0, 2.0, 0.9, 0.8], "confirmed", "refuted"),
        ([0.5, 0.5, 0.8, 0.8, 0.8, 0.5, 0.5], "refuted", "confirmed"),
    ],
)
def test_disc_spacing(values, near, far):
    assert disc_spacing.near_verdict(WIDTHS, ratios(values)).outcome == near
    assert disc_spacing.far_verdict(WIDTHS, ratios(values)).outcome == far


def test_disc_spacing_is_open_within_its_error():
    even = ratios(np.ones(len(WIDTHS)), 0.1)
    assert disc_spacing.near_verdict(WIDTHS, even).outcome == "open"
    assert disc_spacing.far_verdict(WIDTHS, even).outcome == "open"


def test_index_choice_costs_of_a_choice():
    truth = {"a": 10.0, "b": 12.0, "c": 30.0}
    assert index_choice.extra_cost({"a": 5.0, "b": 6.0, "c": 7.0}, truth) == 0
    assert index_choice.extra_cost({"a": 7.0, "b": 6.0, "c": 7.0}, truth) == pytest.approx(0.2)
    assert index_choice.well_chosen([0, 0.01, 0.2, 0.04]) == 0.75


def test_index_choice_verdicts():
    assert index_choice.same_verdict(True).outcome == "confirmed"
    assert index_choice.same_verdict(False).outcome == "refuted"
    assert index_choice.choice_verdict({"x": [0.0] * 20, "y": [0.04] * 20}, 100).outcome == "confirmed"
    assert (
        index_choice.choice_verdict({"x": [0.0] * 20, "y": [0.0] * 18 + [0.5] * 2}, 100).outcome == "refuted"
    )


def test_index_choice_best():
    first, second = {"a": [1.0, 1.1], "b": [5.0, 5.1]}, {"a": [5.0, 5.1], "b": [1.0, 1.1]}
    assert index_choice.best_verdict({"x": first, "y": second}).outcome == "confirmed"
    assert index_choice.best_verdict({"x": first, "y": first}).outcome == "refuted"
    near = {"a": [1.0, 5.0], "b": [5.2, 1.0]}
    assert index_choice.best_verdict({"x": first, "y": near}).outcome == "open"
    assert index_choice.best_verdict({"x": {"a": [1.0], "b": [5.0]}}).outcome == "open"


COUNTS = np.array([1e3, 1e4, 1e5])


@pytest.mark.parametrize(("power", "outcome"), [(0.33, "confirmed"), (0.5, "refuted")])
def test_ray_map_law(power, outcome):
    tests = np.stack([COUNTS**power, 1.1 * COUNTS**power])
    assert ray_map_cost.law_verdict("n_P", 1 / 3, COUNTS, tests).outcome == outcome


def test_ray_map_verdicts():
    theory = np.array([10.0, 11.0])
    assert ray_map_cost.constant_verdict(1.2 * theory, theory).outcome == "confirmed"
    assert ray_map_cost.constant_verdict(1.3 * theory, theory).outcome == "refuted"
    fast, slow = Series("fast", "ms", np.array([1.0, 2.0])), Series("slow", "ms", np.array([2.0, 3.0]))
    mixed = Series("mixed", "ms", np.array([0.5, 4.0]))
    for own, theirs, outcome in ((fast, slow, "confirmed"), (slow, fast, "refuted"), (fast, mixed, "open")):
        assert ray_map_cost.cheaper_verdict("other", COUNTS[:2], own, theirs).outcome == outcome


@pytest.mark.parametrize(
    ("own", "index", "outcome"),
    [
        (Timing(1, 0.1), Timing(2, 0.1), "confirmed"),
        (Timing(2, 0.1), Timing(1, 0.1), "refuted"),
        (Timing(1, 0.1), Timing(1.1, 0.1), "open"),
        (Timing(1, 0.1), Timing(-0.1, 0.1), "open"),
    ],
)
def test_ray_map_update(own, index, outcome):
    times = {ray_map_cost.MAP: own, ray_map_cost.INDEX: index}
    assert ray_map_cost.update_verdict(times).outcome == outcome
