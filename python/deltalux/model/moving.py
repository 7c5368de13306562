# SPDX-License-Identifier: Apache-2.0
"""Cost of an update after an object moved, static and moving samples (paper 3.2, equations 11 to 18)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from deltalux.errors import OptionError

from .checks import FORMS, at_least, choice, equation, fraction, positive, within
from .costs import GRID, disc_index_cost, sphere_cache_cost

PRINTED_CONSTANT = 8.08
PRINTED_CROSSOVER = 0.35


@equation
def affected_rays(ray_count: ArrayLike, object_radius: ArrayLike, outer_radius: ArrayLike) -> np.ndarray:
    """Rays that meet the object's sphere: ñ_R = n_R r_D² / r_0² (paper, eq. 11).

    About so many are old, and about so many new. The share is `meeting_probability` of the spheres.

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
    """Cost of an update of the static samples by the sphere cache (paper, eq. 12).

    Corrected: eq. 1 for 2 ñ_R rays, the old and the new ones. Printed:
    (t ñ_R n_S^(1/3) - 1) / Q² + (4/3) u ñ_R n_S^(1/3), which lost the factor 1 / (1 - Q), counts one
    ñ_R where eq. 14 counts two, and takes 1 from a time: use it with t = 1 only.

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
        For arguments out of range, or a printed form at another Q or u.
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
        For arguments out of range, or a printed form at another Q or u.
    """
    passes = 1 if form == "printed" else 2
    constant = cache_constant(ratio, sphere_test, disc_test, form)
    return passes * constant * disc_index_cost(sample_count, at_least(0, "affected_count", affected_count))


@equation
def static_index_cost(
    sample_count: ArrayLike, affected_count: ArrayLike, disc_test: ArrayLike = 1.0
) -> np.ndarray:
    """Cost of an update of the static samples by disc indexing: T = 2 t ñ_R n_S^(1/3) (paper, eq. 14).

    Eq. 10 for old and new rays, index built before. The paper writes t, having set t = u; it is u.

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

    Corrected: eq. 1 for ñ_R rays, in the object's sphere. Neither counts how the ñ_R rays are found:
    with `ray_count`, one sphere test for each of all rays is added.

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
        For arguments out of range, or a printed form at another Q or u.
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

    The paper lets every ray pay the whole way. An index turns away at its root the rays that miss the
    object: with `affected_count`, the cost is u (n_R + ñ_R n_D^(1/3)), less than that of the sphere
    cache at every size of the object. The rebuild of the index in each frame, which a rigid motion
    does not need, is in neither.

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

    The left side of eq. 16 over its right side, so that both equations ask where this is 1; below 1
    the sphere cache is faster, by the paper's counts.

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
        For arguments out of range, r_D above r_0, or a printed form at another Q or u.
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

    Solves eq. 17. Corrected: (12/97)^(1/2) = 0.352; spacing: 0.373. What a real sphere cache does is
    in `measured_crossover`; against an index that rejects rays at its root (`moving_index_cost` with
    `affected_count`) there is none.

    Parameters
    ----------
    ratio, sphere_test, disc_test, form : as in `cache_constant`

    Returns
    -------
    number or array, without unit; above 1: the sphere cache is faster at every size

    Raises
    ------
    OptionError
        For arguments out of range, or a printed form at another Q or u.
    """
    constant = cache_constant(ratio, sphere_test, disc_test, form)
    if form == "printed":
        return np.full_like(constant, PRINTED_CROSSOVER)
    return np.sqrt(positive("disc_test", disc_test) / constant)
