# SPDX-License-Identifier: Apache-2.0
"""Colours of vertices as few colours of triangles, which materials can have."""

from __future__ import annotations

import numpy as np

MOST = 128  # colours of one primitive; a scene of cubes or of painted parts has fewer
EXACT = 9  # decimals; means of equal corners in another order differ by less


def tints(corners: np.ndarray, areas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The colours of triangles, each the mean of its corners'; if they are many, the mean of similar ones.

    The sum of area times colour stays the same. Similar colours are found by halving the most uneven set
    along its most uneven channel (Heckbert 1982, "Color image quantization for frame buffer display", with
    variances for widths), by square roots, which are about equally seen.

    Parameters
    ----------
    corners : (m, 3, 3) linear colour of each corner, 0 to 1
    areas : (m,) of the triangles

    Returns
    -------
    palette : (k, 3) different colours, at most `MOST`
    number : (m,) index into it
    """
    colours = corners.mean(axis=1).round(EXACT)
    palette, number = _distinct(colours)
    if len(palette) <= MOST:
        return palette, number
    weights = np.bincount(number, areas, len(palette)).astype(np.float64)
    weights = weights + 1e-9 * (weights.max() or 1.0)  # colours of triangles without an area have one, too
    sets = _similar(np.sqrt(palette), weights)
    of_set = np.zeros(len(palette), np.int64)
    for i, members in enumerate(sets):
        of_set[members] = i
    means = [np.average(palette[members], axis=0, weights=weights[members]) for members in sets]
    return np.array(means), of_set[number]


def _similar(places: np.ndarray, weights: np.ndarray) -> list[np.ndarray]:
    """`MOST` sets of the numbers of `places` (n, 3), or fewer if there are fewer different ones."""
    sets = [np.arange(len(places))]
    spreads = [_spread(places, weights)]
    while len(sets) < MOST:
        most = int(np.argmax([spread.max() for spread in spreads]))
        channel = int(np.argmax(spreads[most]))
        members = sets[most]
        own = places[members, channel]
        low = own <= np.average(own, weights=weights[members])
        if low.all():  # equal, up to rounding
            break
        sets[most : most + 1] = [members[low], members[~low]]
        spreads[most : most + 1] = [_spread(places[part], weights[part]) for part in sets[most : most + 2]]
    return sets


def _spread(places: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(3,) weighted sums of squared distances from the mean."""
    return weights @ (places - np.average(places, axis=0, weights=weights)) ** 2


def _distinct(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As `np.unique` by rows, which is several times as slow."""
    number = np.zeros(len(rows), np.int64)
    first = number[:1]
    for column in rows.T:
        values, own = np.unique(column, return_inverse=True)
        _, first, number = np.unique(number * len(values) + own, return_index=True, return_inverse=True)
    return rows[first], number
