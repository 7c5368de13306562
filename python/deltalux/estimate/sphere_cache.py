# SPDX-License-Identifier: Apache-2.0
"""Sphere cache: segment lists in nested spheres around the current sample."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux import _core
from deltalux.errors import OptionError
from deltalux.results import Estimate
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, check_integer

from .inputs import (
    FARTHEST,
    SEGMENT_ENDS,
    check_choice,
    check_discs,
    core_discs,
    core_segments,
    disc_estimate,
    select_segments,
)

ORDERS = ("none", "lebesgue", "hilbert")
CONTAINMENTS = ("all", "nested", "literal")


def sphere_cache(
    segments: Segments,
    samples: Samples,
    ratio: float = 2 / 3,
    min_rays: int = 100,
    order: str = "hilbert",
    containment: str = "all",
    outer_sphere: tuple[Any, float] | None = None,
    *,
    segment_end: str = "bounded",
    first_bounce: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Estimate:
    """The same sums by lists of the segments in nested spheres around each sample (paper 2.3).

    S_0 holds all segments and is never invalidated nor rebuilt; S_i has the radius r_0 ratio^i and holds
    those segments of S_(i-1) that intersect it. The samples are visited in order; spheres that a sample's
    disc invalidates are rebuilt around the sample, and the disc is tested against the innermost list.

    Parameters
    ----------
    segments : Segments
    samples : Samples with radii, in world space
    ratio : number between 0 and 1, Q of the paper
    min_rays : integer from 1; shorter lists are not subdivided
    order : "hilbert", "lebesgue" (Morton) or "none" (as given)
    containment : which spheres are valid for a disc
        "all": the outermost sphere that does not contain the disc and all inside it are rebuilt; exact.
        "nested": likewise also a sphere that would not contain the next one around the sample; exact.
        "literal": as printed in the paper, the innermost sphere that contains the disc is kept, whatever the
        spheres around it. **Literal is lossy**: it misses a few to fifty per cent of the hits. For studies.
    outer_sphere : (centre, radius) of S_0 in metres, or None
        Sets the radii of all spheres; the centre has no influence. None: the smallest sphere around all
        segments whose centre is that of their bounding box (for endless segments, the origin counts).
    segment_end : "first", "second" or "bounded" (second, at most 3 radii beyond the first)
    first_bounce : count segments from this bounce on; 1 excludes direct light
    threads : number of threads, None = all
        Sums and statistics do not depend on it. "nested" and "literal" use one.
    progress : callable (stage, fraction) -> False to cancel

    Returns
    -------
    Estimate
        `sums` are exact and equal (==) to every other disc method's, but for "literal". `stats`: hits,
        disc_tests, sphere_tests, and one number per level, S_0 first: radii (metres), rebuilds (times
        that S_i was built, the first included), first_misses (samples whose outermost invalid sphere
        was S_i; the first sample counts none), level_tests (sphere tests against S_i), mean_rays (mean
        length of S_i's list over its builds; 0 if it was never built).

    Raises
    ------
    OptionError
        For options out of range, or a ratio so close to 1 that over 10,000 spheres would be needed.
    """
    check_choice("segment_end", segment_end, SEGMENT_ENDS)
    check_choice("order", order, ORDERS)
    check_choice("containment", containment, CONTAINMENTS)
    ratio, min_rays = check_ratio_and_rays(ratio, min_rays)
    check_discs(samples)
    segments = select_segments(segments, first_bounce, threads)
    sums, stats = _core.sphere_cache(
        core_segments(segments),
        core_discs(samples, segments),
        segment_end,
        ratio,
        min_rays,
        order,
        containment,
        outer_radius(outer_sphere),
        threads or 0,
        progress,
    )
    rays = stats.pop("rays")
    builds = [1, *stats["rebuilds"][1:]]
    stats["mean_rays"] = [total / max(1, count) for total, count in zip(rays, builds, strict=False)]
    return disc_estimate(segments, samples, sums, stats)


def check_ratio_and_rays(ratio: Any, min_rays: Any) -> tuple[float, int]:
    """Refuse a ratio or a smallest list length that is not valid for a sphere cache."""
    try:
        number = float(ratio)
    except (TypeError, ValueError):
        raise OptionError(f"ratio: found {ratio!r}, expected a number") from None
    if not 0 < number < 1:
        raise OptionError(f"ratio: found {number:g}, expected a number between 0 and 1, without them")
    check_integer("min_rays", min_rays, 1, 2**63 - 1)
    return number, int(min_rays)


def outer_radius(outer_sphere: Any) -> float:
    """Radius of S_0; 0 = enclose all segments."""
    if outer_sphere is None:
        return 0.0
    try:
        centre, radius = np.asarray(outer_sphere[0], float), float(outer_sphere[1])
        good = len(outer_sphere) == 2 and centre.shape == (3,) and bool(np.isfinite(centre).all())
    except (TypeError, ValueError, IndexError, KeyError):
        good, radius = False, 0.0
    if not (good and 0 < radius <= FARTHEST):
        raise OptionError(
            f"outer_sphere: found {outer_sphere!r}, expected (centre, radius): three finite numbers and "
            f"a positive one up to {FARTHEST:g}, in metres"
        )
    return radius
