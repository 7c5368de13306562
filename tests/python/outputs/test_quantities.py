# SPDX-License-Identifier: Apache-2.0
"""Numbers as people read them, and doubts about levels of light."""

from __future__ import annotations

import math

import pytest
from deltalux.quantities import significant
from deltalux.report import SetSummary, light_doubt


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0, 4, "0"),
        (0.00055271, 4, "0.0005527"),
        (5e-6, 4, "5e-6"),
        (4.9994e-5, 3, "5e-5"),
        (9.9996e-5, 4, "0.0001"),
        (12.3456, 4, "12.35"),
        (500.0, 3, "500"),
        (999.96, 4, "1,000"),
        (5026.55, 4, "5,027"),
        (1234567.8, 4, "1,235,000"),
        (-0.5, 2, "-0.5"),
        (math.inf, 4, "inf"),
        (math.nan, 4, "nan"),
    ],
)
def test_digits_by_magnitude(value: float, digits: int, text: str) -> None:
    assert significant(value, digits) == text


def summary(mean: float, maximum: float, samples: int = 5) -> SetSummary:
    return SetSummary("plane", samples, 0.0, mean, maximum, 0.0, 0.0)


@pytest.mark.parametrize(
    ("mean", "maximum", "unit", "doubt"),
    [
        (2e-6, 5e-6, "lux", "no sample has more than 5e-6 lx, and a full moon gives 0.3 lx"),
        (3e6, 9e6, "lux", "the mean is 3,000,000 lx, and the sun gives 130,000 lx"),
        (50.0, 500.0, "lux", None),
        (0.01, 0.3, "lux", None),
        (0.0, 0.0, "lux", None),
        (2e-6, 5e-6, "W/m2", None),
    ],
)
def test_levels_that_no_place_has_are_doubted(
    mean: float, maximum: float, unit: str, doubt: str | None
) -> None:
    found = light_doubt([summary(mean, maximum)], unit)
    if doubt is None:
        assert found is None
    else:
        assert found is not None
        assert found.startswith(f"doubtful: {doubt}")
        assert "--light-units blender-watts, unitless" in found


def test_sets_are_judged_together() -> None:
    assert light_doubt([summary(1e-6, 1e-5), summary(100, 300)], "lux") is None
    assert light_doubt([], "lux") is None
