# SPDX-License-Identifier: Apache-2.0
"""Checks shared by all methods, and conversion of arrays to the core's."""

from __future__ import annotations

import numpy as np

from deltalux import _core
from deltalux.errors import OptionError
from deltalux.results import Estimate
from deltalux.samples import Samples
from deltalux.segments import Segments, check_threads
from deltalux.units import FARTHEST

SEGMENT_ENDS = ("first", "second", "bounded")


def check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    """Refuse a value that is not among the choices."""
    if value not in choices:
        raise OptionError(f"{name}: found {value!r}, expected one of {choices}")


def select_segments(segments: Segments, first_bounce: int, threads: int | None) -> Segments:
    """The segments from a bounce on."""
    check_threads(threads)
    return segments.select(segments.bounce >= first_bounce) if first_bounce else segments


def check_world_points(samples: Samples) -> None:
    """Refuse samples that are attached to a movable."""
    if any(name is not None for name in samples.attached):
        raise OptionError("samples: found samples attached to a movable, expected world points here")


def check_discs(samples: Samples) -> None:
    """Refuse samples that are not discs in world space."""
    if np.isnan(samples.radius).any():
        raise OptionError(
            "samples: radius is automatic, which needs a scene; give a radius to estimate from bare segments"
        )
    check_world_points(samples)
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


def core_segments(segments: Segments) -> _core.SegmentArrays:
    """The segments in the core, in coordinates relative to their frame."""
    origin = segments.origin if not segments.frame.any() else segments.origin - segments.frame
    return _core.SegmentArrays(
        np.ascontiguousarray(origin, np.float32),
        segments.direction,
        segments.length,
        segments.extended,
        segments.quanta,
    )


def core_discs(
    samples: Samples, segments: Segments | None = None, radius: np.ndarray | None = None
) -> _core.DiscSet:
    """Samples as discs in the core, in the frame of `segments`; `radius` replaces their own."""
    points = samples.points if segments is None else samples.points - segments.frame
    arrays = (points, samples.normals, samples.radius if radius is None else radius)
    return _core.DiscSet(*(np.ascontiguousarray(array, np.float32) for array in arrays))


def disc_estimate(segments: Segments, samples: Samples, sums: np.ndarray, stats: dict) -> Estimate:
    """Irradiance from exact sums over whole discs."""
    area = np.pi * samples.radius.astype(np.float32).astype(np.float64) ** 2
    return Estimate(sums * (segments.quantum / area[:, None]), sums, segments.quantum, stats)
