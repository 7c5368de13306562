# SPDX-License-Identifier: Apache-2.0
"""A floor of rectangles in the plane y = 0: which hits are on it, and integrals over parts of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from oracles import nearest_photons

ON_FLOOR = 1e-5  # metres; hits are meant to be clearly on it or clearly off
Weight = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Floor:
    """Rectangles (x0, z0, x1, z1) that do not overlap."""

    rectangles: tuple[tuple[float, float, float, float], ...]

    def landed(self, segments) -> np.ndarray:
        """(n,) bool: which segments end on the floor's upper side."""
        with np.errstate(invalid="ignore"):
            x, y, z = ends(segments).T
            inside = np.zeros(len(segments), bool)
            for x0, z0, x1, z1 in self.rectangles:
                inside |= (x > x0) & (x < x1) & (z > z0) & (z < z1)
            return inside & (abs(y) < ON_FLOOR) & (segments.direction[:, 1] < 0)

    def nodes(self, point: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Quadrature over the floor within `radius` of `point`: offsets over the radius, and areas.

        Strips along z between the circle and the borders; their ends are crowded where the circle is
        steep, as x = sin(theta).
        """
        at, share = np.polynomial.legendre.leggauss(16)
        parts = []
        for x0, z0, x1, z1 in self.rectangles:
            low, high = (np.clip((x - point[0]) / radius, -1, 1) for x in (x0, x1))
            angle = np.linspace(np.arcsin(low), np.arcsin(high), 401)
            middle, width = (angle[1:] + angle[:-1]) / 2, angle[1:] - angle[:-1]
            u, half = np.sin(middle), np.cos(middle)
            begin = np.maximum(-half, (z0 - point[2]) / radius)
            reach = np.maximum(0, np.minimum(half, (z1 - point[2]) / radius) - begin) / 2
            v = begin[:, None] + reach[:, None] * (1 + at)
            area = (width * half * reach)[:, None] * share
            parts.append([a.ravel() for a in (np.broadcast_to(u[:, None], v.shape), v, area)])
        u, v, area = (np.concatenate(column) for column in zip(*parts, strict=True))
        return u, v, area

    def integral(self, point: np.ndarray, radius: float, weight: Weight) -> float:
        """Of weight(distance² / radius²) over the floor within `radius` of `point`."""
        u, v, area = self.nodes(point, radius)
        return float(weight(u**2 + v**2) @ area) * radius**2


def ends(segments) -> np.ndarray:
    """(n, 3) ends of the segments, in double precision."""
    with np.errstate(invalid="ignore"):
        return segments.origin.astype(float) + segments.length[:, None].astype(float) * segments.direction


def photon_map(segments, samples, floor: Floor, **options) -> tuple[np.ndarray, int]:
    """Irradiance (n, 3) by the k nearest hits on the floor, over its own area; hits weighed."""
    landed = floor.landed(segments)
    return nearest_photons.irradiance(segments, samples, landed=landed, integral=floor.integral, **options)


def local_linear(segments, samples, floor: Floor, *, kernel: str, bandwidth: float) -> tuple[np.ndarray, int]:
    """Irradiance (n, 3) by planes fitted to the hits' density (normal equations); hits weighed."""
    landed = floor.landed(segments)
    power = segments.quanta[landed].astype(float) * segments.quantum
    at = ends(segments)[landed]
    out, hits = np.zeros((len(samples), 3)), 0
    for i, point in enumerate(samples.points):
        x, _, z = (at - point).T / bandwidth
        inside = x**2 + z**2 < 1
        hits += int(inside.sum())
        u, v, area = floor.nodes(point, bandwidth)
        weight = nearest_photons.KERNELS[kernel]
        basis, at_hits = (np.stack([np.ones_like(a), a, b]) for a, b in ((u, v), (x[inside], z[inside])))
        moments = (basis * weight(u**2 + v**2) * area) @ basis.T
        fitted = np.linalg.solve(moments, (1, 0, 0)) @ at_hits
        share = weight(x[inside] ** 2 + z[inside] ** 2) * fitted
        out[i] = np.maximum(0, share @ power[inside]) / bandwidth**2
    return out, hits
