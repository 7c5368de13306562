# SPDX-License-Identifier: Apache-2.0
"""Costs for samples on surfaces: at most logarithmic in the sample count (beyond the paper).

They follow the derivations of paper 3.1 with areas in place of volumes: for n_P samples at distances d
on an area A, n_P d² = A. `area` is A / r_0², by default 8: the walls of the cube of eq. 4, whose corners
touch S_0.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from .checks import at_least, equation, fraction, positive, whole

CUBE_WALLS = 8.0  # 6 (2 / √3)²
BEST_RATIO = math.exp(-0.5)


@equation
def surface_rebuilds(ratio: ArrayLike, level: ArrayLike, area: ArrayLike = CUBE_WALLS) -> np.ndarray:
    """Rebuilds of sphere S_i for samples on surfaces: m_i = A / r_i² = (A / r_0²) Q^(-2i).

    Parameters
    ----------
    ratio : number or array between 0 and 1; Q
    level : integer or array from 1; i
    area : number or array, in units of r_0²; A

    Returns
    -------
    number or array of rebuilds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    return positive("area", area) * fraction("ratio", ratio) ** (-2 * whole("level", level, 1))


@equation
def surface_levels(sample_count: ArrayLike, ratio: ArrayLike, area: ArrayLike = CUBE_WALLS) -> np.ndarray:
    """Number k of spheres below S_0 for samples on surfaces: ln(n_P r_0² / A) / (2 ln(1/Q)).

    The innermost sphere is as large as a disc and rebuilt once per sample; at least 0.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ratio : number or array between 0 and 1; Q
    area : number or array, in units of r_0²

    Returns
    -------
    number or array of levels, not rounded

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    steps = np.log(at_least(1, "sample_count", sample_count) / positive("area", area))
    return np.maximum(0, steps) / (-2 * np.log(fraction("ratio", ratio)))


@equation
def surface_rebuild_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    ratio: ArrayLike = BEST_RATIO,
    sphere_test: ArrayLike = 1.0,
    area: ArrayLike = CUBE_WALLS,
) -> np.ndarray:
    """Cost of rebuilding spheres for samples on surfaces: T_R = (A / r_0²) k t n_R / Q².

    The sum of m_i t_i, as in eq. 3: here every level costs the same. With k of `surface_levels` it
    grows with ln n_P, and is least where Q² ln(1/Q) is greatest, at Q = e^(-1/2).

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    ratio : number or array between 0 and 1; Q
    sphere_test : number or array, seconds; t. With 1 the result counts tests
    area : number or array, in units of r_0²

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    per_level = positive("area", area) * at_least(0, "ray_count", ray_count) / fraction("ratio", ratio) ** 2
    return positive("sphere_test", sphere_test) * per_level * surface_levels(sample_count, ratio, area)


@equation
def surface_inner_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    disc_test: ArrayLike = 1.0,
    area: ArrayLike = CUBE_WALLS,
) -> np.ndarray:
    """Cost of the disc tests for samples on surfaces: T_I = (A / r_0²) u n_R, independent of n_P.

    Eq. 2 with n_P d² = A; u n_P n_R where discs would be larger than S_0.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    disc_test : number or array, seconds; u
    area : number or array, in units of r_0²

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    lists = np.minimum(at_least(1, "sample_count", sample_count), positive("area", area))
    return positive("disc_test", disc_test) * at_least(0, "ray_count", ray_count) * lists


@equation
def surface_cache_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    ratio: ArrayLike = BEST_RATIO,
    sphere_test: ArrayLike = 1.0,
    disc_test: ArrayLike = 1.0,
    area: ArrayLike = CUBE_WALLS,
) -> np.ndarray:
    """Cost of the sphere cache for samples on surfaces: `surface_inner_cost` + `surface_rebuild_cost`.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    ratio : number or array between 0 and 1; Q
    sphere_test, disc_test : numbers or arrays, seconds; t, u
    area : number or array, in units of r_0²

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    inner = surface_inner_cost(sample_count, ray_count, disc_test, area)
    return inner + surface_rebuild_cost(sample_count, ray_count, ratio, sphere_test, area)


@equation
def surface_index_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    disc_test: ArrayLike = 1.0,
    area: ArrayLike = CUBE_WALLS,
    traversal: bool = False,
) -> np.ndarray:
    """Cost of disc indexing for samples on surfaces: T = (3/4) (A / r_0²) u n_R, independent of n_P.

    Eq. 8 at the depth where a voxel of the cube of eq. 4 is as large as d: 4^k = (4/3) n_P r_0² / A;
    at depth 0 where that is less than 1.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    disc_test : number or array, seconds; u
    area : number or array, in units of r_0²
    traversal : True keeps the factor k of eq. 7, and with it the logarithm of n_P

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    count = at_least(1, "sample_count", sample_count)
    cells = np.maximum(1, 4 / 3 * count / positive("area", area))
    steps = np.log2(cells) / 2 if traversal else 1.0
    rays = at_least(0, "ray_count", ray_count)
    return positive("disc_test", disc_test) * steps * rays * (count / cells)


@equation
def surface_crossover(
    sample_count: ArrayLike,
    ratio: ArrayLike = BEST_RATIO,
    sphere_test: ArrayLike = 1.0,
    disc_test: ArrayLike = 1.0,
    area: ArrayLike = CUBE_WALLS,
    traversal: bool = False,
) -> np.ndarray:
    """Size r_D / r_0 at which both methods cost the same for moving samples on surfaces, as eq. 18.

    There, the sphere cache for the affected rays, a share of r_D² / r_0², costs as much as disc
    indexing for all rays. The size shrinks as n_D grows, unlike the paper's 0.35; with `traversal` it
    tends to a constant.

    Parameters
    ----------
    sample_count : number or array from 1; n_D
    ratio, sphere_test, disc_test : as in `surface_cache_cost`
    area : number or array; area of the object's samples in units of r_D²
    traversal : as in `surface_index_cost`

    Returns
    -------
    number or array, without unit; above 1: the sphere cache is faster at every size

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    index = surface_index_cost(sample_count, 1, disc_test, area, traversal)
    return np.sqrt(index / surface_cache_cost(sample_count, 1, ratio, sphere_test, disc_test, area))
