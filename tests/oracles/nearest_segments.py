# SPDX-License-Identifier: Apache-2.0
"""The k segments nearest to each sample by all pairs in float64, and irradiance from them."""

from __future__ import annotations

import numpy as np

FARTHEST = 1e15
BOUNDED_RADII = 3.0


def _dot(a, b):
    """In the order x, y, z, so that equal distances come out equal wherever they are computed."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def distances(segments, point, normal, metric: str, segment_end: str) -> tuple[np.ndarray, np.ndarray]:
    """Distance of each segment from one sample, infinite if it does not count, and its weight."""
    o, w = (np.asarray(a, np.float64) for a in (segments.origin, segments.direction))
    x, n = (np.asarray(a, np.float32).astype(np.float64) for a in (point, normal))
    length, extended = (np.asarray(a, np.float64) for a in (segments.length, segments.extended))
    with np.errstate(all="ignore"):
        facing = _dot(n[None], w)
        least, weight = np.zeros(len(o)), np.ones(len(o))
        counts = facing < 0
        if metric == "hit":
            place = o + w * length[:, None]
        else:
            s = _dot(n[None], x - o) / facing
            counts &= (s > 0) & (s <= (length if segment_end == "first" else extended))
            t = s
            if metric == "line":
                t = np.minimum(np.maximum(_dot(x - o, w) / _dot(w, w), 0), s)
                weight = 2 * -facing / (1 - facing)
            place = o + w * t[:, None]
            if segment_end == "bounded":
                least = (s - length) / BOUNDED_RADII
        offset = place - x
        across = np.sqrt(_dot(offset, offset))
        counts &= across <= FARTHEST
    return np.where(counts, np.maximum(least, across), np.inf), weight


def nearest(segments, point, normal, k: int, metric: str, segment_end: str = "bounded"):
    """Rows, distances and weights of the nearest, sorted; ties by what the segments contribute."""
    distance, weight = distances(segments, point, normal, metric, segment_end)
    keys = (*segments.quanta.T[::-1], weight, distance)
    rows = np.lexsort(keys)
    rows = rows[np.isfinite(distance[rows])][:k]
    return rows, distance[rows], weight[rows]


def irradiance(
    segments, samples, *, metric: str, k: int, unbiased: bool = True, segment_end: str = "bounded"
) -> tuple[np.ndarray, int]:
    """(n, 3), power of the k nearest, without the last one if unbiased, over pi r_k²; hits found."""
    out, hits = np.zeros((len(samples), 3)), 0
    for i, (point, normal) in enumerate(zip(samples.points, samples.normals, strict=True)):
        rows, distance, weight = nearest(segments, point, normal, k, metric, segment_end)
        hits += len(rows)
        if len(rows) == 0 or distance[-1] == 0:
            continue
        inner = slice(0, len(rows) - unbiased)
        sums = (weight[inner, None] * segments.quanta[rows[inner]]).sum(axis=0)
        out[i] = sums * segments.quantum / (np.pi * distance[-1] ** 2)
    return out, hits
