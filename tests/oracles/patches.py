# SPDX-License-Identifier: Apache-2.0
"""Power that lands on patches, by testing every end against the plane and edges of every patch."""

from __future__ import annotations

import numpy as np

from oracles.flat_floor import ends

ON_PATCH = 1e-4  # metres
ON_EDGE = 2e-5


def sums(segments, corners: np.ndarray) -> tuple[np.ndarray, int, np.ndarray]:
    """Quanta (m, 3) on patches with these corners (m, 3, 3), hits, and where rounding did not decide."""
    total = np.zeros((len(corners), 3), np.int64)
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    # The plane through each patch, and those through its edges, outward.
    planes = [(a, normal)]
    for p, q in ((a, b), (b, c), (c, a)):
        outward = np.cross(q - p, normal)
        planes.append((p, outward / np.linalg.norm(outward, axis=1, keepdims=True)))
    hits = 0
    sure = np.ones(len(corners), bool)
    for at, direction, quanta in zip(ends(segments), segments.direction, segments.quanta, strict=True):
        if not np.isfinite(at).all():
            continue
        off = [((at - p) * outward).sum(axis=1) for p, outward in planes]
        distance = np.max([np.abs(off[0]), *off[1:]], axis=0)
        distance[normal @ direction >= 0] = np.inf
        best = np.argsort(distance)[:2]
        if distance[best[0]] > ON_PATCH:
            continue
        hits += 1
        if distance[best[1]] < ON_EDGE:
            sure[distance < ON_EDGE] = False
        total[best[0]] += quanta
    return total, hits, sure
