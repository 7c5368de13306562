# SPDX-License-Identifier: Apache-2.0
"""Light that varies slowly, found at few pixels and spread to the rest between them.

Pixels are visited from coarse to fine. One that lies between two of the same surface whose light is
alike takes their mean; any other is asked for its own: at edges, beside contacts, where light changes by
more than its noise. What a noisy pixel found for itself, and what those around it make likely, count by
the inverse of their variances, as a Kalman filter has it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from scipy.ndimage import maximum_filter

from .seen import Seen, alike, neighbours

COARSEST = 16  # pixels, at most, between those that are always asked
BESIDE_CONTACT = 4  # this far apart, pixels beside a contact are asked
ONE_SIDED = 2  # this near, one neighbour is enough
MOST_ONWARD = 0.5  # of a neighbour's light, how much more or less there is beyond it
CONTACT = 3.0  # pixels' widths between surfaces that touch

ACROSS = ((0, 1), (1, 0))
DIAGONAL = ((1, 1), (1, -1))

SURE = 1.5  # times the noise: light that differs by less need not differ

Found = tuple[np.ndarray, np.ndarray]  # (k, 3) values, (k,) noise of the sum of their channels
Ask = Callable[[Seen], Found]  # of k places


def padded(size: tuple[int, int]) -> tuple[int, int]:
    """Width and height of the grid that covers a picture of `size`."""
    width, height = (-(-(n - 1) // COARSEST) * COARSEST + 1 for n in size)
    return width, height


@dataclass(frozen=True)
class Fineness:
    """How much light may differ before a pixel is asked.

    Parameters
    ----------
    coarsest : pixels between those that are always asked, a power of two
    change : between neighbours, of their mean
    bend : between the means of two pairs of neighbours
    """

    coarsest: int
    change: float
    bend: float

    @property
    def rounds(self) -> int:
        """How often pixels are asked, at most."""
        return 1 + 3 * (self.coarsest.bit_length() - 1)


def spread(seen: Seen, size: tuple[int, int], ask: Ask, fineness: Fineness) -> tuple[np.ndarray, np.ndarray]:
    """Values of all pixels of a padded grid.

    Parameters
    ----------
    seen : of the centres of its pixels, row by row
    size : (width, height) of the grid, see `padded`
    ask : returns the values of places
    fineness : Fineness

    Returns
    -------
    (n, 3) values, 0 where nothing is hit; (n,) bool, which were asked
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
        """Numbers of the pixels from (right, down) on, `step` apart."""
        y, x = np.meshgrid(
            np.arange(down, self._height, step), np.arange(right, self._width, step), indexing="ij"
        )
        return (y * self._width + x).ravel()

    def begin(self, pixels: np.ndarray) -> None:
        """Ask for these, `coarsest` apart; noisy ones lean on those around them."""
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
        noise = likely.variance * likely.count  # of one of them
        likely.doubt = np.where(likely.count > 1, np.maximum(0.0, apart - noise), np.inf)
        self._weigh(pixels, likely)

    def _ask_for(self, pixels: np.ndarray, likely: _Likely) -> None:
        self.asked[pixels] = True
        if len(pixels):
            self.values[pixels], self._noise[pixels] = self._ask(self._seen.at(pixels))
            self._weigh(pixels, likely)

    def _weigh(self, pixels: np.ndarray, likely: _Likely) -> None:
        """What pixels found, with what is likely there."""
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
        """The light of one neighbour; its change from another, three steps away, goes on beyond its noise."""
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
        """Numbers of the pixels `sign` * `step` along `axis` (down, right), and which are of the surface."""
        y, x = np.divmod(pixels, self._width)
        y, x = y + sign * step * axis[0], x + sign * step * axis[1]
        inside = (y >= 0) & (y < self._height) & (x >= 0) & (x < self._width)
        number = np.where(inside, y * self._width + x, pixels)
        return number, inside & alike(self._seen.at(pixels), self._seen.at(number))

    def _contacts(self) -> np.ndarray:
        """(height, width) bool: another surface begins here, near enough to touch."""
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
    """What is likely at k pixels: means of others, their variance, and how wrong they may be."""

    count: np.ndarray  # (k,)
    mean: np.ndarray  # (k, 3)
    variance: np.ndarray  # (k,) of the sum of the channels, by noise
    doubt: np.ndarray  # (k,) squared, as the light there may be another

    @classmethod
    def unknown(cls, k: int) -> _Likely:
        return cls(np.zeros(k), np.zeros((k, 3)), np.zeros(k), np.zeros(k))

    def add(self, use: np.ndarray, values: np.ndarray, variance: np.ndarray) -> None:
        """Count another (k, 3) in, where `use` (k,) says so."""
        count = self.count + use
        share = use / np.maximum(count, 1)
        self.mean += share[:, None] * (values - self.mean)
        self.variance = np.where(use, (1 - share) ** 2 * self.variance + share**2 * variance, self.variance)
        self.count = count

    def at(self, chosen: np.ndarray) -> _Likely:
        return _Likely(*(getattr(self, f.name)[chosen] for f in fields(self)))


def _differ(one: np.ndarray, two: np.ndarray, share: float, variance: np.ndarray) -> np.ndarray:
    """(k,) bool: values (k, 3) whose sums differ by more than a share of their mean and by more than noise.

    Never where NaN. `variance` (k,) is that of the difference.
    """
    a, b = one.sum(axis=1), two.sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(a - b) > share * 0.5 * (a + b) + SURE * np.sqrt(variance))
