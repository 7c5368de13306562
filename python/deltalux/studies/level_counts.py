# SPDX-License-Identifier: Apache-2.0
"""Counts per level of the sphere cache over several seeds, and the curves and table rows made from them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .experiment import Curve
from .repeats import mean_and_error

DEFINITIONS = {"rebuilds": "every level that is rebuilt", "first_misses": "the outermost invalid sphere"}


def stacked(runs: Sequence[Mapping[str, Any]], name: str) -> np.ndarray:
    """(seeds, levels from S_0) counts under one key.

    Parameters
    ----------
    runs : `stats` of `sphere_cache`, one for each seed, with equal radii
    name : key of the counts, such as "rebuilds"
    """
    return np.array([run[name] for run in runs], dtype=float)


def built(counts: np.ndarray) -> np.ndarray:
    """Numbers of the levels below S_0 that any seed counted."""
    return 1 + np.flatnonzero(counts[:, 1:].any(axis=0))


def level_curve(label: str, counts: np.ndarray) -> Curve:
    """Mean counts of the levels that any seed counted, with their standard errors.

    Parameters
    ----------
    label : for the legend
    counts : (seeds, levels from S_0)
    """
    levels = built(counts)
    mean, error = mean_and_error(counts[:, levels])
    return Curve(label, levels.tolist(), mean, error)


def level_rows(runs: Sequence[Mapping[str, Any]]) -> Iterator[list[int | float | None]]:
    """Per level below S_0 that was built: level, mean rays, then mean and standard error per definition."""
    counts = [stacked(runs, name) for name in DEFINITIONS]
    rays = stacked(runs, "mean_rays").mean(axis=0)
    means = [mean_and_error(each) for each in counts]
    for level in built(counts[0]):
        row: list[int | float | None] = [int(level), float(rays[level])]
        for mean, error in means:
            row += [mean[level], None if error is None else error[level]]
        yield row


LEVEL_COLUMNS = (
    "level",
    "mean rays",
    "rebuilds",
    "s.e. of rebuilds",
    "first misses",
    "s.e. of first misses",
)
