# SPDX-License-Identifier: Apache-2.0
"""The sphere cache, slow and obvious: float64, one segment list per sphere, one walk (paper 2.3)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

CURVE_BITS = 21
BOUNDED_RADII = 3.0


@dataclass
class Walk:
    """What one walk along the samples did; lists are indexed by level."""

    radii: list[float]
    rebuilds: list[int]
    first_misses: list[int]
    lengths: list[list[int]]  # of the sphere's list, at each build
    sphere_tests: int = 0
    disc_tests: int = 0
    hits: int = 0
    visited: list[int] = field(default_factory=list)


def _skilling(x: list[int], bits: int) -> list[int]:
    """Coordinates to the transpose of the place on the Hilbert curve (Skilling 2004, AxestoTranspose)."""
    x = list(x)
    q = 1 << (bits - 1)
    while q > 1:
        for i in range(3):
            if x[i] & q:
                x[0] ^= q - 1
            else:
                t = (x[0] ^ x[i]) & (q - 1)
                x[0] ^= t
                x[i] ^= t
        q >>= 1
    x[1] ^= x[0]
    x[2] ^= x[1]
    t, q = 0, 1 << (bits - 1)
    while q > 1:
        if x[2] & q:
            t ^= q - 1
        q >>= 1
    return [v ^ t for v in x]


def curve_order(points: np.ndarray, order: str) -> list[int]:
    """Indices of the points along the curve through their bounding cube."""
    if order == "none":
        return list(range(len(points)))
    low = points.min(axis=0)
    side = (points.max(axis=0) - low).max()
    keys = []
    for point in points:
        cell = [
            min(int((v - least) / side * 2**CURVE_BITS), 2**CURVE_BITS - 1)
            for v, least in zip(point, low, strict=True)
        ]
        if order == "hilbert":
            cell = _skilling(cell, CURVE_BITS)
        key = "".join(
            f"{a:021b}"[bit] + f"{b:021b}"[bit] + f"{c:021b}"[bit]
            for a, b, c in [cell]
            for bit in range(CURVE_BITS)
        )
        keys.append(int(key, 2))
    return sorted(range(len(points)), key=lambda i: (keys[i], i))


# long: the paper's algorithm in one piece, to be read beside it.
def walk(
    segments,
    samples,
    *,
    ratio: float,
    min_rays: int,
    order: str,
    containment: str,
    outer_radius: float | None,
    segment_end: str = "bounded",
) -> Walk:
    """Visit all samples."""
    o, w = (np.asarray(a, np.float64) for a in (segments.origin, segments.direction))
    first, second = (np.asarray(a, np.float64) for a in (segments.length, segments.extended))
    points, normals = (a.astype(np.float32).astype(np.float64) for a in (samples.points, samples.normals))
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    discs = samples.radius.astype(np.float32).astype(np.float64)

    def ends(radius: float, which: np.ndarray) -> np.ndarray:
        bounded = np.minimum(first[which] + BOUNDED_RADII * radius, second[which])
        return {"first": first[which], "second": second[which], "bounded": bounded}[segment_end]

    squared = np.einsum("ij,ij->i", w, w)
    everything = np.arange(len(o))
    longest = ends(discs.max(), everything)
    if outer_radius is None:
        corners = np.concatenate([o, o + w * longest[:, None]])
        centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
        outer_radius = np.linalg.norm(corners - centre, axis=1).max()
    radii = [outer_radius]
    while outer_radius * ratio ** len(radii) > discs.min():
        radii.append(outer_radius * ratio ** len(radii))

    def meeting(which: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
        """Those of the segments whose distance from the centre is at most the radius."""
        to, way = centre - o[which], w[which]
        t = np.clip(np.einsum("ij,ij->i", to, way) / squared[which], 0, longest[which])
        off = to - t[:, None] * way
        return which[np.sqrt(np.einsum("ij,ij->i", off, off)) <= radius]

    def crossing(which: np.ndarray, i: int) -> int:
        facing = w[which] @ normals[i]
        with np.errstate(all="ignore"):
            s = ((points[i] - o[which]) @ normals[i]) / facing
            offset = o[which] + s[:, None] * w[which] - points[i]
            inside = (offset**2).sum(axis=1) <= discs[i] ** 2
        return int(((facing < 0) & (s > 0) & (s <= ends(discs[i], which)) & inside).sum())

    def holds(level: int, i: int) -> bool:
        to = points[i] - centres[level]
        height = to @ normals[i]
        from_axis = np.sqrt(max(0.0, to @ to - height**2))
        return height**2 + (from_axis + discs[i]) ** 2 <= radii[level] ** 2

    done = Walk(radii, [0] * len(radii), [0] * len(radii), [[] for _ in radii])
    done.lengths[0].append(len(o))
    lists = [everything]  # of S_0, S_1, ... as far as they exist
    centres: list[np.ndarray | None] = [None]
    for i in curve_order(points, order):
        last = max(level for level in range(len(radii)) if level == 0 or radii[level] > discs[i])
        looked_at = range(1, min(len(lists) - 1, last) + 1)
        if containment == "literal":
            keep = max((level for level in looked_at if holds(level, i)), default=0)
        else:
            keep = next((level - 1 for level in looked_at if not holds(level, i)), len(looked_at))
        grows = keep < last and len(lists[keep]) >= min_rays
        if containment == "nested" and grows:
            while keep > 0 and np.linalg.norm(points[i] - centres[keep]) + radii[keep + 1] > radii[keep]:
                keep -= 1
        if keep < len(looked_at):
            done.first_misses[keep + 1] += 1
        if keep < last:
            del lists[keep + 1 :], centres[keep + 1 :]
        while len(lists) <= last and len(lists[-1]) >= min_rays:
            level = len(lists)
            done.sphere_tests += len(lists[-1])
            lists.append(meeting(lists[-1], points[i], radii[level]))
            centres.append(points[i])
            done.rebuilds[level] += 1
            done.lengths[level].append(len(lists[-1]))
        innermost = lists[min(len(lists) - 1, last)]
        done.disc_tests += len(innermost)
        done.hits += crossing(innermost, i)
        done.visited.append(i)
    return done
