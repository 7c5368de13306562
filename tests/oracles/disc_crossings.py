# SPDX-License-Identifier: Apache-2.0
"""Segment-disc crossings in float64, written from the definition (paper 2.1), no code of the core."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BOUNDED_RADII = 3.0
UNIT = 2.0**-24  # rounding of single precision
ROUNDINGS = 16.0  # more than the product's test has on any quantity


@dataclass(frozen=True)
class Crossings:
    """(segments, discs) bool: surely crossed, and possibly crossed if rounding has its way."""

    sure: np.ndarray
    possible: np.ndarray


def crossings(segments, samples, segment_end: str) -> Crossings:
    """All pairs of segments and discs, each classified by how far it is from any border.

    The input is what the product's single precision holds of it. Where the crossing point, its
    distance along the segment or the facing lies within the rounding of a few operations of a
    border, the pair is only `possible`.
    """
    o = np.asarray(segments.origin, np.float64)[:, None]
    w = np.asarray(segments.direction, np.float64)[:, None]
    length = np.asarray(segments.length, np.float64)[:, None]
    extended = np.asarray(segments.extended, np.float64)[:, None]
    c = samples.points.astype(np.float32).astype(np.float64)[None]
    n = samples.normals.astype(np.float32).astype(np.float64)[None]
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
    r = samples.radius.astype(np.float32).astype(np.float64)[None]
    end = {
        "first": length + 0 * r,
        "second": extended + 0 * r,
        "bounded": np.minimum(length + BOUNDED_RADII * r, extended),
    }[segment_end]

    facing = (n * w).sum(axis=-1)
    between = c - o
    height = (n * between).sum(axis=-1)
    facing_error = ROUNDINGS * UNIT * np.ones_like(facing)
    height_error = ROUNDINGS * UNIT * np.abs(between).sum(axis=-1)
    with np.errstate(all="ignore"):
        s = height / facing
        s_error = (height_error + np.abs(s) * facing_error) / np.maximum(np.abs(facing) - facing_error, 0.0)
        offset = o + s[..., None] * w - c
        distance = np.sqrt((offset**2).sum(axis=-1))
        rounding = ROUNDINGS * UNIT * (np.abs(o).sum(axis=-1) + np.abs(c).sum(axis=-1) + np.abs(s))
        distance_error = s_error + rounding
        end_error = s_error + ROUNDINGS * UNIT * np.where(np.isfinite(end), end, 0.0)
        sure = (
            (facing < -facing_error)
            & (s > s_error)
            & (s <= end - end_error)
            & (distance <= r - distance_error)
        )
        # Negations, so that what is not a number counts as possible.
        impossible = (
            (facing > facing_error) | (s < -s_error) | (s > end + end_error) | (distance > r + distance_error)
        )
    return Crossings(sure, ~impossible)
