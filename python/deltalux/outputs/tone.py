# SPDX-License-Identifier: Apache-2.0
"""Linear light to display colours: exposure, tone curve, sRGB."""

from __future__ import annotations

import numpy as np

from deltalux.units import photopic

KEY = 0.32  # display level of the typical luminance, before the tone curve
WHITE = 5.0  # exposed luminance that becomes white


def metered(luminance: np.ndarray, lamp: np.ndarray, key: float = KEY) -> float:
    """Exposure for visible surfaces; light sources are excluded, unless nothing else is visible.

    Parameters
    ----------
    luminance : (n,) photopic radiance of the visible surfaces
    lamp : (n,) bool, whether it is a light source's
    key : see `automatic_exposure`
    """
    others = luminance[~lamp]
    return automatic_exposure(others if others.any() else luminance, key)


def automatic_exposure(luminance: np.ndarray, key: float = KEY) -> float:
    """Factor that brings the typical (log-average) luminance to a middle tone.

    Parameters
    ----------
    luminance : (n,) photopic radiance of the visible surfaces
    key : display level of the typical luminance
    """
    lit = luminance[luminance > 0]
    if lit.size == 0:
        return 1.0
    # So that deep shadow does not make the rest white, it counts as at least a hundredth of the bright parts.
    floor = 0.01 * np.percentile(lit, 90)
    return float(key / np.exp(np.log(np.maximum(luminance, floor)).mean()))


def tone_map(radiance: np.ndarray, exposure: float) -> np.ndarray:
    """Display colour, linear in [0, 1], of linear radiance (..., 3).

    Reinhard's curve on luminance, which preserves hue; a channel beyond 1 is desaturated
    towards grey of the same luminance.
    """
    exposed = exposure * np.asarray(radiance, dtype=np.float64)
    luminance = photopic(exposed)
    shown = np.minimum(luminance * (1 + luminance / WHITE**2) / (1 + luminance), 1.0)
    color = exposed * (shown / np.maximum(luminance, 1e-30))[..., None]
    brightest = color.max(axis=-1)
    over = brightest > 1
    chroma = np.where(over, (1 - shown) / np.maximum(brightest - shown, 1e-30), 1.0)
    grey = shown[..., None]
    return np.clip(grey + (color - grey) * chroma[..., None], 0, 1)


def encode_srgb(linear: np.ndarray) -> np.ndarray:
    """8-bit sRGB of linear values in [0, 1]."""
    linear = np.clip(linear, 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.rint(255 * encoded).astype(np.uint8)
