# SPDX-License-Identifier: Apache-2.0
"""Processor times of calls to compare: interleaved, repeated, as medians with standard errors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from deltalux.segments import Segments

from .measuring import measured

MEDIAN_OVER_MEAN = 1.2533  # standard error of a median over that of a mean, normal distribution
LEAST_SEARCHED = 30_000
KNOWN = 4  # standard errors that a time must exceed; those of few repetitions are rough
QUARTILES_OVER_SIGMA = 1.349  # interquartile range over standard deviation, normal distribution


@dataclass(frozen=True)
class Timing:
    """Processor time of a call.

    Attributes
    ----------
    seconds : median over the repetitions
    error : its standard error, from the interquartile range; 0 for a single repetition
    """

    seconds: float
    error: float = 0.0

    def __add__(self, other: Timing) -> Timing:
        return Timing(self.seconds + other.seconds, float(np.hypot(self.error, other.error)))

    def __sub__(self, other: Timing) -> Timing:
        """Time of a call without a part that was timed alone."""
        return Timing(self.seconds - other.seconds, float(np.hypot(self.error, other.error)))

    def __truediv__(self, count: float) -> Timing:
        return Timing(self.seconds / count, self.error / count)

    def over(self, other: Timing) -> tuple[float, float]:
        """Ratio of this time to another, and its standard error."""
        ratio = self.seconds / other.seconds
        return ratio, ratio * float(np.hypot(self.error / self.seconds, other.error / other.seconds))

    @property
    def known(self) -> bool:
        """Whether the time exceeds its own noise, which small differences of large times may not."""
        return self.seconds > KNOWN * self.error


def interleaved(calls: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, Timing]:
    """Time calls in turns, so that slow phases of the machine affect all of them alike.

    Parameters
    ----------
    calls : functions by name; each should use one thread, since processor time includes waiting threads
    repetitions : number of turns, after one that is not counted

    Returns
    -------
    dict of Timing by name
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
    """Repeat segments so often that their search takes much longer than the build timed with it.

    Returns
    -------
    the repeated segments, and the number of copies
    """
    copies = max(1, -(-LEAST_SEARCHED // max(1, len(segments))))
    return segments.select(np.tile(np.arange(len(segments)), copies)), copies
