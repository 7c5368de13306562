# SPDX-License-Identifier: Apache-2.0
"""Colours of vertices as few colours of triangles, which materials can have."""

from __future__ import annotations

import numpy as np

MOST = 64  # colours of one primitive; a scene of cubes or of painted parts has fewer
EXACT = 9  # decimals; means of equal corners in another order differ by less
# Steps of the square root of a channel, which are about equally seen; the last one has at most MOST colours.
STEPS = (32, 16, 8, 3)


def tints(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The colours of triangles, each the mean of its corners', rounded if they are many.

    Parameters
    ----------
    corners : (m, 3, 3) linear colour of each corner, 0 to 1

    Returns
    -------
    palette : (k, 3) different colours, at most `MOST`
    number : (m,) index into it
    """
    colours = corners.mean(axis=1)
    palette, number = _distinct(colours.round(EXACT))
    for steps in STEPS:
        if len(palette) <= MOST:
            break
        rounded, number = _distinct(np.rint(np.sqrt(colours) * steps))
        palette = (rounded / steps) ** 2
    return palette, number


def _distinct(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As `np.unique` by rows, which is several times as slow."""
    number = np.zeros(len(rows), np.int64)
    first = number[:1]
    for column in rows.T:
        values, own = np.unique(column, return_inverse=True)
        _, first, number = np.unique(number * len(values) + own, return_index=True, return_inverse=True)
    return rows[first], number
