# SPDX-License-Identifier: Apache-2.0
"""Cost of updating the static samples after an object moved (paper 3.2, equations 11 to 14)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .cache_costs import cache_constant, sphere_cache_cost
from .checks import FORMS, at_least, choice, equation, fraction, positive, within
from .index_costs import disc_index_cost


@equation
def affected_rays(ray_count: ArrayLike, object_radius: ArrayLike, outer_radius: ArrayLike) -> np.ndarray:
    """Rays that meet the object's sphere: ñ_R = n_R r_D² / r_0² (paper, eq. 11).

    A move removes about this many old rays and adds about this many new ones. The share is the
    `meeting_probability` of the spheres.

    Parameters
    ----------
    ray_count : number or array from 0; n_R
    object_radius, outer_radius : numbers or arrays, metres; r_D, r_0

    Returns
    -------
    number or array of rays

    Raises
    ------
    OptionError
        For arguments out of range, or r_D above r_0.
    """
    inner, outer = positive("object_radius", object_radius), positive("outer_radius", outer_radius)
    within("object_radius", inner, "outer_radius", outer)
    return at_least(0, "ray_count", ray_count) * (inner / outer) ** 2


@equation
def static_cache_cost(
    sample_count: ArrayLike,
    affected_count: ArrayLike,
    ratio: ArrayLike = 2 / 3,
    sphere_test: ArrayLike = 1.0,
    disc_test: ArrayLike = 1.0,
    form: str = "corrected",
) -> np.ndarray:
    """Cost of updating the static samples by the sphere cache (paper, eq. 12).

    Corrected: eq. 1 for 2 ñ_R rays, the old and the new ones. Printed:
    (t ñ_R n_S^(1/3) - 1) / Q² + (4/3) u ñ_R n_S^(1/3), which lacks the factor 1 / (1 - Q), counts one
    ñ_R where eq. 14 counts two, and subtracts 1 from a time: use it with t = 1 only.

    Parameters
    ----------
    sample_count : number or array from 1; n_S
    affected_count : number or array from 0; ñ_R of `affected_rays`
    ratio : number or array between 0 and 1; Q
    sphere_test, disc_test : numbers or arrays, seconds; t, u
    form : "corrected", "printed", or "spacing" as in `rebuild_cost`

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    choice("form", form, FORMS)
    rays = at_least(0, "affected_count", affected_count)
    if form != "printed":
        return sphere_cache_cost(sample_count, 2 * rays, ratio, sphere_test, disc_test, form)
    sphere_tests = positive("sphere_test", sphere_test) * disc_index_cost(sample_count, rays)
    misses = (sphere_tests - 1) / fraction("ratio", ratio) ** 2
    return misses + 4 / 3 * disc_index_cost(sample_count, rays, disc_test)


@equation
def static_cache_limit(
    sample_count: ArrayLike,
    affected_count: ArrayLike,
    ratio: ArrayLike = 2 / 3,
    sphere_test: ArrayLike = 1.0,
    disc_test: ArrayLike = 1.0,
    form: str = "corrected",
) -> np.ndarray:
    """Eq. 12 for many samples: T = 8.08 t ñ_R n_S^(1/3) as printed (paper, eq. 13).

    Corrected: twice that, for old and new rays, with the exact `cache_constant`.

    Parameters
    ----------
    sample_count : number or array from 1; n_S
    affected_count : number or array from 0; ñ_R
    ratio, sphere_test, disc_test, form : as in `cache_constant`

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range, or "printed" with a Q other than 2/3 or a u other than t.
    """
    passes = 1 if form == "printed" else 2
    constant = cache_constant(ratio, sphere_test, disc_test, form)
    return passes * constant * disc_index_cost(sample_count, at_least(0, "affected_count", affected_count))


@equation
def static_index_cost(
    sample_count: ArrayLike, affected_count: ArrayLike, disc_test: ArrayLike = 1.0
) -> np.ndarray:
    """Cost of updating the static samples by disc indexing: T = 2 t ñ_R n_S^(1/3) (paper, eq. 14).

    Eq. 10 for old and new rays, with an index built before. The paper writes t for u, since it set t = u.

    Parameters
    ----------
    sample_count : number or array from 1; n_S
    affected_count : number or array from 0; ñ_R
    disc_test : number or array, seconds; u

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    return 2 * disc_index_cost(sample_count, at_least(0, "affected_count", affected_count), disc_test)
