# SPDX-License-Identifier: Apache-2.0
"""Periodic peaks of a curve over levels, such as one at each halving of the spheres' radius."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FINE = 200  # steps in the window of a running mean


@dataclass(frozen=True)
class Ripple:
    """Periodic part of a curve.

    Attributes
    ----------
    amplitude : amplitude of the logarithm, so that 0.1 is about ±10 % of the curve
    offset : levels from a multiple of the period to the nearest peak, within half a period
    """

    amplitude: float
    offset: float


def halving_period(ratio: float) -> float:
    """Levels after which the radius r_0 Q^i has halved; not whole.

    Parameters
    ----------
    ratio : Q
    """
    return float(np.log(0.5) / np.log(ratio))


def ripple(levels: np.ndarray, counts: np.ndarray, period: float) -> Ripple:
    """Periodic part of a curve: Fourier component of its logarithm less a running mean over one period.

    Parameters
    ----------
    levels : (n,) consecutive levels, at least two periods
    counts : (n,) positive
    period : in levels
    """
    height = np.log(counts)
    inner = levels[(levels - period / 2 >= levels[0]) & (levels + period / 2 <= levels[-1])]
    window = np.linspace(-period / 2, period / 2, FINE + 1)
    trend = np.interp(inner[:, None] + window, levels, height).mean(axis=1)
    wave = 2 * np.mean((height[inner - levels[0]] - trend) * np.exp(2j * np.pi * inner / period))
    return Ripple(float(np.abs(wave)), float(np.angle(wave) / (2 * np.pi) * period))


def peaks(levels: np.ndarray, counts: np.ndarray) -> list[int]:
    """Levels whose counts exceed those of both neighbours, as a reader of the diagram sees them.

    Parameters
    ----------
    levels, counts : (n,)
    """
    middle = counts[1:-1]
    return levels[1:-1][(middle > counts[:-2]) & (middle > counts[2:])].tolist()
