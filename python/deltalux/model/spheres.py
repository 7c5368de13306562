# SPDX-License-Identifier: Apache-2.0
"""One sphere of the sphere cache: its radius, rays, rebuilds and their cost (paper 3.1, Table 1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import betainc

from .checks import at_least, equation, fraction, positive, whole, within


@equation
def meeting_probability(inner_area: ArrayLike, outer_area: ArrayLike) -> np.ndarray:
    """Probability that a uniform line that meets a convex body also meets another one inside it.

    Paper 3.1, from Santaló, Integral Geometry and Geometric Probability, 2002: the ratio of the areas.

    Parameters
    ----------
    inner_area, outer_area : numbers or arrays, m²
        Areas of the bodies' surfaces. A flat disc has two sides: 2 π d².

    Returns
    -------
    number or array, without unit

    Raises
    ------
    OptionError
        For areas that are not positive, or an inner one larger than the outer one.
    """
    inner, outer = positive("inner_area", inner_area), positive("outer_area", outer_area)
    within("inner_area", inner, "outer_area", outer)
    return inner / outer


@equation
def sphere_radius(outer_radius: ArrayLike, ratio: ArrayLike, level: ArrayLike) -> np.ndarray:
    """Radius r_i = r_0 Q^i of sphere S_i (paper, Table 1).

    Parameters
    ----------
    outer_radius : number or array, metres; r_0 of the scene sphere
    ratio : number or array between 0 and 1; Q
    level : integer or array from 0; i

    Returns
    -------
    number or array, metres

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    return positive("outer_radius", outer_radius) * fraction("ratio", ratio) ** whole("level", level, 0)


@equation
def rays_in_sphere(ray_count: ArrayLike, ratio: ArrayLike, level: ArrayLike) -> np.ndarray:
    """Mean number of rays that meet sphere S_i: n_R Q^(2i) (paper 3.1 and 4.1).

    The ratio of the spheres' areas, `meeting_probability`; exact for uniform lines and a sphere that
    lies within S_0. In real scenes the count differs by a factor that tends to a constant inward, so
    that the ratio of consecutive levels does converge: for the hybrid estimate of paper 4.1 give the
    count measured in an upper sphere as `ray_count`, and the levels below it as `level`.

    At the paper's 1024² rays and Q = 0.6 level 9 has 106.5 rays; the paper prints 94.6 (section 4.2).

    Parameters
    ----------
    ray_count : number or array from 0; n_R
    ratio : number or array between 0 and 1; Q
    level : integer or array from 0; i

    Returns
    -------
    number or array of rays

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    return at_least(0, "ray_count", ray_count) * fraction("ratio", ratio) ** (2 * whole("level", level, 0))


@equation
def rebuild_time(
    ray_count: ArrayLike, ratio: ArrayLike, level: ArrayLike, sphere_test: ArrayLike = 1.0
) -> np.ndarray:
    """Cost of one rebuild of sphere S_i: t_i = t n_R Q^(2i-2) (paper, Table 1).

    Each ray of S_(i-1) is tested.

    Parameters
    ----------
    ray_count : number or array from 0; n_R
    ratio : number or array between 0 and 1; Q
    level : integer or array from 1; i. S_0 is never rebuilt
    sphere_test : number or array, seconds; t. With 1 the result counts sphere tests

    Returns
    -------
    number or array, seconds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    above = whole("level", level, 1) - 1
    return positive("sphere_test", sphere_test) * rays_in_sphere(ray_count, ratio, above)


@equation
def rebuilds(ratio: ArrayLike, level: ArrayLike) -> np.ndarray:
    """Rebuilds of sphere S_i for samples in a volume, visited along a curve: m_i = Q^(-3i) (paper, eq. 3).

    m_i cubes of side r_0 Q^i fill a cube of side r_0. The paper does not print m_i; of all powers of
    Q only this one gives the sum in eq. 3. For samples on surfaces see `surface_rebuilds`.

    Parameters
    ----------
    ratio : number or array between 0 and 1; Q
    level : integer or array from 0; i

    Returns
    -------
    number or array of rebuilds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    return fraction("ratio", ratio) ** (-3 * whole("level", level, 0))


@equation
def levels(sample_count: ArrayLike, ratio: ArrayLike) -> np.ndarray:
    """Number k of spheres below S_0 at which the innermost one is rebuilt once per sample (paper, eq. 3).

    Solves m_k = n_P, that is Q^(-k) = n_P^(1/3); it need not be whole.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ratio : number or array between 0 and 1; Q

    Returns
    -------
    number or array of levels

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    count, q = at_least(1, "sample_count", sample_count), fraction("ratio", ratio)
    return np.log(count) / (-3 * np.log(q))


@equation
def levels_above_disc(outer_radius: ArrayLike, radius: ArrayLike, ratio: ArrayLike) -> np.ndarray:
    """Number of spheres below S_0 in a sphere cache: the last r_0 Q^i is larger than d (paper 2.3).

    Parameters
    ----------
    outer_radius : number or array, metres; r_0
    radius : number or array, metres, below r_0; d
    ratio : number or array between 0 and 1; Q

    Returns
    -------
    whole number or array

    Raises
    ------
    OptionError
        For arguments out of range, or a disc larger than S_0.
    """
    outer, disc = positive("outer_radius", outer_radius), positive("radius", radius)
    q = fraction("ratio", ratio)
    within("radius", disc, "outer_radius", outer)
    depth = np.log(outer / disc) / -np.log(q)
    nearest = np.round(depth)
    # A sphere as large as the disc does not count; the tolerance keeps rounding from deciding that.
    alike = np.abs(depth - nearest) < 1e-9 * (1 + nearest)
    return np.maximum(0, np.where(alike, nearest - 1, np.floor(depth)))


@equation
def divided_share(
    ray_count: ArrayLike, ratio: ArrayLike, level: ArrayLike, min_rays: ArrayLike = 100
) -> np.ndarray:
    """Probability that S_i holds at least `min_rays` rays, so that S_(i+1) is built in it (paper 2.3).

    The number of n_R uniform lines in S_i is binomial with probability Q^(2i).

    Parameters
    ----------
    ray_count : integer or array from 0; n_R
    ratio : number or array between 0 and 1; Q
    level : integer or array from 0; i
    min_rays : integer or array from 1

    Returns
    -------
    number or array between 0 and 1

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    lines, least = whole("ray_count", ray_count, 0), whole("min_rays", min_rays, 1)
    inside = rays_in_sphere(1, ratio, level)
    enough = lines >= least
    return np.where(enough, betainc(least, np.where(enough, lines - least + 1, 1), inside), 0.0)


@equation
def limited_rebuilds(
    sample_count: ArrayLike,
    ray_count: ArrayLike,
    ratio: ArrayLike,
    level: ArrayLike,
    min_rays: ArrayLike = 100,
) -> np.ndarray:
    """Rebuilds m_i of S_i where short lists are not subdivided; beyond the paper, for its Figure 9.

    The smaller of `rebuilds` and n_P, times the share of enclosing spheres that are subdivided. At the
    paper's 1024² rays and Q = 0.6 it rises up to level 9 and falls after it, for up to a million
    samples; the paper does not state its number of samples.

    Parameters
    ----------
    sample_count : number or array from 1; n_P
    ray_count : integer or array from 0; n_R
    ratio : number or array between 0 and 1; Q
    level : integer or array from 1; i
    min_rays : integer or array from 1

    Returns
    -------
    number or array of rebuilds

    Raises
    ------
    OptionError
        For arguments out of range.
    """
    above = whole("level", level, 1) - 1
    # Computed from logarithms, since Q^(-3i) may overflow.
    wished = -3 * (above + 1) * np.log(fraction("ratio", ratio))
    most = np.log(at_least(1, "sample_count", sample_count))
    return np.exp(np.minimum(wished, most)) * divided_share(ray_count, ratio, above, min_rays)
