# SPDX-License-Identifier: Apache-2.0
"""Mean colours of the texels that an object uses: of an atlas its own part, of a cut-out what is opaque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from deltalux.scene.look import Look, Texture
from deltalux.texels import LINEAR_OF_BYTE, Texels

# Points on one object's surface, besides one of each triangle: the more texels, the more points.
LEAST_POINTS, MOST_POINTS = 1 << 13, 1 << 16
PER_TEXEL = 4
ALIKE = 0.004  # means that differ by less are one: about a step of 8-bit sRGB
PER_GLOW = 0.2  # in `ALIKE`, a share of the emission counts as so much of a texel
MANY = 128  # means of one material: after each as many more, four times the difference is alike
_GOLDEN = (5**0.5 - 1) / 2


def used_mean(
    texels: Texels, texture: Texture, opacity: np.ndarray | None, coordinates: np.ndarray, areas: np.ndarray,
    glows: bool = False,
) -> np.ndarray:  # fmt: skip
    """(3,) mean linear texel on a surface, weighted by area and opacity.

    Where nothing is opaque, or no triangle has coordinates, the mean of the whole image.

    Parameters
    ----------
    texels : of the image
    texture : its mapping
    opacity : `Look.opacity`
    coordinates : (m, 3, 2) of the corners; NaN: none
    areas : (m,) of the triangles
    glows : whether the texture is of emission, of which small differences may be large shares
    """
    whole = _whole(texels, opacity)
    known = np.isfinite(coordinates).all(axis=(1, 2))
    corners = texture.transformed(coordinates[known].reshape(-1, 2).astype(np.float64)).reshape(-1, 3, 2)
    weights = areas[known].astype(np.float64)
    if not known.any() or not 0 < weights.sum() < np.inf:
        return whole
    places, weight = _points(corners, weights, texels.sampled.shape)
    place = texture.wrapped(places)
    height, width, _ = texels.sampled.shape
    column = np.minimum((place[:, 0] * width).astype(np.int64), width - 1)
    row = np.minimum((place[:, 1] * height).astype(np.int64), height - 1)
    mean = _mean(texels.sampled[row, column], weight, opacity)
    return whole if mean is None or _apart(mean, whole, glows).max() < ALIKE else mean


def _apart(one: np.ndarray, two: np.ndarray, glows: bool) -> np.ndarray:
    """How much means (..., 3) differ, as texels do; dark pages may hold bright lamps."""
    apart, brighter = np.abs(one - two), np.maximum(one, two)
    if not glows:
        return apart
    return PER_GLOW * np.divide(apart, brighter, out=np.zeros_like(apart), where=brighter > 0)


def _whole(texels: Texels, opacity: np.ndarray | None) -> np.ndarray:
    bands = texels.sampled.shape[2]
    if opacity is None or bands in (1, 3):
        return texels.mean
    every = texels.sampled.reshape(-1, bands)
    found = _mean(every, np.ones(len(every)), opacity)
    return texels.mean if found is None else found


def _mean(texels: np.ndarray, weight: np.ndarray, opacity: np.ndarray | None) -> np.ndarray | None:
    """(3,) weighted mean of texels (k, 1 to 4); None if all of them are transparent."""
    bands = texels.shape[1]
    if opacity is not None and bands in (2, 4):
        weight = weight * opacity[texels[:, -1]]
    total = weight.sum()
    if not total > 0:
        return None
    means = [
        np.bincount(texels[:, band], weight, 256) @ LINEAR_OF_BYTE / total
        for band in range(1 if bands < 3 else 3)
    ]
    return np.clip(np.resize(means, 3), 0.0, 1.0)


def _points(corners: np.ndarray, areas: np.ndarray, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Places (k, 2) spread evenly over triangles (m, 3, 2), and the area (k,) that each represents."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    with np.errstate(over="ignore", invalid="ignore"):
        texels = 0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) * shape[0] * shape[1]
    share = areas / areas.sum()
    wanted = np.clip(np.nan_to_num(PER_TEXEL * texels), LEAST_POINTS * share, MOST_POINTS * share)
    counts = np.ceil(wanted).astype(np.int64) + 1
    triangle = np.repeat(np.arange(len(corners)), counts)
    number = np.arange(len(triangle)) - np.repeat(np.cumsum(counts) - counts, counts)
    # A lattice of the unit square, and the map to a triangle that keeps areas (Turk 1990).
    first = np.sqrt((number + 0.5) / counts[triangle])
    second = (number * _GOLDEN + 0.5) % 1.0
    along, across = (first * (1 - second))[:, None], (first * second)[:, None]
    places = corners[triangle, 0] + along * one[triangle] + across * two[triangle]
    return places, (areas / counts)[triangle]


class SimilarMeans:
    """Different means of one material's textures, each of the reflectance's and the emission's."""

    def __init__(self) -> None:
        self.means: list[np.ndarray] = []

    def number(self, mean: np.ndarray) -> int:
        """Number of `mean` (6,), which may be new, or of one that is alike."""
        if self.means:
            known = np.array(self.means)
            colour, glow = _apart(known[:, :3], mean[:3], False), _apart(known[:, 3:], mean[3:], True)
            apart = np.maximum(colour, glow).max(axis=1)
            nearest = int(apart.argmin())
            if apart[nearest] < ALIKE * 4 ** (len(self.means) // MANY):
                return nearest
        self.means.append(mean)
        return len(self.means) - 1


def means_on(
    look: Look,
    texels: Callable[[Texture], Texels],
    coordinates: np.ndarray | None,
    areas: np.ndarray,
) -> np.ndarray:
    """(6,) mean texels of a look's colour and glow on a surface, 1 without a texture; see `used_mean`."""
    if coordinates is None:
        coordinates = np.full((len(areas), 3, 2), np.nan)
    parts = []
    for texture, weights in ((look.colour, look.opacity), (look.glow, None)):
        if texture is None:
            parts.append(np.ones(3))
        else:
            glows = texture is look.glow
            parts.append(used_mean(texels(texture), texture, weights, coordinates, areas, glows))
    return np.concatenate(parts)


def with_means(look: Look, means: np.ndarray) -> Look:
    """The look with (6,) means of `means_on`."""
    colour, glow = (
        None if texture is None else replace(texture, mean=mean)
        for texture, mean in ((look.colour, means[:3]), (look.glow, means[3:]))
    )
    return replace(look, colour=colour, glow=glow)
