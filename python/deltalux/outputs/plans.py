# SPDX-License-Identifier: Apache-2.0
"""Plans of grids of values: false colours, axes in metres, and values where there is room."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from deltalux.errors import OptionError
from deltalux.quantities import significant
from deltalux.samples import Samples
from deltalux.vectors import unit as unit_vector

from .colour_scale import ColourScale, scale_for
from .drawing import INK, PAPER, draw_isolines, legend, text_font, tick_label
from .images import SURROUNDINGS, Picture
from .tone import encode_srgb

LEAST_HEIGHT = 200  # pixels, so that a legend fits beside the plan
_ALIGNED = 0.99999  # least cosine between a side of the grid and a world axis that counts as parallel
_TICK, _GAP = 5, 6  # pixels
_TICK_DISTANCE = 60  # pixels, least distance between ticks


@dataclass(frozen=True)
class Axis:
    """One side of a grid: its name, the coordinate of the first cell's centre, and the step to the next cell.

    A side parallel to a world axis has that axis' name and coordinates; another one has no name, and
    its coordinates are metres from the first cell.
    """

    name: str
    first: float
    step: float


def plan_axes(samples: Samples) -> tuple[Axis, Axis]:
    """Axes along columns and rows of samples on a grid, computed from the samples' places."""
    assert samples.grid_shape is not None
    columns = samples.grid_shape[1]
    cells = np.arange(len(samples)) if samples.grid_cells is None else samples.grid_cells
    places = np.stack([np.ones(len(cells)), cells % columns, cells // columns], axis=1)
    # If all samples lie in one line, the least squares solution has step zero along the other side.
    origin, along, down = np.linalg.lstsq(places, samples.points, rcond=None)[0]
    return _axis(origin, along), _axis(origin, down)


def _axis(origin: np.ndarray, step: np.ndarray) -> Axis:
    direction = unit_vector(step) if step.any() else step
    main = int(np.abs(direction).argmax())
    if abs(direction[main]) >= _ALIGNED:
        return Axis("XYZ"[main], float(origin[main]), float(step[main]))
    return Axis("", 0.0, float(np.linalg.norm(step)))


def grid_picture(
    values: np.ndarray,
    unit: str,
    *,
    scale: ColourScale | None = None,
    isolux: bool = True,
    longest: int = 800,
    axes: tuple[Axis, Axis] | None = None,
) -> Picture:
    """Heat map of a grid of values, NaN = none.

    Parameters
    ----------
    values : (rows, columns), photopic; the first row is at the top
    unit : str
    scale : None = automatic
    isolux : whether to draw isolines at the scale's ticks
    longest : pixels along the longer side
    axes : along columns and rows; with them, the plan has a margin with coordinates, and values
    """
    values = np.asarray(values, dtype=np.float64)
    if values.ndim != 2 or values.size == 0:
        raise OptionError(f"grid picture: found values of shape {values.shape}, expected (rows, columns)")
    scale = scale or scale_for(values.ravel())
    cell = max(1, longest // max(values.shape))
    fine = _enlarged(values, cell)
    known = np.isfinite(fine)
    pixels = encode_srgb(np.where(known[..., None], scale.colours(np.nan_to_num(fine)), SURROUNDINGS))
    if isolux:
        rows, columns = fine.shape
        joined = np.zeros((rows, columns - 1), dtype=bool), np.zeros((rows - 1, columns), dtype=bool)
        pixels = draw_isolines(pixels, fine, scale.ticks(), joined)
    if axes is not None:
        pixels = _with_axes(_with_values(pixels, values, cell), axes, cell)
    pixels = _padded(pixels, LEAST_HEIGHT)
    return Picture(np.concatenate([pixels, legend(scale, unit, len(pixels))], axis=1), scale=scale)


def _enlarged(values: np.ndarray, cell: int) -> np.ndarray:
    """Bilinear enlargement by `cell`, each value at the centre of its square; NaN cells stay NaN."""
    known = np.isfinite(values)
    if known.all():
        return _between_cells(values, cell)
    total, share = (
        _between_cells(part, cell) for part in (np.where(known, values, 0.0), known.astype(float))
    )
    whole = np.kron(known, np.ones((cell, cell), bool))
    return np.where(whole, total / np.maximum(share, 1e-9), np.nan)


def _between_cells(values: np.ndarray, cell: int) -> np.ndarray:
    for axis in (0, 1):
        count = values.shape[axis]
        at = np.clip((np.arange(count * cell) + 0.5) / cell - 0.5, 0, count - 1)
        low = np.minimum(at.astype(np.int64), max(count - 2, 0))
        high = np.minimum(low + 1, count - 1)
        share = (at - low)[:, None] if axis == 0 else (at - low)[None, :]
        values = values.take(low, axis) * (1 - share) + values.take(high, axis) * share
    return values


def _font(cell: int) -> ImageFont.FreeTypeFont:
    return text_font(max(400, 12 * cell))


def _with_values(pixels: np.ndarray, values: np.ndarray, cell: int) -> np.ndarray:
    """Values at the centres of their cells; only every second, third, … value if they would touch."""
    font = _font(cell)
    labels = {at: significant(float(value), 3) for at, value in np.ndenumerate(values) if np.isfinite(value)}
    if not labels:
        return pixels
    # Only some values of a large grid are drawn; the longest of a sample of labels determines the room.
    widest = max(font.getlength(label) for label in list(labels.values())[:: max(1, len(labels) // 500)])
    across = math.ceil((widest + 2 * _GAP) / cell)
    down = math.ceil((sum(font.getmetrics()) + _GAP) / cell)
    image = Image.fromarray(pixels)
    draw = ImageDraw.Draw(image)
    for (row, column), label in labels.items():
        if row % down == (down - 1) // 2 and column % across == (across - 1) // 2:
            place = ((column + 0.5) * cell, (row + 0.5) * cell)
            draw.text(place, label, fill=INK, font=font, anchor="mm", stroke_width=2, stroke_fill=PAPER)
    return np.asarray(image)


def _with_axes(pixels: np.ndarray, axes: tuple[Axis, Axis], cell: int) -> np.ndarray:
    """The plan with a margin of ticks and coordinates, columns below and rows to the left."""
    height, width = pixels.shape[:2]
    font = text_font(max(height, 400))
    line = sum(font.getmetrics())
    ticks = [_ticks(axis, cell, length) for axis, length in zip(axes, (width, height), strict=True)]
    left = int(max([font.getlength(label) for _, label in ticks[1]], default=0)) + line + _TICK + 3 * _GAP
    right = int(max([font.getlength(label) for _, label in ticks[0]], default=0)) // 2 + _GAP
    top, bottom = 2 * line + _GAP, 2 * line + _TICK + 2 * _GAP
    image = Image.new("RGB", (left + width + right, top + height + bottom), PAPER)
    image.paste(Image.fromarray(pixels), (left, top))
    draw = ImageDraw.Draw(image)
    draw.rectangle((left - 1, top - 1, left + width, top + height), outline=INK)
    for at, label in ticks[0]:
        draw.line((left + at, top + height, left + at, top + height + _TICK), fill=INK)
        draw.text((left + at, top + height + _TICK + _GAP), label, fill=INK, font=font, anchor="mt")
    for at, label in ticks[1]:
        draw.line((left - 1 - _TICK, top + at, left - 1, top + at), fill=INK)
        draw.text((left - 1 - _TICK - _GAP, top + at), label, fill=INK, font=font, anchor="rm")
    names = [f"{axis.name} (m)".strip() for axis in axes]
    draw.text((left + width // 2, top + height + bottom - _GAP), names[0], fill=INK, font=font, anchor="mb")
    # does not touch a tick
    draw.text((_GAP, top - line // 2 - _GAP), names[1], fill=INK, font=font, anchor="lb")
    return np.asarray(image)


def _ticks(axis: Axis, cell: int, length: int) -> list[tuple[float, str]]:
    """Ticks as pixels from the plan's edge and round coordinates; none on a side of one cell."""
    if axis.step == 0:
        return []
    per_pixel = abs(axis.step) / cell
    edge = axis.first - axis.step / 2
    low, high = sorted((edge, edge + axis.step * length / cell))
    rough = per_pixel * _TICK_DISTANCE
    power = 10.0 ** math.floor(math.log10(rough))
    step = power * next(m for m in (1, 2, 5, 10) if m * power >= rough)
    values = np.arange(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1) * step + 0.0
    return [(float((value - edge) / axis.step * cell), tick_label(float(f"{value:.9g}"))) for value in values]


def _padded(pixels: np.ndarray, height: int) -> np.ndarray:
    missing = max(0, height - len(pixels))
    return np.pad(pixels, ((missing // 2, missing - missing // 2), (0, 0), (0, 0)), constant_values=24)
