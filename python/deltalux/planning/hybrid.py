# SPDX-License-Identifier: Apache-2.0
"""The paper's hybrid estimate (section 4.1): upper spheres measured on few rays, lower ones by theory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux import _core, model
from deltalux.errors import OptionError
from deltalux.estimate.inputs import (
    SEGMENT_ENDS,
    check_choice,
    check_discs,
    core_discs,
    core_segments,
)
from deltalux.estimate.sphere_cache import ORDERS, check_ratio_and_rays, outer_radius
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, check_integer, check_threads

SPREADS = {"volume": 3, "surface": 2}  # rebuilds follow Q^(-dimension) (model.rebuilds, surface_rebuilds)


@dataclass(frozen=True, eq=False)
class HybridEstimate:
    """Predicted counts of a sphere cache over all segments; one number per level, S_0 first.

    Attributes
    ----------
    radii : (k + 1,) metres
    measured : (k + 1,) bool; False where theory was used
    rays : (k + 1,) mean length of the list of S_i over its builds, as `mean_rays` of `sphere_cache`
    rebuilds : (k + 1,) number of times that S_i is built; 0 for S_0
    level_tests : (k + 1,) sphere tests against S_i
    disc_tests : tests in the innermost lists of all samples
    pilot_sphere_tests : sphere tests of the measurement itself
    """

    radii: np.ndarray
    measured: np.ndarray
    rays: np.ndarray
    rebuilds: np.ndarray
    level_tests: np.ndarray
    disc_tests: float
    pilot_sphere_tests: int

    @property
    def sphere_tests(self) -> float:
        """Sphere tests of all levels."""
        return float(self.level_tests.sum())


def hybrid_estimate(
    segments: Segments,
    samples: Samples,
    ratio: float = 2 / 3,
    min_rays: int = 100,
    upper_levels: int = 4,
    divisor: int = 100,
    *,
    order: str = "hilbert",
    outer_sphere: tuple[Any, float] | None = None,
    segment_end: str = "bounded",
    spread: str = "volume",
    threads: int | None = None,
    progress: Progress | None = None,
) -> HybridEstimate:
    """Predict the counts of `dl.estimate.sphere_cache` as section 4.1 of the paper proposes.

    The cache runs through all samples on every `divisor`-th segment, with its upper levels only and
    without testing a disc. Below level U = `upper_levels`, theory extrapolates from the counts there:
    n_i = n_U Q^(2(i-U)) rays (`model.rays_in_sphere`), m_i = m_U Q^(-3(i-U)) rebuilds, at most one per
    sample, reduced where lists are shorter than `min_rays` (`model.divided_share`, for as many uniform
    lines as give n_U rays). Disc tests are the expected lengths of the innermost lists.

    Parameters
    ----------
    segments, samples : as in `sphere_cache`
    ratio, min_rays, order, outer_sphere, segment_end : options of that cache
    upper_levels : integer from 1; number of measured levels
    divisor : integer from 1; the pilot uses every divisor-th segment, and min_rays / divisor (at least 1)
    spread : "volume", m_i ~ Q^(-3i) as in the paper, or "surface", m_i ~ Q^(-2i)
    threads, progress : as elsewhere; counts do not depend on threads

    Returns
    -------
    HybridEstimate

    Raises
    ------
    OptionError
        For options out of range, and fewer segments than `divisor`.
    """
    check_choice("segment_end", segment_end, SEGMENT_ENDS)
    check_choice("order", order, ORDERS)
    check_choice("spread", spread, tuple(SPREADS))
    ratio, min_rays = check_ratio_and_rays(ratio, min_rays)
    check_integer("upper_levels", upper_levels, 1, 10_000)
    check_integer("divisor", divisor, 1, 2**32 - 1)
    check_discs(samples)
    check_threads(threads)
    if len(segments) < divisor:
        raise OptionError(f"divisor: found {divisor}, expected at most the {len(segments)} segments")
    arrays, discs = core_segments(segments), core_discs(samples, segments)
    outer = outer_radius(outer_sphere) or _core.enclosing_radius(arrays, segment_end, samples.radius.max())
    pilot = _core.sphere_cache_upper(
        core_segments(segments.select(slice(divisor // 2, None, divisor))),
        discs,
        segment_end,
        ratio,
        max(1, round(min_rays / divisor)),
        order,
        outer,
        upper_levels,
        threads or 0,
        progress,
    )
    depth = _depths(samples.radius, outer, ratio)
    scale = len(segments) / pilot["rays"][0]
    return _continue(
        pilot, scale, outer * ratio ** np.arange(depth.max() + 1), depth, ratio, min_rays, spread
    )


def _depths(radius: np.ndarray, outer: float, ratio: float) -> np.ndarray:
    """(n,) level of the smallest sphere that is larger than each disc."""
    depth = np.zeros(len(radius), int)
    inside = radius < outer
    depth[inside] = model.levels_above_disc(outer, radius[inside], ratio)
    return depth


def _continue(
    pilot: dict[str, Any],
    scale: float,
    radii: np.ndarray,
    depth: np.ndarray,
    ratio: float,
    min_rays: int,
    spread: str,
) -> HybridEstimate:
    """Scale the measured levels up, and extrapolate below them by theory."""
    count = len(radii)
    known = min(len(pilot["radii"]), count)
    rebuilds, tests, rays = np.zeros(count), np.zeros(count), np.zeros(count)
    rebuilds[:known] = pilot["rebuilds"][:known]
    tests[:known] = np.multiply(pilot["level_tests"][:known], scale)
    builds = np.maximum(1, [1, *pilot["rebuilds"][1:known]])
    rays[:known] = np.divide(pilot["rays"][:known], builds) * scale
    last = known - 1
    lists = _Lists(round(rays[last] * ratio ** (-2 * last)), ratio, min_rays)
    # The number of rebuilds if every list were long enough to be divided.
    wished = rebuilds[last] / max(lists.built(last), rebuilds[last] / len(depth)) if rebuilds[last] else 0.0
    for level in range(known, count):
        deep_enough = float((depth >= level).sum())
        growth = ratio ** (-SPREADS[spread] * (level - last))
        rebuilds[level] = min(wished * growth, deep_enough) * lists.built(level)
        tests[level] = rebuilds[level] * lists.divided_length(level - 1)
        rays[level] = ratio**2 * lists.divided_length(level - 1)
    disc_tests = sum(
        (depth == level).sum() * (rays[level] if level <= last else lists.innermost_length(level))
        for level in np.unique(depth)
    )
    measured = np.arange(count) < known
    return HybridEstimate(
        radii, measured, rays, rebuilds, tests, float(disc_tests), int(sum(pilot["level_tests"]))
    )


class _Lists:
    """Lengths N_i of the lists of S_i for uniform lines: binomial with probability Q^(2i).

    Parameters
    ----------
    lines : number of lines
    ratio, min_rays : of the cache
    """

    def __init__(self, lines: int, ratio: float, min_rays: int) -> None:
        self._lines, self._ratio, self._least = lines, ratio, min_rays

    def built(self, level: int) -> float:
        """Probability that S_level is built, because the list around it is long enough."""
        return 1.0 if level == 0 else self._long(self._lines, level - 1, self._least)

    def divided_length(self, level: int) -> float:
        """Mean length of the lists of S_level that are divided; 0 if none is."""
        share = self._long(self._lines, level, self._least)
        return self._divided_part(level) / share if share > 0 else 0.0

    def innermost_length(self, depth: int) -> float:
        """Mean length of the list that a disc is tested against; `depth` is the last level it can have."""
        # E[N_i; N_i < min_rays, N_(i-1) >= min_rays] summed over the levels at which a walk can end:
        # a segment of S_(i-1) is in S_i with probability Q².
        inside = self._ratio**2
        total = previous = self._short_part(0)
        for level in range(1, depth):
            short = self._short_part(level)
            total += short - inside * previous
            previous = short
        return total + self._mean(depth) - inside * previous if depth else float(self._lines)

    def _mean(self, level: int) -> float:
        return float(model.rays_in_sphere(self._lines, self._ratio, level))

    def _divided_part(self, level: int) -> float:
        """E[N; N >= min_rays]."""
        return self._mean(level) * self._long(self._lines - 1, level, self._least - 1)

    def _short_part(self, level: int) -> float:
        """E[N; N < min_rays]."""
        return self._mean(level) - self._divided_part(level)

    def _long(self, lines: int, level: int, least: int) -> float:
        """P(N >= least)."""
        if least < 1:
            return 1.0
        return float(model.divided_share(max(lines, 0), self._ratio, level, least))
