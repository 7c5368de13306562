# SPDX-License-Identifier: Apache-2.0
"""Random segments and discs for the disc methods, with what is degenerate well represented."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import deltalux as dl
import numpy as np
import thoroughness
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

SEGMENT_KINDS = (
    "free",  # anywhere
    "aimed",  # through a disc, or just past it
    "rim",  # through the rim of a disc, as exactly as numbers allow
    "ends on the plane",
    "starts on the plane",
    "in the plane",
    "parallel",  # close to the plane of a disc and parallel to it
    "grazing",
    "no length",
    "endless",
    "along an axis",
)
DISC_KINDS = ("free", "coplanar", "coincident", "lattice", "nested", "back to back")
SCALES = (1e-6, 1.0, 1.0, 1.0, 3e3, 1e13)  # metres


@dataclass(frozen=True)
class World:
    """Segments and samples, and how they were made."""

    about: str
    segments: dl.Segments
    samples: dl.Samples

    def __repr__(self) -> str:
        return f"World({self.about}: {len(self.segments)} segments, {len(self.samples)} samples)"


def examples(count: int) -> settings:
    """Decoration of a test: so many examples in `make test-all`, the same in every run."""
    return settings(
        max_examples=thoroughness.examples(round(count / 0.3)), suppress_health_check=[HealthCheck.too_slow]
    )


def pick(samples: dl.Samples, rows: np.ndarray) -> dl.Samples:
    """These samples as they are: the constructor would scale the normals again, an ulp off."""
    part = copy(samples)
    for name in ("points", "normals", "radius", "attached"):
        setattr(part, name, getattr(samples, name)[rows])
    return part


def nothing() -> tuple[dl.Segments, dl.Samples]:
    """No segments and no samples."""
    none = np.zeros((0, 3))
    return dl.Segments(none, none, np.zeros(0), np.zeros(0)), dl.Samples(none, none, radius=0.1)


def _unit(rng: np.random.Generator, count: int) -> np.ndarray:
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _axis(rng: np.random.Generator, count: int) -> np.ndarray:
    return np.eye(3)[rng.integers(0, 3, count)] * rng.choice([-1.0, 1.0], (count, 1))


def make_discs(rng: np.random.Generator, kind: str, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres in [-1, 1]^3, normals and radii."""
    centre, normal = rng.uniform(-1, 1, (count, 3)), _unit(rng, count)
    radius = rng.uniform(0.02, 0.6, count)
    if kind == "coplanar":
        centre[:, 1], normal[:] = 0.25, (0, 1, 0)
    elif kind == "coincident":
        centre[:], normal[:], radius[:] = centre[:1], normal[:1], radius[:1]
    elif kind == "lattice":
        centre, normal = np.round(centre * 4) / 4, _axis(rng, count)
        radius = rng.choice([0.125, 0.25, 0.5], count)
    elif kind == "nested":
        centre[:], normal[:] = centre[:1], normal[:1]
        radius = 0.6 * 0.7 ** np.arange(count)
    elif kind == "back to back":
        centre[1::2], normal[1::2] = centre[: count - 1 : 2], -normal[: count - 1 : 2]
    return centre, normal, radius


def make_segments(
    rng: np.random.Generator,
    kind: str,
    count: int,
    discs: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Origins, directions, lengths and lengths to the second hit."""
    origin, direction = rng.uniform(-1.5, 1.5, (count, 3)), _unit(rng, count)
    length = rng.exponential(1.5, count)
    if len(discs[0]):
        which = rng.integers(0, len(discs[0]), count)
        centre, normal, radius = (values[which] for values in discs)
        across = _unit(rng, count)
        across -= (across * normal).sum(axis=1, keepdims=True) * normal
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        share = {"rim": np.ones(count)}.get(kind, rng.uniform(0, 1.3, count))
        target = centre + across * (radius * share)[:, None]
        before = rng.uniform(0.1, 2, count)
        if kind in ("aimed", "rim", "ends on the plane", "starts on the plane"):
            origin = target - direction * before[:, None]
            length = before * rng.choice([0.5, 1.5, 3.0], count)
        if kind == "ends on the plane":
            length = before
        if kind == "starts on the plane":
            origin, length = target, before
        if kind in ("in the plane", "parallel"):
            origin, direction = centre - 2 * radius[:, None] * across, across
            if kind == "parallel":
                origin = origin + normal * (radius * rng.choice([1e-7, 1e-3, -1e-7], count))[:, None]
        if kind == "grazing":
            direction = across - normal * 10.0 ** rng.uniform(-8, -2, (count, 1))
            origin = centre - direction * (2 * radius)[:, None]
    if kind == "no length":
        length = np.zeros(count)
    if kind == "endless":
        length = np.full(count, np.inf)
    if kind == "along an axis":
        origin, direction = np.round(origin * 4) / 4, _axis(rng, count)
        length = rng.choice([0.25, 0.5, 2.0], count)
    extended = length + rng.choice([0.0, 0.125, 1.0, np.inf], count)
    return origin, direction, length, extended


@st.composite
def worlds(draw: st.DrawFn, most_segments: int = 120, most_discs: int = 40) -> World:
    """Discs of one kind, segments of several kinds, at any scale, anywhere."""
    seed = draw(st.integers(0, 2**32 - 1))
    disc_kind = draw(st.sampled_from(DISC_KINDS))
    kinds = draw(st.lists(st.sampled_from(SEGMENT_KINDS), min_size=1, max_size=4))
    disc_count = draw(st.integers(0, most_discs))
    counts = [draw(st.integers(0, most_segments // len(kinds))) for _ in kinds]
    scale, far = draw(st.sampled_from(SCALES)), draw(st.sampled_from((0.0, 0.0, 30.0)))
    rng = np.random.default_rng(seed)
    discs = make_discs(rng, disc_kind, disc_count)
    parts = [make_segments(rng, kind, count, discs) for kind, count in zip(kinds, counts, strict=True)]
    origin, direction, length, extended = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    offset = far * np.array([1.0, -1.0, 0.5])
    power = rng.exponential(1.0, (len(origin), 3)) * rng.choice([0.0, 1.0, 1.0], (len(origin), 3))
    about = f"{disc_kind} discs, {kinds} segments, scale {scale:g}, offset {far:g}, seed {seed}"
    segments = dl.Segments(
        (origin + offset) * scale, direction, length * scale, power, extended=extended * scale
    )
    samples = dl.Samples((discs[0] + offset) * scale, discs[1], radius=discs[2] * scale)
    return World(about, segments, samples)


_NUMBER = st.one_of(
    st.sampled_from([0.0, -0.0, 0.5, 1.0, -1.0, 1e-30, 1e-45, 1e14, -1e14]),
    st.floats(-2, 2, width=32),
)
_VECTOR = st.tuples(_NUMBER, _NUMBER, _NUMBER)
_DIRECTION = _VECTOR.filter(lambda v: max(map(abs, v)) > 1e-20)
_LENGTH = st.one_of(st.sampled_from([0.0, 1.0, 1e-45, 1e30, np.inf]), st.floats(0, 4, width=32))


@st.composite
def few(draw: st.DrawFn) -> World:
    """A handful of segments and discs out of numbers that Hypothesis chooses itself."""
    flights = draw(st.lists(st.tuples(_VECTOR, _DIRECTION, _LENGTH, _LENGTH), max_size=4))
    discs = draw(st.lists(st.tuples(_VECTOR, _DIRECTION, st.floats(0.0625, 4, width=32)), max_size=4))
    origin, direction, length, extended = zip(*flights, strict=True) if flights else ((), (), (), ())
    points, normals, radius = zip(*discs, strict=True) if discs else ((), (), ())

    def rows(values):
        return np.array(values, float).reshape(-1, 3)

    segments = dl.Segments(
        rows(origin),
        rows(direction),
        np.array(length, float),
        np.ones(len(flights)),
        np.array(extended, float),
    )
    return World("few", segments, dl.Samples(rows(points), rows(normals), np.array(radius, float)))
