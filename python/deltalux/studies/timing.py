# SPDX-License-Identifier: Apache-2.0
"""Processor times of calls that are compared: interleaved, repeated, as medians with their spread."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from deltalux.segments import Segments

from .measuring import measured

MEDIAN_OVER_MEAN = 1.2533  # standard error of a median over that of a mean, normal law
LEAST_SEARCHED = 30_000
KNOWN = 4  # standard errors by which a time must stand out; those of few repetitions are rough
QUARTILES_OVER_SIGMA = 1.349  # distance of the quartiles of a normal law over its standard deviation


@dataclass(frozen=True)
class Timing:
    """Processor time of a call.

    Attributes
    ----------
    seconds : median over the repetitions
    error : its standard error, from the distance of the quartiles; 0 of a single repetition
    """

    seconds: float
    error: float = 0.0

    def __add__(self, other: Timing) -> Timing:
        return Timing(self.seconds + other.seconds, float(np.hypot(self.error, other.error)))

    def __sub__(self, other: Timing) -> Timing:
        """What a call takes beyond a part of it that was timed alone."""
        return Timing(self.seconds - other.seconds, float(np.hypot(self.error, other.error)))

    def __truediv__(self, count: float) -> Timing:
        return Timing(self.seconds / count, self.error / count)

    def over(self, other: Timing) -> tuple[float, float]:
        """This time in units of another: ratio and standard error."""
        ratio = self.seconds / other.seconds
        return ratio, ratio * float(np.hypot(self.error / self.seconds, other.error / other.seconds))

    @property
    def known(self) -> bool:
        """Whether it stands out of its own spread, as small differences of large times may not."""
        return self.seconds > KNOWN * self.error


def interleaved(calls: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, Timing]:
    """Time calls in turns, so that a slow minute of the machine falls on all of them alike.

    Parameters
    ----------
    calls : by name; each should use one thread, since processor time adds up threads that wait
    repetitions : turns; one more is run before and not counted

    Returns
    -------
    dict of Timing
    """
    taken: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(repetitions + 1):
        for name, call in calls.items():
            seconds = measured(call).cpu_seconds
            if turn:
                taken[name].append(seconds)
    return {name: median(values) for name, values in taken.items()}


def median(values: list[float]) -> Timing:
    """Median of repeated times and its standard error."""
    low, middle, high = np.percentile(values, [25, 50, 75])
    sigma = (high - low) / QUARTILES_OVER_SIGMA
    return Timing(float(middle), float(MEDIAN_OVER_MEAN * sigma / np.sqrt(len(values))))


def repeated(segments: Segments) -> tuple[Segments, int]:
    """Segments so often that a search of them stands out of the build that is timed with it.

    Returns
    -------
    the segments again and again, and how often
    """
    copies = max(1, -(-LEAST_SEARCHED // max(1, len(segments))))
    return segments.select(np.tile(np.arange(len(segments)), copies)), copies
