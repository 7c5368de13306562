# SPDX-License-Identifier: Apache-2.0
"""Cost of the sphere cache for samples in a volume (paper 3.1, equations 1 to 6; the 8.08 of 3.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from deltalux.errors import OptionError

from .checks import FORMS, at_least, choice, equation, fraction, positive, within
from .index_costs import disc_index_cost

PRINTED_CONSTANT = 8.08
GRID = np.sqrt(3) / 2  # r_0 / (d n_P^(1/3)) of the grid of eq. 4


@equation
def sphere_cache_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    ratio: ArrayLike = 2 / 3,
    sphere_test: ArrayLike = 1.0,
    disc_test: ArrayLike = 1.0,
    form: str = "corrected",
) -> np.ndarray:
    """Cost of the sphere cache, T = T_I + T_R (paper, eq. 1 and Theorem 1).

    Eq. 6 plus eq. 3.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    ratio : number or array between 0 and 1; Q
    sphere_test, disc_test : numbers or arrays, seconds; t, u. With 1 the result counts tests
    form : "corrected", "printed" or "spacing", see `rebuild_cost`

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    inner = grid_inner_cost(sample_count, ray_count, disc_test)
    return inner + rebuild_cost(sample_count, ray_count, ratio, sphere_test, form)


@equation
def inner_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    radius: ArrayLike,
    outer_radius: ArrayLike,
    disc_test: ArrayLike = 1.0,
) -> np.ndarray:
    """Cost of the disc tests in the innermost spheres: T_I = u n_P n_R d² / r_0² (paper, eq. 2).

    The innermost sphere has the disc's radius d.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    radius, outer_radius : numbers or arrays, metres; d, r_0
    disc_test : number or array, seconds; u

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range, or d above r_0.
    """
    disc, outer = positive("radius", radius), positive("outer_radius", outer_radius)
    within("radius", disc, "outer_radius", outer)
    tests = at_least(1, "sample_count", sample_count) * at_least(0, "ray_count", ray_count)
    return positive("disc_test", disc_test) * tests * (disc / outer) ** 2


@equation
def rebuild_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    ratio: ArrayLike = 2 / 3,
    sphere_test: ArrayLike = 1.0,
    form: str = "corrected",
) -> np.ndarray:
    """Cost of rebuilding spheres: T_R = sum of m_i t_i (paper, eq. 3).

    Corrected: t n_R / Q² · (n_P^(1/3) - 1) / (1 - Q). Printed: (n_P - 1)^(1/3) in its place, a slip,
    since the sum of Q^(-i) for i = 1…k is (Q^(-k) - 1) / (1 - Q), and Q^(-k) = n_P^(1/3).

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    ratio : number or array between 0 and 1; Q
    sphere_test : number or array, seconds; t
    form : the innermost sphere, at which the sum ends
        "corrected": the one that is rebuilt once per sample, Q^(-k) = n_P^(1/3), as in the paper.
        "printed": likewise, with the paper's slips. "spacing": the one as large as the disc of eq. 5,
        Q^(-k) = r_0 / d = (√3/2) n_P^(1/3); the sum is at least 0.

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    choice("form", form, FORMS)
    count, q = at_least(1, "sample_count", sample_count), fraction("ratio", ratio)
    if form == "printed":
        summed = np.cbrt(count - 1)
    elif form == "spacing":
        summed = np.maximum(GRID * np.cbrt(count) - 1, 0)
    else:
        summed = np.cbrt(count) - 1
    tests = at_least(0, "ray_count", ray_count) / q**2 * (summed / (1 - q))
    return positive("sphere_test", sphere_test) * tests


@equation
def best_ratio(spread: str = "volume") -> np.ndarray:
    """The ratio Q at which rebuilding costs least (paper, Proposition 1).

    Volume: 2/3, where 1 / (Q² (1 - Q)) is least. Surface: e^(-1/2) = 0.607, where
    1 / (Q² ln(1/Q)) is least (beyond the paper, see `surface_rebuild_cost`).

    Parameters
    ----------
    spread : "volume" or "surface": where the samples lie

    Returns
    -------
    number between 0 and 1

    Raises
    ------
    OptionError
        For an unknown `spread`.
    """
    choice("spread", spread, ("volume", "surface"))
    return np.asarray(2 / 3 if spread == "volume" else np.exp(-0.5))


@equation
def grid_radius(sample_count: ArrayLike, radius: ArrayLike) -> np.ndarray:
    """Radius of the sphere around a cubic grid of samples: r_0 = √3 d n_P^(1/3) / 2 (paper, eq. 4).

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    radius : number or array, metres; d, here also the distance between the samples

    Returns
    -------
    number or array, metres

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    return GRID * positive("radius", radius) * np.cbrt(at_least(1, "sample_count", sample_count))


@equation
def grid_spacing(sample_count: ArrayLike, outer_radius: ArrayLike) -> np.ndarray:
    """Distance between the samples of that grid, and disc radius: d = 2 r_0 / (√3 n_P^(1/3)) (paper, eq. 5).

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    outer_radius : number or array, metres; r_0

    Returns
    -------
    number or array, metres

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    return positive("outer_radius", outer_radius) / (
        GRID * np.cbrt(at_least(1, "sample_count", sample_count))
    )


@equation
def grid_inner_cost(sample_count: ArrayLike, ray_count: ArrayLike, disc_test: ArrayLike = 1.0) -> np.ndarray:
    """Cost of the disc tests for the discs of that grid: T_I = (4/3) u n_R n_P^(1/3) (paper, eq. 6).

    Eq. 2 with d of eq. 5.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    disc_test : number or array, seconds; u

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    return 4 / 3 * disc_index_cost(sample_count, ray_count, disc_test)


@equation
def cache_constant(
    ratio: ArrayLike = 2 / 3,
    sphere_test: ArrayLike = 1.0,
    disc_test: ArrayLike = 1.0,
    form: str = "corrected",
) -> np.ndarray:
    """Cost of the sphere cache per ray and n_P^(1/3), in the limit of many samples; the 8.08 of eq. 13.

    Corrected: t / (Q² (1 - Q)) + (4/3) u, 97/12 at Q = 2/3. Spacing: (√3/2) t / (Q² (1 - Q)) +
    (4/3) u, 7.18. Printed: 8.08 t, for Q = 2/3 and t = u.

    Parameters
    ----------
    ratio : number or array between 0 and 1; Q
    sphere_test, disc_test : numbers or arrays, seconds; t, u
    form : "corrected", "printed", or "spacing" as in `rebuild_cost`

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range, or "printed" with a Q other than 2/3 or a u other than t.
    """
    choice("form", form, FORMS)
    q = fraction("ratio", ratio)
    t, u = positive("sphere_test", sphere_test), positive("disc_test", disc_test)
    if form == "printed":
        if not (np.allclose(q, 2 / 3, rtol=0.01) and np.allclose(t, u, rtol=1e-9, atol=0)):
            raise OptionError(
                f"form: found 'printed' with ratio {ratio!r} and tests of {sphere_test!r} and {disc_test!r}, "
                "expected ratio 2/3 and sphere_test = disc_test, for which 8.08 was printed"
            )
        return PRINTED_CONSTANT * t
    return (GRID if form == "spacing" else 1.0) * t / (q**2 * (1 - q)) + 4 / 3 * u
