# SPDX-License-Identifier: Apache-2.0
"""Disc methods with one pass over the segments: brute force and the disc index."""

from __future__ import annotations

from deltalux import _core
from deltalux.results import Estimate
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments

from .inputs import (
    SEGMENT_ENDS,
    check_choice,
    check_discs,
    core_discs,
    core_segments,
    disc_estimate,
    select_segments,
)


def _disc_method(
    method: str,
    segments: Segments,
    samples: Samples,
    segment_end: str,
    first_bounce: int,
    threads: int | None,
    progress: Progress | None,
) -> Estimate:
    check_choice("segment_end", segment_end, SEGMENT_ENDS)
    check_discs(samples)
    segments = select_segments(segments, first_bounce, threads)
    arrays = core_segments(segments), core_discs(samples, segments)
    sums, stats = _core.disc_method(method, *arrays, segment_end, threads or 0, progress)
    return disc_estimate(segments, samples, sums, stats)


def brute_force(
    segments: Segments,
    samples: Samples,
    *,
    segment_end: str = "bounded",
    first_bounce: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Estimate:
    """Density estimation on the tangent plane by testing every segment against every disc.

    E = (1 / (pi d²)) Σ power of the segments that cross the disc from its front (paper 2.1).

    Parameters
    ----------
    segments : Segments
    samples : Samples with radii, in world space
    segment_end : "first", "second" or "bounded" (second, at most 3 radii beyond the first)
    first_bounce : count segments from this bounce on; 1 excludes direct light

    Returns
    -------
    Estimate
        `sums` are exact and equal (==) for every disc method; `stats`: hits, disc_tests.
    """
    return _disc_method("brute_force", segments, samples, segment_end, first_bounce, threads, progress)


def disc_index(
    segments: Segments,
    samples: Samples,
    *,
    segment_end: str = "bounded",
    first_bounce: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Estimate:
    """The same sums by a spatial index over the discs that the segments traverse (paper 2.4).

    Parameters and result are those of `brute_force`; `stats` also has node_tests.
    """
    return _disc_method("disc_index", segments, samples, segment_end, first_bounce, threads, progress)
