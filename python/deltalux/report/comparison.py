# SPDX-License-Identifier: Apache-2.0
"""Differences between two sets of irradiance, as the numbers that a comparison prints."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux.units import photopic

DARK = 0.1  # share of a channel's mean: differences of darker samples are relative to this


def compare(a: np.ndarray, b: np.ndarray) -> dict[str, Any]:
    """Compare irradiance `b` with `a`, sample by sample.

    Parameters
    ----------
    a, b : (n, 3) arrays in one unit; `a` is the reference

    Returns
    -------
    dict with `samples`; `changed`, number of samples that differ at all; `mean_a`, `mean_b`,
    `mean_difference`, `rms_difference` and `largest_difference`, photopic, of b - a; `largest_index`; and
    `rms_relative_difference`, over all channels, relative to max(a, 10 % of the channel's mean).
    """
    before, after = photopic(a), photopic(b)
    change = after - before
    count = len(change)
    largest = int(np.abs(change).argmax()) if count else 0
    floor = np.maximum(a, DARK * a.mean(axis=0)) if count else a
    lit = floor > 0
    relative = (b - a)[lit] / floor[lit]
    return {
        "samples": count,
        "changed": int((a != b).any(axis=1).sum()),
        "mean_a": float(before.mean()) if count else 0.0,
        "mean_b": float(after.mean()) if count else 0.0,
        "mean_difference": float(change.mean()) if count else 0.0,
        "rms_difference": float(np.sqrt(np.mean(change**2))) if count else 0.0,
        "rms_relative_difference": float(np.sqrt(np.mean(relative**2))) if relative.size else 0.0,
        "largest_difference": float(change[largest]) if count else 0.0,
        "largest_index": largest,
    }
