# SPDX-License-Identifier: Apache-2.0
"""How long the jobs of the command line take, step by step, and what is left of one that runs."""

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
    "drawing",
    "loading",
    "opening",
    "recomputing",
    "summing_up",
    "updating",
    "writing",
]
