# SPDX-License-Identifier: Apache-2.0
"""Colour scales: colours with monotonic lightness for values, and round ticks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Anchors as (lightness, chroma, hue in degrees) of OKLCh (B. Ottosson 2020).
SEQUENTIAL = (
    (0.17, 0.08, 300), (0.31, 0.15, 292), (0.45, 0.15, 262), (0.58, 0.11, 215),
    (0.70, 0.14, 158), (0.82, 0.18, 118), (0.91, 0.17, 100), (0.98, 0.06, 100),
)  # fmt: skip
DIVERGING = (  # dark in the middle: unchanged values recede, changes stand out
    (0.94, 0.05, 215), (0.75, 0.13, 232), (0.51, 0.16, 256), (0.25, 0.0, 100),
    (0.52, 0.16, 35), (0.76, 0.15, 62), (0.95, 0.09, 98),
)  # fmt: skip
# ratio of largest to smallest value from which a logarithmic scale is easier to read
LOG_BEYOND = 8.0
LEAST_SPREAD = 0.1  # share of the largest value: values with a smaller spread are shown from zero on


def _oklab_to_linear(lab: np.ndarray) -> np.ndarray:
    """Linear sRGB of Oklab colours (..., 3)."""
    lms = lab @ np.array(
        [
            [1.0, 1.0, 1.0],
            [0.3963377774, -0.1055613458, -0.0894841775],
            [0.2158037573, -0.0638541728, -1.2914855480],
        ]
    )
    to_rgb = np.array(
        [
            [4.0767416621, -1.2684380046, -0.0041960863],
            [-3.3077115913, 2.6097574011, -0.7034186147],
            [0.2309699292, -0.3413193965, 1.7076147010],
        ]
    )
    return np.clip(lms**3 @ to_rgb, 0, 1)


def _table(anchors: tuple[tuple[float, float, float], ...]) -> np.ndarray:
    """256 linear colours through evenly spaced anchors."""
    lightness, chroma, hue = np.array(anchors).T
    lab = np.stack([lightness, chroma * np.cos(np.radians(hue)), chroma * np.sin(np.radians(hue))], axis=1)
    at = np.linspace(0, len(anchors) - 1, 256)
    return _oklab_to_linear(np.stack([np.interp(at, np.arange(len(anchors)), c) for c in lab.T], axis=1))


@dataclass(frozen=True)
class ColourScale:
    """Map from values to colours.

    Parameters
    ----------
    low, high : float, values at the ends
    logarithmic : bool
    diverging : bool, zero in the middle
    """

    low: float
    high: float
    logarithmic: bool = False
    diverging: bool = False

    def position(self, values: np.ndarray) -> np.ndarray:
        """Place of each value on the scale, 0 to 1, clamped."""
        values = np.asarray(values, dtype=np.float64)
        if self.logarithmic:
            span = np.log(self.high / self.low)
            return np.clip(np.log(np.maximum(values, self.low) / self.low) / span, 0, 1)
        return np.clip((values - self.low) / (self.high - self.low), 0, 1)

    def value_at(self, position: np.ndarray) -> np.ndarray:
        """Value at a place of the scale, 0 to 1."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** np.asarray(position)
        return self.low + (self.high - self.low) * np.asarray(position)

    def colours(self, values: np.ndarray) -> np.ndarray:
        """Linear colours (..., 3)."""
        table = _table(DIVERGING if self.diverging else SEQUENTIAL)
        at = self.position(values) * (len(table) - 1)
        return np.stack([np.interp(at, np.arange(len(table)), channel) for channel in table.T], axis=-1)

    def ticks(self) -> np.ndarray:
        """Some four to nine round values within the scale."""
        if not self.logarithmic:
            step = _round_up((self.high - self.low) / 6)
            return (
                np.arange(np.ceil(self.low / step - 1e-9), np.floor(self.high / step + 1e-9) + 1) * step + 0.0
            )
        decades = 10.0 ** np.arange(np.floor(np.log10(self.low)), np.ceil(np.log10(self.high)) + 1)
        mantissas = (1, 2, 5) if self.high / self.low < 1e3 else (1,)
        values = np.sort(np.concatenate([m * decades for m in mantissas]))
        return values[(values >= self.low * (1 - 1e-9)) & (values <= self.high * (1 + 1e-9))]


def scale_for(values: np.ndarray, logarithmic: bool | None = None) -> ColourScale:
    """Scale from the 2nd to the 98th percentile; logarithmic where values spread widely, unless told."""
    values = values[np.isfinite(values)]
    top = float(np.percentile(values, 98)) if values.size else 0.0
    if top <= 0:
        return ColourScale(0.0, 1.0)
    high = _round_up(top)
    if logarithmic is None:
        logarithmic = top / max(float(np.median(values)), 1e-30) > LOG_BEYOND
    if not logarithmic:
        bottom = float(np.percentile(values, 2))
        if high - bottom < LEAST_SPREAD * high:
            return ColourScale(0.0, high)
        step = _round_up((high - bottom) / 6)
        return ColourScale(float(f"{np.floor(bottom / step) * step:.12g}"), high)
    bottom = float(np.percentile(values[values > 0], 2))
    bottom = min(max(bottom, high / 1e4), high / 10)
    return ColourScale(_round_down(bottom), high, logarithmic=True)


def symmetric_scale(values: np.ndarray) -> ColourScale:
    """Diverging scale around zero."""
    values = values[np.isfinite(values)]
    top = float(np.percentile(np.abs(values), 99.5)) if values.size else 0.0
    high = _round_up(top) if top > 0 else 1.0
    return ColourScale(-high, high, diverging=True)


def _round_up(value: float) -> float:
    """The next of 1, 2, 2.5, 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(m for m in (1, 2, 2.5, 5, 10) if m * power >= value * (1 - 1e-9)))


def _round_down(value: float) -> float:
    """The last of 1, 2, 2.5, 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(m for m in (5, 2.5, 2, 1) if m * power <= value * (1 + 1e-9)))
