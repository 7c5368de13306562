# SPDX-License-Identifier: Apache-2.0
"""Cost of the samples on a moved object, and the size at which methods tie (paper 3.2, eq. 15 to 18)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .cache_costs import cache_constant, sphere_cache_cost
from .checks import FORMS, at_least, choice, equation, positive, within
from .index_costs import disc_index_cost
from .static_update import affected_rays

PRINTED_CROSSOVER = 0.35


@equation
def moving_cache_cost(
    sample_count: ArrayLike,
    affected_count: ArrayLike,
    ratio: ArrayLike = 2 / 3,
    sphere_test: ArrayLike = 1.0,
    disc_test: ArrayLike = 1.0,
    form: str = "corrected",
    ray_count: ArrayLike = 0,
) -> np.ndarray:
    """Cost of the moving samples by the sphere cache: 8.08 t ñ_R n_D^(1/3) as printed (paper, eq. 15).

    Corrected: eq. 1 for ñ_R rays, in the object's sphere. Neither counts the search for these rays:
    `ray_count` adds one sphere test for each of all rays.

    Parameters
    ----------
    sample_count : number or array from 1; n_D
    affected_count : number or array from 0; ñ_R, n_R r_D² / r_0² of `affected_rays`
    ratio, sphere_test, disc_test, form : as in `cache_constant`
    ray_count : number or array; 0, or n_R to count the tests against the object's sphere

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range, or "printed" with a Q other than 2/3 or a u other than t.
    """
    choice("form", form, FORMS)
    rays = at_least(0, "affected_count", affected_count)
    finding = positive("sphere_test", sphere_test) * at_least(0, "ray_count", ray_count)
    if form == "printed":
        constant = cache_constant(ratio, sphere_test, disc_test, form)
        return finding + constant * disc_index_cost(sample_count, rays)
    return finding + sphere_cache_cost(sample_count, rays, ratio, sphere_test, disc_test, form)


@equation
def moving_index_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    disc_test: ArrayLike = 1.0,
    affected_count: ArrayLike | None = None,
) -> np.ndarray:
    """Cost of the moving samples by disc indexing: t n_R n_D^(1/3) (paper, right side of eq. 16).

    The paper charges every ray the full traversal. A real index rejects the rays that miss the object
    at its root: with `affected_count`, the cost is u (n_R + ñ_R n_D^(1/3)). Unless t is far below u,
    that is less than `moving_cache_cost` with its `ray_count`, at every size of the object. Neither
    includes rebuilding the index in each frame, which a rigid motion does not need.

    Parameters
    ----------
    sample_count : number or array from 1; n_D
    ray_count : number or array from 0; n_R
    disc_test : number or array, seconds; u (printed as t)
    affected_count : number or array, at most n_R, or None; ñ_R of `affected_rays`

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    if affected_count is None:
        return disc_index_cost(sample_count, ray_count, disc_test)
    rays, met = at_least(0, "ray_count", ray_count), at_least(0, "affected_count", affected_count)
    within("affected_count", met, "ray_count", rays)
    return positive("disc_test", disc_test) * rays + disc_index_cost(sample_count, met, disc_test)


@equation
def moving_cost_ratio(
    object_radius: ArrayLike,
    outer_radius: ArrayLike,
    ratio: ArrayLike = 2 / 3,
    sphere_test: ArrayLike = 1.0,
    disc_test: ArrayLike = 1.0,
    form: str = "corrected",
) -> np.ndarray:
    """Cost of the sphere cache over that of disc indexing, moving samples: 8.08 r_D² / r_0² (paper, eq. 17).

    The left side of eq. 16 over its right side; both equations set it to 1. Below 1 the sphere cache
    is faster, by the paper's counts.

    Parameters
    ----------
    object_radius, outer_radius : numbers or arrays, metres; r_D, r_0
    ratio, sphere_test, disc_test, form : as in `cache_constant`

    Returns
    -------
    number or array, without unit

    Raises
    ------
    OptionError
        For arguments out of range, r_D above r_0, or "printed" with a Q other than 2/3 or a u other than t.
    """
    constant = cache_constant(ratio, sphere_test, disc_test, form)
    return constant / positive("disc_test", disc_test) * affected_rays(1, object_radius, outer_radius)


@equation
def crossover(
    ratio: ArrayLike = 2 / 3,
    sphere_test: ArrayLike = 1.0,
    disc_test: ArrayLike = 1.0,
    form: str = "corrected",
) -> np.ndarray:
    """Size r_D / r_0 of the object at which both methods cost the same: 0.35 as printed (paper, eq. 18).

    Solves eq. 17. Corrected: (12/97)^(1/2) = 0.352; spacing: 0.373. For a real sphere cache
    see `measured_crossover`; with an index that rejects rays at its root (`moving_index_cost` with
    `affected_count`) there is no crossover.

    Parameters
    ----------
    ratio, sphere_test, disc_test, form : as in `cache_constant`

    Returns
    -------
    number or array, without unit; above 1: the sphere cache is faster at every size

    Raises
    ------
    OptionError
        For arguments out of range, or "printed" with a Q other than 2/3 or a u other than t.
    """
    constant = cache_constant(ratio, sphere_test, disc_test, form)
    if form == "printed":
        return np.full_like(constant, PRINTED_CROSSOVER)
    return np.sqrt(positive("disc_test", disc_test) / constant)
