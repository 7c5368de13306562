# SPDX-License-Identifier: Apache-2.0
"""Computes slowly varying light at few pixels and interpolates it at the others.

Pixels are visited from coarse to fine. A pixel between two neighbours on the same surface with similar
light takes their mean; any other pixel is evaluated: at edges, beside contacts, and where light changes by
more than its noise. The value of a noisy pixel and the value that its neighbours predict are averaged with
weights inverse to their variances, as in a Kalman filter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from scipy.ndimage import maximum_filter

from .seen import Seen, alike, neighbours

COARSEST = 16  # largest distance in pixels between those that are always evaluated
BESIDE_CONTACT = 4  # from this distance on, pixels beside a contact are evaluated
ONE_SIDED = 2  # up to this distance, one neighbour is enough
# bound of the extrapolated change beyond a neighbour, as a share of its light
MOST_ONWARD = 0.5
CONTACT = 3.0  # in pixel widths: largest distance between surfaces that count as touching

ACROSS = ((0, 1), (1, 0))
DIAGONAL = ((1, 1), (1, -1))

SURE = 1.5  # differences of less than this many standard deviations count as noise

Found = tuple[np.ndarray, np.ndarray]  # (k, 3) values, (k,) standard deviation of their channels' sum
Ask = Callable[[Seen], Found]  # evaluates k places


def padded(size: tuple[int, int]) -> tuple[int, int]:
    """Width and height of the padded grid that covers a picture of `size`."""
    width, height = (-(-(n - 1) // COARSEST) * COARSEST + 1 for n in size)
    return width, height


@dataclass(frozen=True)
class Fineness:
    """How much light may differ before a pixel is evaluated.

    Parameters
    ----------
    coarsest : distance in pixels between those that are always evaluated, a power of two
    change : difference between two neighbours, as a share of their mean
    bend : difference between the means of two pairs of neighbours, likewise
    """

    coarsest: int
    change: float
    bend: float

    @property
    def rounds(self) -> int:
        """Most calls of `ask` that `spread` makes."""
        return 1 + 3 * (self.coarsest.bit_length() - 1)


def spread(seen: Seen, size: tuple[int, int], ask: Ask, fineness: Fineness) -> tuple[np.ndarray, np.ndarray]:
    """Values at all pixels of a padded grid.

    Parameters
    ----------
    seen : hits at the centres of the grid's pixels, row by row
    size : (width, height) of the grid, see `padded`
    ask : evaluates places
    fineness : Fineness

    Returns
    -------
    (n, 3) values, 0 where no surface is hit; (n,) bool, pixels that were evaluated
    """
    grid = _Grid(seen, size, ask, fineness)
    grid.begin(grid.every(fineness.coarsest, 0, 0))
    step = fineness.coarsest // 2
    while step:
        grid.fill(grid.every(2 * step, step, step), step, DIAGONAL)
        grid.fill(grid.every(2 * step, 0, step), step, ACROSS)
        grid.fill(grid.every(2 * step, step, 0), step, ACROSS)
        step //= 2
    return grid.values, grid.asked


class _Grid:
    def __init__(self, seen: Seen, size: tuple[int, int], ask: Ask, fineness: Fineness) -> None:
        self._seen, self._ask, self._fineness = seen, ask, fineness
        self._width, self._height = size
        self.values, self._noise = np.zeros((len(seen), 3)), np.zeros(len(seen))
        self.asked = np.zeros(len(seen), dtype=bool)
        self._contact = self._contacts()

    def every(self, step: int, right: int, down: int) -> np.ndarray:
        """Numbers of every `step`-th pixel in both directions, starting at (right, down)."""
        y, x = np.meshgrid(
            np.arange(down, self._height, step), np.arange(right, self._width, step), indexing="ij"
        )
        return (y * self._width + x).ravel()

    def begin(self, pixels: np.ndarray) -> None:
        """Evaluate the pixels of the coarsest grid, then average noisy ones with their neighbours."""
        pixels = pixels[self._seen.hit[pixels]]
        self._ask_for(pixels, _Likely.unknown(len(pixels)))
        likely = _Likely.unknown(len(pixels))
        squares = np.zeros(len(pixels))
        for axis in ACROSS:
            for sign in (1, -1):
                number, usable = self._neighbour(pixels, self._fineness.coarsest, axis, sign)
                likely.add(usable, self.values[number], self._noise[number] ** 2)
                squares += usable * self.values[number].sum(axis=1) ** 2
        apart = squares / np.maximum(likely.count, 1) - likely.mean.sum(axis=1) ** 2
        noise = likely.variance * likely.count  # variance of one neighbour's noise
        likely.doubt = np.where(likely.count > 1, np.maximum(0.0, apart - noise), np.inf)
        self._weigh(pixels, likely)

    def _ask_for(self, pixels: np.ndarray, likely: _Likely) -> None:
        self.asked[pixels] = True
        if len(pixels):
            self.values[pixels], self._noise[pixels] = self._ask(self._seen.at(pixels))
            self._weigh(pixels, likely)

    def _weigh(self, pixels: np.ndarray, likely: _Likely) -> None:
        """Average the values of pixels with the predicted values, by the inverse of their variances."""
        own = self._noise[pixels] ** 2
        other = likely.variance + likely.doubt
        known = (likely.count > 0) & np.isfinite(other) & (own > 0)
        share = np.where(known, own / np.where(known, own + other, 1.0), 0.0)
        self.values[pixels] += share[:, None] * (likely.mean - self.values[pixels])
        self._noise[pixels] *= np.sqrt(1 - share)

    def fill(self, pixels: np.ndarray, step: int, axes: tuple[tuple[int, int], ...]) -> None:
        pixels = pixels[self._seen.hit[pixels]]
        likely = _Likely.unknown(len(pixels))
        wanted = np.zeros(len(pixels), dtype=bool)
        previous = np.full((len(pixels), 3), np.nan), np.zeros(len(pixels))
        for axis in axes:
            there = [self._neighbour(pixels, step, axis, sign) for sign in (1, -1)]
            both = there[0][1] & there[1][1]
            pair = [self.values[number] for number, _ in there]
            variances = [self._noise[number] ** 2 for number, _ in there]
            mean, variance = 0.5 * (pair[0] + pair[1]), 0.25 * (variances[0] + variances[1])
            wanted |= both & _differ(pair[0], pair[1], self._fineness.change, 4 * variance)
            wanted |= both & _differ(mean, previous[0], self._fineness.bend, variance + previous[1])
            previous = np.where(both[:, None], mean, previous[0]), np.where(both, variance, previous[1])
            likely.add(both, mean, variance)
            half = 0.5 * (pair[0] - pair[1]).sum(axis=1)
            likely.doubt = np.maximum(likely.doubt, both * half**2)
        lonely = likely.count == 0
        if step <= ONE_SIDED and lonely.any():
            self._one_sided(pixels, lonely, step, axes, likely)
        wanted |= likely.count == 0
        if step >= BESIDE_CONTACT:
            wanted |= self._beside_contact(pixels, step)
        given = pixels[~wanted]
        self.values[given] = likely.mean[~wanted]
        self._noise[given] = np.sqrt(likely.variance[~wanted])
        self._ask_for(pixels[wanted], likely.at(wanted))

    def _one_sided(
        self,
        pixels: np.ndarray,
        lonely: np.ndarray,
        step: int,
        axes: tuple[tuple[int, int], ...],
        likely: _Likely,
    ) -> None:
        """Predict from one neighbour; its change from the pixel two steps beyond, less noise, continues."""
        for axis in axes:
            for sign in (1, -1):
                number, usable = self._neighbour(pixels, step, axis, sign)
                behind, known = self._neighbour(pixels, 3 * step, axis, sign)
                near, variance = self.values[number], self._noise[number] ** 2
                slope = near - self.values[behind]
                squared = slope.sum(axis=1) ** 2
                beyond_noise = squared - variance - self._noise[behind] ** 2
                share = known * np.maximum(0.0, beyond_noise) / np.maximum(squared, np.finfo(float).tiny)
                onward = np.clip(0.5 * share[:, None] * slope, -MOST_ONWARD * near, MOST_ONWARD * near)
                likely.add(lonely & usable, near + onward, variance)

    def _neighbour(
        self, pixels: np.ndarray, step: int, axis: tuple[int, int], sign: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pixels `sign` * `step` along `axis` (down, right), and whether they lie on the same surface."""
        y, x = np.divmod(pixels, self._width)
        y, x = y + sign * step * axis[0], x + sign * step * axis[1]
        inside = (y >= 0) & (y < self._height) & (x >= 0) & (x < self._width)
        number = np.where(inside, y * self._width + x, pixels)
        return number, inside & alike(self._seen.at(pixels), self._seen.at(number))

    def _contacts(self) -> np.ndarray:
        """(height, width) bool: pixels beside another surface that is near enough to count as touching."""
        touched = np.zeros(len(self._seen), dtype=bool)
        for pairs in neighbours((self._width, self._height)):
            one, two = (side.ravel() for side in pairs)
            a, b = self._seen.at(one), self._seen.at(two)
            near = np.linalg.norm(a.point - b.point, axis=1) <= CONTACT * np.maximum(a.width, b.width)
            touch = a.hit & b.hit & near & ~alike(a, b)
            touched[one] |= touch
            touched[two] |= touch
        return touched.reshape(self._height, self._width)

    def _beside_contact(self, pixels: np.ndarray, step: int) -> np.ndarray:
        return maximum_filter(self._contact, size=2 * step + 1, mode="nearest").ravel()[pixels]


@dataclass
class _Likely:
    """Predicted light at k pixels: mean of neighbours, its variance, and its possible error."""

    count: np.ndarray  # (k,)
    mean: np.ndarray  # (k, 3)
    variance: np.ndarray  # (k,) variance of the channels' sum, due to noise
    doubt: np.ndarray  # (k,) squared possible error, because light may differ there

    @classmethod
    def unknown(cls, k: int) -> _Likely:
        return cls(np.zeros(k), np.zeros((k, 3)), np.zeros(k), np.zeros(k))

    def add(self, use: np.ndarray, values: np.ndarray, variance: np.ndarray) -> None:
        """Include further values (k, 3) in the mean where `use` (k,) is true."""
        count = self.count + use
        share = use / np.maximum(count, 1)
        self.mean += share[:, None] * (values - self.mean)
        self.variance = np.where(use, (1 - share) ** 2 * self.variance + share**2 * variance, self.variance)
        self.count = count

    def at(self, chosen: np.ndarray) -> _Likely:
        return _Likely(*(getattr(self, f.name)[chosen] for f in fields(self)))


def _differ(one: np.ndarray, two: np.ndarray, share: float, variance: np.ndarray) -> np.ndarray:
    """(k,) bool: whether sums of values (k, 3) differ by more than a share of their mean plus noise.

    False where a value is NaN. `variance` (k,) is the variance of the difference.
    """
    a, b = one.sum(axis=1), two.sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(a - b) > share * 0.5 * (a + b) + SURE * np.sqrt(variance))
