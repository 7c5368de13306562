# SPDX-License-Identifier: Apache-2.0
"""Forecasts of the time that jobs of the command line take, step by step, and of the time left."""

from .counting import counts_of, counts_with
from .overall import Estimate, Overall, Step
from .steps import (
    MORE_RAYS,
    POINT,
    Counts,
    Stored,
    baking,
    bundled,
    drawing,
    loading,
    opening,
    recomputing,
    summing_up,
    updating,
    writing,
)

__all__ = [
    "MORE_RAYS",
    "POINT",
    "Counts",
    "Estimate",
    "Overall",
    "Step",
    "Stored",
    "baking",
    "bundled",
    "counts_of",
    "counts_with",
    "drawing",
    "loading",
    "opening",
    "recomputing",
    "summing_up",
    "updating",
    "writing",
]
