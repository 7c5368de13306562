# SPDX-License-Identifier: Apache-2.0
"""Progress of a call as a share of a longer call's progress."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from deltalux.errors import Cancelled
from deltalux.segments import Progress


def part_of(progress: Progress | None, start: float, end: float) -> Progress | None:
    """A callback that maps 0 to 1 to `start` to `end` of `progress`, and never decreases."""
    if progress is None:
        return None
    most = 0.0

    def report(stage: str, fraction: float) -> Any:
        nonlocal most
        most = max(most, min(fraction, 1.0))
        return progress(stage, start + (end - start) * most)

    return report


def named(progress: Progress | None, name: str) -> Progress | None:
    """A callback that reports all stages under one name."""
    if progress is None:
        return None
    tell: Callable[[str, float], Any] = progress
    return lambda _, fraction: tell(name, fraction)


class Steps:
    """Progress of a known number of steps of about equal length.

    Parameters
    ----------
    progress : callback to report to, or None
    count : number of steps
    """

    def __init__(self, progress: Progress | None, count: int) -> None:
        self._progress, self._count, self._done = progress, count, 0

    @property
    def share(self) -> float:
        """How much of the whole one step is."""
        return 1 / self._count

    def done(self) -> None:
        """Report one more finished step.

        Raises
        ------
        Cancelled
            If the callback returned False.
        """
        self._done += 1
        if self._progress and self._progress("", self._done / self._count) is False:
            raise Cancelled("cancelled by the progress callback")
