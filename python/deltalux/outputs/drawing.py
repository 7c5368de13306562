# SPDX-License-Identifier: Apache-2.0
"""Text, legends and lines on pictures."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from .colour_scale import ColourScale
from .tone import encode_srgb

PAPER = (24, 24, 27)
INK = (235, 235, 235)


def text_font(height: int) -> ImageFont.FreeTypeFont:
    """Font for a picture with that many rows."""
    font = ImageFont.load_default(size=float(np.clip(height / 36, 11, 40)))
    assert isinstance(font, ImageFont.FreeTypeFont)  # always so if a size is given
    return font


def legend(scale: ColourScale, unit: str, height: int) -> np.ndarray:
    """Colour bar with ticks: (height, width, 3) uint8."""
    font = text_font(height)
    line = sum(font.getmetrics())
    ticks = scale.ticks()
    labels = [tick_label(tick, signed=scale.diverging) for tick in ticks]
    title = unit  # unchanged: Pillow's own font has neither "²" nor a minus sign
    bar, gap = max(12, height // 30), max(4, height // 100)
    text_width = max(font.getlength(label) for label in [*labels, title])
    width = int(4 * gap + bar + gap + text_width + 2 * gap)
    image = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(image)
    draw.text((2 * gap, 2 * gap), title, fill=INK, font=font)

    top, bottom = 2 * gap + 2 * line, height - 2 * gap - line // 2
    share = (np.arange(bottom - top)[::-1] + 0.5) / (bottom - top)
    colours = encode_srgb(scale.colours(scale.value_at(share)))
    image.paste(Image.fromarray(np.repeat(colours[:, None], bar, axis=1)), (2 * gap, top))
    last = np.inf
    for tick, label in zip(ticks, labels, strict=True):
        y = bottom - float(scale.position(tick)) * (bottom - top)
        draw.line((2 * gap + bar, y, 3 * gap + bar, y), fill=INK)
        if last - y >= line:  # ticks ascend; a label that would touch the previous one is omitted
            draw.text((4 * gap + bar, y), label, fill=INK, font=font, anchor="lm")
            last = y
    return np.asarray(image)


def tick_label(value: float, signed: bool = False) -> str:
    """A round number as a tick's label."""
    text = f"{value:.6g}"
    return f"+{text}" if signed and value > 0 else text


def label_above(pixels: np.ndarray, text: str) -> np.ndarray:
    """The picture with a line of text above it."""
    height, width = pixels.shape[:2]
    font = text_font(height)
    line = int(1.6 * sum(font.getmetrics()))
    image = Image.new("RGB", (width, height + line), PAPER)
    ImageDraw.Draw(image).text((line // 3, line // 2), text, fill=INK, font=font, anchor="lm")
    image.paste(Image.fromarray(pixels), (0, line))
    return np.asarray(image)


def draw_isolines(
    pixels: np.ndarray, values: np.ndarray, levels: np.ndarray, separate: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Draw lines where the values cross a level.

    Parameters
    ----------
    pixels : (height, width, 3) uint8
    values : (height, width), NaN = none
    levels : (k,), rising
    separate : (height, width - 1) and (height - 1, width) bool
        Whether neighbours (right, below) lie on different surfaces.
    """
    band = np.searchsorted(levels, values)
    known = np.isfinite(values)
    right = (band[:, 1:] != band[:, :-1]) & known[:, 1:] & known[:, :-1] & ~separate[0]
    below = (band[1:] != band[:-1]) & known[1:] & known[:-1] & ~separate[1]
    line = np.zeros(values.shape, dtype=bool)
    line[:, 1:] |= right
    line[1:] |= below
    result = pixels.copy()
    dark = pixels.astype(np.int64).sum(axis=2) < 300
    result[line & dark] = pixels[line & dark] // 2 + 110
    result[line & ~dark] = pixels[line & ~dark] // 3
    return result


def draw_outlines(pixels: np.ndarray, separate: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Thin grey lines between neighbours (right, below; see `draw_isolines`) on different surfaces."""
    line = np.zeros(pixels.shape[:2], dtype=bool)
    line[:, 1:] |= separate[0]
    line[1:] |= separate[1]
    result = pixels.copy()
    result[line] = (3 * pixels[line].astype(np.uint16) // 4 + 32).astype(np.uint8)
    return result
