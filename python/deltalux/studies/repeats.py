# SPDX-License-Identifier: Apache-2.0
"""Statistics of a few repetitions with other seeds: means, errors, certain signs, outcomes of claims."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit  # scipy.stats takes a second to load

from .experiment import Outcome

FALSE_ALARMS = 0.001  # probability in one decision, two-sided


def mean_and_error(values: ArrayLike) -> tuple[list[float], list[float] | None]:
    """Mean over repetitions, and its standard error.

    Parameters
    ----------
    values : (repetitions, n) array

    Returns
    -------
    n means; n standard errors, or None for a single repetition
    """
    array = np.asarray(values, dtype=float)
    if len(array) < 2:
        return array[0].tolist(), None
    error = array.std(axis=0, ddof=1) / np.sqrt(len(array))
    return array.mean(axis=0).tolist(), error.tolist()


def certain_sign(values: ArrayLike, false_alarms: float = FALSE_ALARMS) -> Literal[-1, 0, 1]:
    """Sign of a mean; 0 if a t-test finds no significant sign.

    The null hypothesis: independent values from a normal distribution with mean 0.

    Parameters
    ----------
    values : (repetitions,) numbers, usually differences within one repetition
    false_alarms : probability that a mean of 0 is given a sign
    """
    array = np.asarray(values, dtype=float)
    if len(array) < 2:
        return 0
    mean, error = float(array.mean()), float(array.std(ddof=1)) / np.sqrt(len(array))
    if abs(mean) <= error * -stdtrit(len(array) - 1, false_alarms / 2):
        return 0
    return 1 if mean > 0 else -1


def outcome_of(sign: int, wanted: Literal[-1, 1]) -> Outcome:
    """Outcome of a claim that a sign is the wanted one; open if the sign is not certain.

    Parameters
    ----------
    sign : of `certain_sign`
    wanted : -1 or 1
    """
    return "open" if sign == 0 else "confirmed" if sign == wanted else "refuted"


def together(outcomes: Collection[Outcome]) -> Outcome:
    """Outcome of a claim about several cases: refuted if one is refuted, confirmed if all are confirmed."""
    if "refuted" in outcomes:
        return "refuted"
    return "confirmed" if outcomes and set(outcomes) == {"confirmed"} else "open"


def averaged(settings: Mapping[str, Any]) -> str:
    """The sentence about seeds and error bars in a caption.

    Parameters
    ----------
    settings : with "seeds"
    """
    seeds = ", ".join(str(seed) for seed in settings["seeds"])
    return f"Mean of seeds {seeds}, bars: its standard error."
