# SPDX-License-Identifier: Apache-2.0
"""The k hits nearest to each sample by all pairs in float64, and irradiance from them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

CONE = 1.1
KERNELS: dict[str, Callable[[np.ndarray], np.ndarray]] = {  # of squared distances over the farthest's
    "constant": np.ones_like,
    "cone": lambda share2: 1 - np.sqrt(share2) / CONE,
    "epanechnikov": lambda share2: 1 - share2,
}
DISC_SHARES = {"constant": 1.0, "cone": 1 - 2 / (3 * CONE), "epanechnikov": 0.5}  # integrals over pi r²


def nearest(segments, photons, point, normal, k: int, compression: float) -> tuple[np.ndarray, np.ndarray]:
    """Squared distances of the k nearest of these photons and their rows, nearest first."""
    direction = segments.direction.astype(float)
    n = normal
    facing = n[0] * direction[:, 0] + n[1] * direction[:, 1] + n[2] * direction[:, 2]
    photons = np.flatnonzero(photons & np.isfinite(segments.length) & (facing < 0))
    length = segments.length[photons, None].astype(float)
    gap = segments.origin[photons].astype(float) + length * direction[photons] - point
    height = gap[:, 0] * n[0] + gap[:, 1] * n[1] + gap[:, 2] * n[2]
    distance2 = gap[:, 0] ** 2 + gap[:, 1] ** 2 + gap[:, 2] ** 2 + (compression**2 - 1) * height**2
    # Of equally far photons the weaker one is nearer; the rest of the order makes it total.
    keys = (
        segments.length[photons],
        *segments.origin[photons].T[::-1],
        *direction[photons].T[::-1],
        *segments.quanta[photons].T[::-1],
    )
    order = np.lexsort((*keys, distance2))[:k]
    return distance2[order], photons[order]


def irradiance(
    segments,
    samples,
    *,
    k: int,
    kernel: str = "constant",
    unbiased: bool = True,
    compression: float = 1.0,
    landed: np.ndarray | None = None,
    integral: Callable[[np.ndarray, float, Callable], float] | None = None,
) -> tuple[np.ndarray, int]:
    """Irradiance (n, 3) and the number of hits weighed.

    Parameters
    ----------
    landed : (m,) bool, segments whose hits count; None = all
    integral : of a kernel over the surfaces within a radius of a point; None = over a disc
    """
    photons = np.ones(len(segments), bool) if landed is None else landed
    out, hits = np.zeros((len(samples), 3)), 0
    for i, (point, normal) in enumerate(zip(samples.points, samples.normals, strict=True)):
        distance2, rows = nearest(segments, photons, point, normal, k, compression)
        if not len(rows):
            continue
        radius2 = distance2[-1]
        if unbiased:
            distance2, rows = distance2[:-1], rows[:-1]
        hits += len(rows)
        if radius2 == 0:
            continue
        power = segments.quanta[rows].astype(float) * segments.quantum
        weight = KERNELS[kernel](distance2 / radius2)
        if integral is None:
            area = DISC_SHARES[kernel] * np.pi * radius2
        else:
            area = integral(point, np.sqrt(radius2), KERNELS[kernel])
        out[i] = weight @ power / area if area > 0 else 0
    return out, hits
