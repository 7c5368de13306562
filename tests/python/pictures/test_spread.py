# SPDX-License-Identifier: Apache-2.0
"""Light spread between pixels, beside contacts: noise is evened out, shadows keep their depth."""

from __future__ import annotations

import numpy as np
import pytest
from deltalux.rendering.render import AROUND
from deltalux.rendering.seen import Seen
from deltalux.rendering.spread import COARSEST, spread

SIZE = 8 * COARSEST + 1
WIDTH = 0.01  # metres, of a pixel
NOISE = 0.15  # of the light


def wall_and_floor(foot: int) -> Seen:
    """A floor from column `foot` on, and a wall that stands there, pixel by pixel."""
    row, column = (axis.ravel() for axis in np.mgrid[:SIZE, :SIZE])
    floor = column >= foot
    x = np.maximum(column, foot) * WIDTH
    y = np.maximum(foot - column, 0) * WIDTH
    point = np.stack([x, y, row * WIDTH], axis=1)
    normal = np.where(floor[:, None], (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    count = len(row)
    return Seen(
        np.ones(count, dtype=bool), point, normal, np.full(count, WIDTH), np.where(floor, 1, 0),
        np.zeros(count, dtype=int), np.ones((count, 3)), np.zeros((count, 3)), np.ones(count),
    )  # fmt: skip


def light(point: np.ndarray, foot: int, depth: float, reach: float) -> np.ndarray:
    """A shadow that fades with the distance from the wall's foot; walls alike, upwards."""
    away = point[:, 0] - foot * WIDTH + point[:, 1]
    return 1.0 - depth * np.exp(-away / reach)


def errors(foot: int, depth: float, reach: float, noise: float, seed: int) -> np.ndarray:
    """(rows, columns) relative errors of the floor's light, from the wall's foot on."""
    random = np.random.default_rng(seed)

    def ask(places: Seen) -> tuple[np.ndarray, np.ndarray]:
        truth = light(places.point, foot, depth, reach)
        sigma = noise * truth
        found = np.maximum(0.0, random.normal(truth, sigma))
        return np.repeat(found[:, None] / 3, 3, axis=1), sigma

    seen = wall_and_floor(foot)
    values, _ = spread(seen, (SIZE, SIZE), ask, AROUND)
    truth = light(seen.point, foot, depth, reach)
    return (values.sum(axis=1) / truth - 1).reshape(SIZE, SIZE)[:, foot:]


@pytest.mark.parametrize(("foot", "depth"), [(30, 0.0), (32, 0.0), (32, 0.6)])
def test_noise_beside_a_contact_is_evened_out(foot, depth):
    """Of pixels within 8 of a wall's foot; one alone has 15 %, those between, leaning on nothing, 9 to 10."""
    beside = np.stack([errors(foot, depth, 0.3, NOISE, seed)[:, :8] for seed in range(4)])
    assert np.sqrt((beside**2).mean()) < 0.5 * NOISE


@pytest.mark.parametrize("foot", [30, 32, 36])
@pytest.mark.parametrize(("reach", "most"), [(0.3, 0.05), (0.1, 0.12)])
def test_a_shadow_at_a_contact_keeps_its_depth(foot, reach, most):
    """The mean of pixels at the very foot; they were 10 and 27 % too bright as their neighbours are."""
    beside = np.stack([errors(foot, 0.6, reach, 0.05, seed)[:, :8] for seed in range(4)])
    assert np.abs(beside.mean(axis=(0, 1))).max() < most


def test_an_even_floor_stays_even():
    """What is continued beyond the last neighbours is no noise: little more there than elsewhere."""
    found = np.stack([errors(30, 0.0, 1.0, NOISE, seed) for seed in range(4)])
    foot, rest = (np.sqrt((part**2).mean()) for part in (found[:, :, :2], found[:, :, 16:]))
    assert foot < 1.5 * rest
