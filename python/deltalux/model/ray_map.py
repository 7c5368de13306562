# SPDX-License-Identifier: Apache-2.0
"""Cost of a ray map in disc mode for samples in a volume (beyond the paper: its future work, 5.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .checks import at_least, equation, positive

# A cube of side a meets 6 a² / (4 π r_0²) of the segments; with a = d of eq. 5, 2 / (π n_P^(2/3)).
SHARE = 2 / np.pi
# Mean number of cells that the box of a disc of radius a meets, over positions and directions of its
# normal n: the mean of the product of 1 + 2 (1 - n_k²)^(1/2) over the axes k.
CELLS = 16.205440
# Three cuts of the cubes of one level halve their side; each cut sorts their segments. Before the cuts,
# the cells (cube, halves, quarters) have total areas of 6, 8 and 10 faces of the cube.
CUTS = (6 + 8 + 10) / 6


@equation
def ray_map_cost(
    sample_count: ArrayLike, ray_count: ArrayLike, sort_test: ArrayLike = 1.0, disc_test: ArrayLike = 1.0
) -> np.ndarray:
    """Cost of a lazily built ray map, T = n_R ((8/π) v (n_P^(1/3) - 1) + 10.3 u n_P^(1/3)).

    Beyond the paper, under its assumptions: segments are uniform lines, and disc radii equal the
    distance between samples (eq. 5). The cube of eq. 4 is halved along each axis in turn, down to
    cells of side d; every cut sorts the segments of its cell into its halves. A disc is tested against
    the segments of all cells that its box meets. Valid while cells of side d hold more segments than a
    leaf may.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : number or array from 0; n_R
    sort_test, disc_test : numbers or arrays, seconds; v, time to sort a segment at a cut; u

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    side = np.cbrt(at_least(1, "sample_count", sample_count))
    sorting = positive("sort_test", sort_test) * CUTS * SHARE * (side - 1)
    testing = positive("disc_test", disc_test) * CELLS * SHARE * side
    return at_least(0, "ray_count", ray_count) * (sorting + testing)
