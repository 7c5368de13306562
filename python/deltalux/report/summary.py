# SPDX-License-Identifier: Apache-2.0
"""The figures that lighting designers need first: minimum, mean, maximum, uniformity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from deltalux.units import photopic


@dataclass(frozen=True)
class SetSummary:
    """Figures of one set of samples, photopic, in the scene's unit.

    Attributes
    ----------
    name : the set
    samples : number of samples
    minimum, mean, maximum : over the samples, each counted once
    uniformity : minimum / mean; 0 if the mean is 0
    standard_error : mean of the samples' standard errors
    """

    name: str
    samples: int
    minimum: float
    mean: float
    maximum: float
    uniformity: float
    standard_error: float


def summarise(
    irradiance: np.ndarray, standard_error: np.ndarray, sets: Mapping[str, np.ndarray]
) -> list[SetSummary]:
    """Summarise each set of samples.

    Parameters
    ----------
    irradiance : (n, 3) array
    standard_error : (n, 3) array, per channel
    sets : name of a set -> indices of its samples; empty sets are omitted
    """
    values = photopic(irradiance)
    # A path carries light of one colour, so the channels' errors are correlated.
    errors = photopic(standard_error)
    result = []
    for name, index in sets.items():
        if len(index) == 0:
            continue
        own, mean = values[index], float(values[index].mean())
        result.append(
            SetSummary(
                name=name,
                samples=len(index),
                minimum=float(own.min()),
                mean=mean,
                maximum=float(own.max()),
                uniformity=float(own.min()) / mean if mean > 0 else 0.0,
                standard_error=float(errors[index].mean()),
            )
        )
    return result
