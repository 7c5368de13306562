# SPDX-License-Identifier: Apache-2.0
"""The distribution of standard errors that summaries give, and `--target-error` bounds."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.report import advice, claimed_error
from deltalux.report.claimed_error import FLOOR, ClaimedError, weighted_quantile


def grey(values: object) -> np.ndarray:
    return np.repeat(np.asarray(values, dtype=float)[:, None], 3, axis=1)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 1.0])
def test_weights_count_as_copies_do(share):
    rng = np.random.default_rng(3)
    values, copies = rng.random(200), rng.integers(0, 6, 200)
    many = np.repeat(values, copies)
    expected = np.sort(many)[int(np.ceil(share * len(many))) - 1]
    assert weighted_quantile(values, copies.astype(float), share) == expected


def test_errors_are_relative_by_area_and_of_what_is_lit():
    light, error = np.full(100, 10.0), np.linspace(0.01, 1, 100)
    light[:5] = 0  # dark: not counted, whatever they claim
    areas = np.ones(100)
    areas[50] = 1e6
    found = claimed_error(grey(light), grey(error), areas)
    assert found.median == found.p90 == pytest.approx(0.1 * error[50])
    found = claimed_error(grey(light), grey(error), np.ones(100))
    assert (found.median, found.p90) == (pytest.approx(0.1 * error[52]), pytest.approx(0.1 * error[90]))


def test_dark_corners_count_by_a_share_of_the_mean():
    light = np.array([1000.0] * 9 + [1e-3])
    found = claimed_error(grey(light), grey([1.0] * 10), np.ones(10), {"corner": np.array([9])})
    assert found.sets["corner"] == pytest.approx(1 / (FLOOR * light.mean()))


def test_a_roof_in_the_sun_does_not_hide_the_room_s_noise():
    light, error = np.array([1.0] * 8 + [1000.0] * 2), np.array([0.2] * 8 + [1.0] * 2)
    found = claimed_error(grey(light), grey(error), np.ones(10))
    assert (found.median, found.p90) == (pytest.approx(0.2), pytest.approx(0.2))
    dim = claimed_error(
        grey([1.0] * 9 + [1e-3]), grey([0.0] * 9 + [0.15]), np.ones(10), {"dim": np.array([9])}
    )
    assert dim.sets["dim"] == pytest.approx(0.15 / (FLOOR * 0.9001))  # a little below the median: the mean


def test_the_worst_set_is_named_and_dark_ones_are_not():
    light, error = np.array([10.0, 10.0, 0.0]), np.array([0.1, 3.0, 5.0])
    sets = {"floor": np.array([0]), "chair": np.array([1]), "gone": np.array([2])}
    found = claimed_error(grey(light), grey(error), np.ones(3), sets)
    assert (found.worst, found.sets) == ("chair", {"floor": pytest.approx(0.01), "chair": pytest.approx(0.3)})


def test_nothing_lit_claims_nothing():
    for count in (0, 4):
        found = claimed_error(grey(np.zeros(count)), grey(np.ones(count)), np.ones(count))
        assert (found.median, found.p90, found.worst) == (0, 0, None)


def test_advice_says_what_would_help_and_only_where_light_is_noisy():
    assert advice(ClaimedError(0.02, 0.1), 1000, 256) is None
    assert "--paths 810000 --gather 1100" in str(advice(ClaimedError(0.05, 0.2), 200_001, 256))
    discs = str(advice(ClaimedError(0.05, 0.2), 1_000_000, "off"))
    assert "--paths 4000000 would" in discs
    assert "--gather" not in discs


def test_samples_share_the_surface():
    scene = dl.scenes.cornell_box()
    samples = dl.Samples.on_vertices(scene, spacing=0.1, sides="front")
    corners = samples.display.points[samples.display.triangles]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert samples.areas.shape == (len(samples),)
    assert samples.areas.sum() == pytest.approx(0.5 * np.linalg.norm(sides, axis=1).sum())
    assert (dl.Samples.on_grid((0, 0, 0), (1, 0, 0), (0, 0, 2), 0.25).areas == 0.0625).all()
    assert (dl.Samples(np.zeros((3, 3)), (0, 1, 0)).areas == 1).all()
