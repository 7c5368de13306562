# SPDX-License-Identifier: Apache-2.0
"""Estimators on arrays: every method on the same segments and samples."""

from __future__ import annotations

import numpy as np

from . import _core
from .errors import OptionError
from .results import Estimate
from .samples import Samples
from .segments import Progress, Segments, check_threads

SEGMENT_ENDS = ("first", "second", "bounded")
FARTHEST = 1e15  # metres; beyond it products of coordinates could overflow


def _disc_method(
    method: str,
    segments: Segments,
    samples: Samples,
    segment_end: str,
    first_bounce: int,
    threads: int | None,
    progress: Progress | None,
) -> Estimate:
    if segment_end not in SEGMENT_ENDS:
        raise OptionError(f"segment_end: found {segment_end!r}, expected one of {SEGMENT_ENDS}")
    if np.isnan(samples.radius).any():
        raise OptionError(
            "samples: radius is automatic, which needs a scene; give a radius to estimate from bare segments"
        )
    if any(name is not None for name in samples.attached):
        raise OptionError("samples: found samples attached to a movable, expected world points here")
    _check_range(samples)
    check_threads(threads)
    if first_bounce:
        segments = segments.select(segments.bounce >= first_bounce)
    sums, stats = _core.disc_method(
        method,
        segments.origin,
        segments.direction,
        segments.length,
        segments.extended,
        segments.quanta,
        np.ascontiguousarray(samples.points, np.float32),
        np.ascontiguousarray(samples.normals, np.float32),
        np.ascontiguousarray(samples.radius, np.float32),
        segment_end,
        threads or 0,
        progress,
    )
    area = np.pi * samples.radius.astype(np.float32).astype(np.float64) ** 2
    return Estimate(sums * (segments.quantum / area[:, None]), sums, segments.quantum, stats)


def _check_range(samples: Samples) -> None:
    """Refuse discs that single precision cannot hold."""
    radius = samples.radius.astype(np.float32)
    if not (radius > 0).all():
        row = int(np.argmin(radius))
        raise OptionError(
            f"samples: radius: found {samples.radius[row]} at row {row}, expected at least 1e-45 metres"
        )
    reach = np.abs(samples.points).max(axis=1, initial=0.0) + samples.radius
    if (reach > FARTHEST).any():
        row = int(np.argmax(reach))
        raise OptionError(
            f"samples: row {row} lies {reach[row]:.3g} m from the origin, expected none farther than "
            f"{FARTHEST:g} m; choose another unit or origin"
        )


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
    first_bounce : count flights from this bounce on; 1 leaves direct light out

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
