# SPDX-License-Identifier: Apache-2.0
"""Distribution, by area, of the standard errors of all samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from deltalux.units import photopic

FLOOR = 0.05  # as a share of the mean irradiance: errors of darker samples are relative to this
# a mean of more than this many medians is not representative, for example with a sunlit roof above the room
# in question
MEDIANS = 3.0
MEDIAN, TAIL = 0.5, 0.9
WARN_ABOVE = 0.1  # largest accepted 90th percentile


@dataclass(frozen=True)
class ClaimedError:
    """Standard error over irradiance, photopic, over the lit samples, weighted by area.

    Attributes
    ----------
    median, p90 : half and nine tenths of the lit area have no larger error; 0 if nothing is lit
    sets : name of a set -> its own 90th percentile, for sets that are lit
    """

    median: float
    p90: float
    sets: Mapping[str, float] = field(default_factory=dict)

    @property
    def worst(self) -> str | None:
        """The set with the largest percentile."""
        return max(self.sets, key=lambda name: self.sets[name], default=None)


def claimed_error(
    irradiance: np.ndarray,
    standard_error: np.ndarray,
    areas: np.ndarray,
    sets: Mapping[str, np.ndarray] | None = None,
) -> ClaimedError:
    """Median and 90th percentile of the relative standard error over the lit area.

    The error of a sample is relative to its irradiance, or to 5 % of the mean irradiance of the lit samples
    if that is more. The mean is limited to three times the median: otherwise, where the sun lights a roof a
    thousand times as brightly as a room, all the room's errors would be next to nothing.

    Parameters
    ----------
    irradiance, standard_error : (n, 3) arrays
    areas : (n,) array, area that each sample represents, in any unit
    sets : name of a set -> indices of its samples; None: no sets
    """
    values, errors = photopic(irradiance), photopic(standard_error)
    lit = (values > 0) & (areas > 0)
    if not lit.any():
        return ClaimedError(0.0, 0.0)
    mean = float(np.average(values[lit], weights=areas[lit]))
    floor = FLOOR * min(mean, MEDIANS * weighted_quantile(values[lit], areas[lit], MEDIAN))
    relative = errors / np.maximum(values, floor)

    def percentile(index: np.ndarray, share: float) -> float:
        return weighted_quantile(relative[index], areas[index], share)

    own = {name: index[lit[index]] for name, index in (sets or {}).items()}
    tails = {name: percentile(index, TAIL) for name, index in own.items() if len(index)}
    every = np.flatnonzero(lit)
    return ClaimedError(percentile(every, MEDIAN), percentile(every, TAIL), tails)


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> float:
    """The smallest value for which it and all smaller values have at least `share` of the weight."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(below, share * below[-1])])


def advice(error: ClaimedError, paths: int, gather: str | int) -> str | None:
    """Advice if the light is noisy: how noisy it is, and the remedy; None if it is not.

    Parameters
    ----------
    error : of a session with these `paths` and rays (`gather`)
    """
    if error.p90 <= WARN_ABOVE:
        return None
    more = (error.p90 / WARN_ABOVE) ** 2  # noise falls at least with the square root
    wanted = f"--paths {_rounded(paths * more)}"
    if gather != "off":
        wanted += f" --gather {_rounded(int(gather) * more)}"
    return (
        f"noisy: a tenth of the lit surface has a standard error of {error.p90:.0%} or more; "
        f"{wanted} would bring that below {WARN_ABOVE:.0%}"
    )


def _rounded(count: float) -> int:
    """Round up to two digits."""
    unit = 10 ** max(0, int(np.floor(np.log10(count))) - 1)
    return int(np.ceil(count / unit)) * unit
