# SPDX-License-Identifier: Apache-2.0
"""Cost of disc indexing for samples in a volume (paper 3.1, equations 7 to 10)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .checks import at_least, equation, positive


@equation
def deep_index_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    depth: ArrayLike,
    disc_test: ArrayLike = 1.0,
    traversal: bool = False,
) -> np.ndarray:
    """Cost of disc indexing in a tree of depth k: u n_R n_P / 4^k (paper, eq. 8; k times that, eq. 7).

    A ray that meets a voxel meets one of its eight children with probability 1/4.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    depth : number or array from 0; k of eq. 7 to 9
    disc_test : number or array, seconds; u
    traversal : True: eq. 7, u k n_R n_P / 4^k. False: eq. 8, which neglects the traversal down to a voxel

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    k = at_least(0, "depth", depth)
    rays, discs = at_least(0, "ray_count", ray_count), at_least(1, "sample_count", sample_count)
    return positive("disc_test", disc_test) * (k if traversal else 1.0) * (rays * discs / 4.0**k)


@equation
def index_depth(sample_count: ArrayLike) -> np.ndarray:
    """Depth at which a voxel is as wide as the samples' distance: k = log2 n_P^(1/3) (paper, eq. 9).

    Parameters
    ----------
    sample_count : number or array from 1; n_P

    Returns
    -------
    number or array of levels, not rounded

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    return np.log2(at_least(1, "sample_count", sample_count)) / 3


@equation
def disc_index_cost(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    disc_test: ArrayLike = 1.0,
    traversal: bool = False,
) -> np.ndarray:
    """Cost of disc indexing, T = u n_R n_P^(1/3) (paper, eq. 10 and Theorem 1).

    Eq. 8 at the depth of eq. 9.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    disc_test : number or array, seconds; u
    traversal : True keeps the factor k = log2 n_P^(1/3) of eq. 7, which the paper drops at eq. 8

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    count, rays = at_least(1, "sample_count", sample_count), at_least(0, "ray_count", ray_count)
    steps = index_depth(count) if traversal else 1.0
    return positive("disc_test", disc_test) * steps * rays * np.cbrt(count)
