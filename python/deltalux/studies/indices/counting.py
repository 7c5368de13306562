# SPDX-License-Identifier: Apache-2.0
"""Shared by the counting indices: boxes of discs, the disc test on pairs, and the work per ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux.samples import Samples
from deltalux.segments import Segments

PAD = 1e-4  # margin of a box, in radii, that covers the rounding of the single-precision disc test


@dataclass(frozen=True)
class RayCosts:
    """Work of each ray, and the resulting sums of the discs.

    Attributes
    ----------
    steps : (rays,) number of boxes tested, or of cells visited
    tests : (rays,) number of disc tests; a disc in several cells counts each time
    sums : (discs, 3) int64, in quanta, as for every disc method
    """

    steps: np.ndarray
    tests: np.ndarray
    sums: np.ndarray


def disc_boxes(samples: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners (discs, 3) of boxes around discs, with a margin of `PAD`."""
    unit = samples.normals / np.linalg.norm(samples.normals, axis=1, keepdims=True)
    reach = samples.radius[:, None] * (np.sqrt(np.clip(1 - unit**2, 0, 1)) + PAD)
    return samples.points - reach, samples.points + reach


def crosses(segments: Segments, rays: np.ndarray, samples: Samples, discs: np.ndarray) -> np.ndarray:
    """Whether each ray crosses its disc from the front before its first hit (paper 2.1).

    The core's test, step by step in single precision, so that both agree to the bit.

    Parameters
    ----------
    segments, samples : the rays, and the samples with the discs
    rays, discs : (pairs,) indices of the pairs to test
    """
    origin, direction = segments.origin[rays], segments.direction[rays]
    centre, normal, radius = (
        np.asarray(array, np.float32)[discs] for array in (samples.points, samples.normals, samples.radius)
    )
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        normal = normal * (np.float32(1) / np.sqrt(_dot(normal, normal)))[:, None]  # as the core does
        facing = _dot(normal, direction)
        along = _dot(normal, centre - origin) / facing
        offset = (origin + along[:, None] * direction) - centre
        near = _dot(offset, offset) <= radius * radius
        return (facing < 0) & (along > 0) & (along <= segments.length[rays]) & near


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


class Tally:
    """Counts the work of each ray, and sums each crossing of a ray and a disc once."""

    def __init__(self, segments: Segments, samples: Samples) -> None:
        self._segments, self._samples = segments, samples
        self._steps, self._tests = (np.zeros(len(segments), np.int64) for _ in range(2))
        self._found: list[np.ndarray] = []

    def step(self, rays: np.ndarray) -> None:
        """Count one step for each of these rays, which may repeat."""
        self._steps += np.bincount(rays, minlength=len(self._steps))

    def test(self, rays: np.ndarray, discs: np.ndarray) -> None:
        """Test each ray against its disc."""
        self._tests += np.bincount(rays, minlength=len(self._tests))
        hit = crosses(self._segments, rays, self._samples, discs)
        self._found.append(np.unique(rays[hit] * len(self._samples) + discs[hit]))

    def costs(self) -> RayCosts:
        """The counts and sums so far."""
        pairs = np.unique(np.concatenate(self._found)) if self._found else np.zeros(0, np.int64)
        rays, discs = np.divmod(pairs, len(self._samples))
        sums = np.zeros((len(self._samples), 3), np.int64)
        np.add.at(sums, discs, self._segments.quanta[rays].astype(np.int64))
        return RayCosts(self._steps, self._tests, sums)


def expand(rays: np.ndarray, start: np.ndarray, count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pair each ray with all of its range start, start + 1, … of a list."""
    owner = np.repeat(np.arange(len(rays)), count)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    return rays[owner], start[owner] + place
