# SPDX-License-Identifier: Apache-2.0
"""Doubts implausible levels of light, and names the likely cause."""

from __future__ import annotations

from collections.abc import Sequence

from deltalux.quantities import significant
from deltalux.units import LUX

from .summary import SetSummary

# A clear night with a full moon has 0.3 lx, the sun at noon 130,000 lx.
DARKEST, BRIGHTEST = 0.1, 2e5


def light_doubt(summaries: Sequence[SetSummary], unit: str) -> str | None:
    """One sentence if the brightest sample is darker than moonlight, or the mean brighter than the sun.

    Parameters
    ----------
    summaries : of all sets of samples, in `unit`
    unit : results in W/m2 are not judged, because they need not be visible light
    """
    lit = [summary for summary in summaries if summary.samples and summary.maximum > 0]
    if unit != LUX or not lit:
        return None
    brightest = max(summary.maximum for summary in lit)
    mean = max(summary.mean for summary in lit)
    if brightest < DARKEST:
        found = f"no sample has more than {significant(brightest, 2)} lx, and a full moon gives 0.3 lx"
    elif mean > BRIGHTEST:
        found = f"the mean is {significant(mean, 2)} lx, and the sun gives 130,000 lx"
    else:
        return None
    return (
        f"doubtful: {found}; the file's lights may be in watts or without unit (--light-units blender-watts, "
        "unitless), or its lengths not in metres (--unit)"
    )
