# SPDX-License-Identifier: Apache-2.0
"""Converts light per pixel to display colours: the lit scene, or irradiance in false colours."""

from __future__ import annotations

import numpy as np

from deltalux.outputs.colour_scale import ColourScale, scale_for
from deltalux.outputs.drawing import draw_isolines, legend
from deltalux.outputs.images import SURROUNDINGS, Picture
from deltalux.outputs.tone import encode_srgb, metered, tone_map
from deltalux.units import photopic

from .render import Rendering
from .seen import alike, neighbours


def lit_picture(rendering: Rendering, exposure: float | None = None, stops: float = 0.0) -> Picture:
    """The scene as the camera sees it.

    Parameters
    ----------
    rendering : Rendering
    exposure : factor on radiance; None = automatic
    stops : additional exposure in powers of two
    """
    seen, radiance = rendering.seen, rendering.radiance
    if exposure is None:
        lamp = np.asarray((seen.emission > 0).any(axis=1))
        exposure = metered(photopic(radiance[seen.hit]), lamp[seen.hit])
    exposure *= 2.0**stops
    shown = np.where(seen.hit[:, None], tone_map(radiance, exposure), SURROUNDINGS)
    return Picture(encode_srgb(rendering.pixels(shown)), camera=rendering.camera, exposure=exposure)


def false_colour_picture(rendering: Rendering, scale: ColourScale | None = None) -> Picture:
    """Photopic irradiance in false colours, with isolines at the scale's ticks and a legend."""
    seen = rendering.seen
    values = np.where(seen.hit, photopic(rendering.irradiance), np.nan)
    scale = scale or scale_for(values)
    colours = np.where(seen.hit[:, None], scale.colours(np.nan_to_num(values)), SURROUNDINGS)
    pixels = draw_isolines(
        encode_srgb(rendering.pixels(colours)), rendering.middles(values), scale.ticks(), _seams(rendering)
    )
    bar = legend(scale, rendering.scene.unit, len(pixels))
    return Picture(np.concatenate([pixels, bar], axis=1), camera=rendering.camera, scale=scale)


def _seams(rendering: Rendering) -> tuple[np.ndarray, np.ndarray]:
    """Whether a pixel's right or lower neighbour shows another surface: (h, w - 1) and (h - 1, w) bool."""
    seen = rendering.seen
    right, below = (
        ~alike(seen.at(one.ravel()), seen.at(two.ravel())).reshape(one.shape)
        for one, two in neighbours(rendering.size)
    )
    return right, below
