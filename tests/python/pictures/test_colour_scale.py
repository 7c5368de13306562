# SPDX-License-Identifier: Apache-2.0
"""Colour scales: their order, their ends, their ticks."""

from __future__ import annotations

import numpy as np
import pytest
from deltalux.outputs.colour_scale import ColourScale, scale_for, symmetric_scale
from deltalux.units import photopic


@pytest.mark.parametrize("logarithmic", [False, True])
def test_sequential_scale_is_ordered_by_lightness(logarithmic: bool):
    scale = ColourScale(1, 1000, logarithmic)
    position = np.linspace(0, 1, 101)
    np.testing.assert_allclose(scale.position(scale.value_at(position)), position, atol=1e-12)
    luminance = photopic(scale.colours(scale.value_at(position)))
    assert (np.diff(luminance) > 0).all()
    assert scale.position(np.array([0.0, 5000.0])).tolist() == [0, 1]


def test_diverging_scale_is_darkest_at_zero_and_ordered_to_both_sides():
    scale = symmetric_scale(np.array([-3.0, 0.1, 1.0]))
    assert (scale.low, scale.high) == (-5, 5)
    zero, tiny = scale.colours(np.array([0.0, 1e-9]))
    np.testing.assert_allclose(zero, tiny, atol=1e-6)  # what changes imperceptibly does not stand out
    brighter = photopic(scale.colours(np.linspace(0, 5, 51)))
    darker = photopic(scale.colours(-np.linspace(0, 5, 51)))
    assert (np.diff(brighter) > 0).all()
    assert (np.diff(darker) > 0).all()
    assert photopic(zero) > 0.01  # not black, which is for what cannot be compared
    for sign in (1, -1):  # more is warm, less is cold
        red, _, blue = scale.colours(sign * np.arange(1.0, 6)).T
        assert (np.sign(red - blue) == sign).all()


def test_scales_choose_round_ends_and_ticks():
    assert scale_for(np.linspace(0, 430, 1000)).high == 500
    assert scale_for(np.linspace(0, 430, 1000)).ticks().tolist() == [0, 100, 200, 300, 400, 500]
    narrow = scale_for(np.array([210.0, 300, 400, 480]))
    assert (narrow.low, narrow.high, narrow.logarithmic) == (200, 500, False)
    dark = scale_for(np.array([0.0, 0, 0, 1, 2, 30, 900]))
    assert (dark.low, dark.high, dark.logarithmic) == (1, 1000, True)
    wide = scale_for(np.geomspace(1, 3000, 1000))
    assert wide.logarithmic
    assert (wide.low, wide.high) == (1, 5000)
    assert wide.ticks().tolist() == [1, 10, 100, 1000]
    assert scale_for(np.geomspace(1, 3000, 1000), logarithmic=False).low == 0
    even = np.full(9, 100.0)
    assert (scale_for(even).low, scale_for(even).high) == (0, 100)
    assert (scale_for(even, logarithmic=True).low, scale_for(even, logarithmic=True).high) == (10, 100)
    assert scale_for(np.linspace(99.5, 100, 9)).low == 0  # noise is not spread over all colours
    for empty in (np.zeros(5), np.full(3, np.nan)):
        assert (scale_for(empty).low, scale_for(empty).high) == (0, 1)
    assert symmetric_scale(np.zeros(5)).high == 1
