# SPDX-License-Identifier: Apache-2.0
"""Numbers for people: significant digits by magnitude."""

from __future__ import annotations

import math

_SMALLEST = 1e-4  # below it, a power of ten is easier to read than many zeros after the point


def significant(value: float, digits: int = 4) -> str:
    """`value` with so many significant digits, at least all before the point, without trailing zeros."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    rounded = float(f"{value:.{digits - 1}e}")
    if abs(rounded) < _SMALLEST:
        mantissa, _, power = f"{rounded:.{digits - 1}e}".partition("e")
        return f"{_bare(mantissa)}e{int(power)}"
    return _bare(f"{rounded:,.{max(digits - 1 - math.floor(math.log10(abs(rounded))), 0)}f}")


def _bare(text: str) -> str:
    return text.rstrip("0").rstrip(".") if "." in text else text
