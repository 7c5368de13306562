# SPDX-License-Identifier: Apache-2.0
"""Cost of a real, exact sphere cache, fitted to counts, since theory differs (paper, Theorems 1 and 2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .checks import at_least, choice, equation

# Tests per ray: slope times n_P^(1/3) or ln n_P, plus a constant; fitted over 1e3 to 1e6 samples.
FITS = {"volume": (28.1, -53.0), "surface": (48.0, -164.0)}
FEWEST = 1000


@equation
def measured_cache_tests(sample_count: ArrayLike, ray_count: ArrayLike, spread: str = "volume") -> np.ndarray:
    """Sphere and disc tests of a real sphere cache; empirical twin of eq. 1 and of `surface_cache_cost`.

    Volume, Q = 0.65: n_R (28.1 n_P^(1/3) - 53), 3.1 to 3.4 times eq. 1. Surface, Q = e^(-1/2):
    n_R (48 ln n_P - 164), 1.5 to 1.9 times theory. Fitted to counts of the exact sphere cache (Hilbert
    order, full depth) over uniform lines, with random samples in or on the cube of eq. 4 and disc radii
    equal to their distance; counts of single runs at 1e3 to 1e6 samples lie within 5 % of it.

    Parameters
    ----------
    sample_count : number or array from 1000, where the fit begins; n_P
    ray_count : number or array from 0; n_R
    spread : "volume" or "surface": where the samples lie

    Returns
    -------
    number or array of tests

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    choice("spread", spread, tuple(FITS))
    count = at_least(FEWEST, "sample_count", sample_count)
    slope, constant = FITS[spread]
    growth = np.cbrt(count) if spread == "volume" else np.log(count)
    return at_least(0, "ray_count", ray_count) * (slope * growth + constant)


@equation
def measured_crossover(sample_count: ArrayLike) -> np.ndarray:
    """Size r_D / r_0 at which a real sphere cache costs as much as disc indexing in eq. 16; for eq. 18.

    It is 0.19 to 0.21, where the paper has 0.35. A real index rejects rays at its root and has no
    crossover: it is faster than the sphere cache at every size (`moving_index_cost`).

    Parameters
    ----------
    sample_count : number or array from 1000; n_D

    Returns
    -------
    number or array, without unit

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    count = at_least(FEWEST, "sample_count", sample_count)
    return np.sqrt(np.cbrt(count) / measured_cache_tests(count, 1))
