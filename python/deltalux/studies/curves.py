# SPDX-License-Identifier: Apache-2.0
"""Analysis of curves: crossings of two, growth exponent of one, and whether a number is as expected."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .experiment import Outcome


def crossings(x: ArrayLike, first: ArrayLike, second: ArrayLike) -> list[float]:
    """Where two positive curves cross, interpolated linearly on logarithmic axes.

    Parameters
    ----------
    x : (n,) positive, ascending
    first, second : (n,) positive

    Returns
    -------
    list of x, ascending; empty where one lies below the other throughout
    """
    at = np.log(np.asarray(x, float))
    gap = np.log(np.asarray(first, float)) - np.log(np.asarray(second, float))
    found = []
    for k in range(len(at) - 1):
        if (gap[k] > 0) != (gap[k + 1] > 0):
            share = gap[k] / (gap[k] - gap[k + 1])
            found.append(float(np.exp(at[k] + share * (at[k + 1] - at[k]))))
    return found


def power_law(x: ArrayLike, y: ArrayLike) -> tuple[float, float]:
    """Exponent of y ~ x^p by least squares on logarithmic axes, and its standard error.

    Parameters
    ----------
    x, y : (n,) positive, at least 3 points for an error (else NaN)
    """
    at, values = np.log(np.asarray(x, float)), np.log(np.asarray(y, float))
    slope, offset = np.polyfit(at, values, 1)
    freedom = len(at) - 2
    if freedom < 1:
        return float(slope), float("nan")
    left = values - (slope * at + offset)
    error = np.sqrt((left**2).sum() / freedom / ((at - at.mean()) ** 2).sum())
    return float(slope), float(error)


def agreement(found: float, error: float, expected: float, tolerance: float) -> Outcome:
    """Outcome of a claim that a measured number has an expected value.

    Parameters
    ----------
    found, error : the measured number and its standard error
    expected : number
    tolerance : largest difference that confirms; a number beyond it by less than two errors is open
    """
    apart = abs(found - expected)
    if apart <= tolerance:
        return "confirmed"
    return "refuted" if apart > tolerance + 2 * error else "open"
