# SPDX-License-Identifier: Apache-2.0
"""A sheet for a scene: its picture, and beside it tiles of that by each renderer, magnified."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

HEIGHT = 512  # pixels, of the picture and of all tiles
GAP, HEAD = 8, 22
MARKS = ("#e6452e", "#2e8be6", "#f0b429", "#3fb56b", "#a35bd6", "#ffffff")
PAPER, INK = "#1c1c1e", "#f2f2f2"


def write_sheet(file: Path, picture: Path, tiles: NDArray, drawn: Mapping[str, NDArray]) -> None:
    """Write a sheet as a JPEG file.

    Parameters
    ----------
    file : to write
    picture : of the scene, as Deltalux drew it
    tiles : (tiles, side, side) numbers of its pixels, row by row
    drawn : title of a column -> (tiles, side, side, 3) 8-bit sRGB
    """
    with Image.open(picture) as opened:
        whole = opened.convert("RGB")
    count, side = tiles.shape[:2]
    scale = whole.height / HEIGHT
    shown = whole.resize((round(whole.width / scale), HEIGHT), Image.Resampling.LANCZOS)
    mark = ImageDraw.Draw(shown)
    for tile, colour in zip(tiles, MARKS, strict=False):
        y, x = divmod(int(tile[0, 0]), whole.width)
        mark.rectangle(
            [x / scale, y / scale, (x + side) / scale, (y + side) / scale], outline=colour, width=2
        )
    edge = (HEIGHT - (count - 1) * GAP) // count
    width = shown.width + len(drawn) * (edge + GAP)
    sheet = Image.new("RGB", (width, HEIGHT + HEAD), PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    pen.text((4, 4), "Deltalux", fill=INK, font=font)
    sheet.paste(shown, (0, HEAD))
    for column, (title, images) in enumerate(drawn.items()):
        left = shown.width + GAP + column * (edge + GAP)
        pen.text((left, 4), title, fill=INK, font=font)
        for row, (image, colour) in enumerate(zip(images, MARKS, strict=False)):
            top = HEAD + row * (edge + GAP)
            magnified = Image.fromarray(np.ascontiguousarray(image))
            sheet.paste(magnified.resize((edge, edge), Image.Resampling.NEAREST), (left, top))
            pen.rectangle([left, top, left + edge - 1, top + edge - 1], outline=colour, width=2)
    sheet.save(file, quality=85)
