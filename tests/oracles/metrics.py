# SPDX-License-Identifier: Apache-2.0
"""How far off an estimate is, and when a program's error falls below a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

DARK = 0.1  # of a channel's mean; below it errors count against this floor


@dataclass(frozen=True)
class Run:
    """One run of a program: what was set, CPU seconds for all points, error against the reference."""

    setting: str
    cpu_seconds: float
    error: float


def relative_error(found: NDArray, reference: NDArray, reference_error: NDArray) -> float:
    """RMS over points and channels of |found - reference| / max(reference, 10 % of the channel's mean).

    All arrays (n, 3). The reference's own noise is taken off, as variances.
    """
    scale = np.maximum(reference, DARK * reference.mean(axis=0))
    return _rms_without_noise((found - reference) / scale, reference_error / scale)


def bias(found: NDArray, reference: NDArray) -> float:
    """Mean of the relative difference, with the floor of `relative_error`."""
    scale = np.maximum(reference, DARK * reference.mean(axis=0))
    return float(((found - reference) / scale).mean())


def change_error(found: NDArray, change: NDArray, change_error: NDArray) -> float:
    """RMS of found - change over the RMS of the change; its noise is taken off as above."""
    return _rms_without_noise(found - change, change_error) / _rms_without_noise(change, change_error)


def _rms_without_noise(difference: NDArray, noise: NDArray) -> float:
    square = (np.asarray(difference, np.float64) ** 2).mean() - (np.asarray(noise, np.float64) ** 2).mean()
    return float(np.sqrt(max(square, 0.0)))


def seconds_to(target: float, runs: Sequence[Run], *, extrapolate: bool = True) -> float | None:
    """CPU seconds at which the error falls to `target`.

    Straight lines between the runs that no other run beats in both time and error, on
    logarithmic axes. Beyond the last one the error is taken to fall with the square root of
    the time, as Monte Carlo does, if `extrapolate`; before the first one that run's time counts.
    None: there is no run, or the best is too far off (with `extrapolate` more than three times;
    its error may have a floor).
    """
    front: list[Run] = []
    for run in sorted(runs, key=lambda r: (r.cpu_seconds, r.error)):
        if not front or run.error < front[-1].error:
            front.append(run)
    if not front or front[-1].error > (3 if extrapolate else 1) * target:
        return None
    if front[-1].error > target:
        return front[-1].cpu_seconds * (front[-1].error / target) ** 2
    if front[0].error <= target:
        return front[0].cpu_seconds
    errors = np.log([run.error for run in reversed(front)])
    seconds = np.log([run.cpu_seconds for run in reversed(front)])
    return float(np.exp(np.interp(np.log(target), errors, seconds)))
