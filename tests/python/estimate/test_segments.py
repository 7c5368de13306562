# SPDX-License-Identifier: Apache-2.0
"""Segments from `dl.trace` and `dl.uniform_lines`: light paths as arrays."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import room
from scipy import stats

COLUMNS = ("origin", "direction", "length", "extended", "quanta", "path", "bounce", "group", "primitive")
SLACK = np.float32(2.0**-19)  # of the largest coordinate: how far off a surface rays begin, see vec.h


def lifted(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Centres of whole discs in free air, in the core's arithmetic: twice the slack above their samples."""
    place = points.astype(np.float32)
    slack = SLACK * np.abs(place).max(axis=1, keepdims=True)
    return place + normals.astype(np.float32) * (np.float32(2) * slack)


@pytest.fixture(scope="module")
def traced():
    return dl.trace(room(), paths=4000, seed=3)


def equal(a: dl.Segments, b: dl.Segments) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in COLUMNS)


# ---- determinism ------------------------------------------------------------------------------


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_same_seed_same_bits(traced, threads):
    again = dl.trace(room(), paths=4000, seed=3, threads=threads)
    assert equal(again, traced)
    assert again.quantum == traced.quantum


def test_seeds_matter(traced):
    assert not equal(dl.trace(room(), paths=4000, seed=4), traced)


def test_fewer_bounces_are_the_beginning_of_the_paths(traced):
    """Every random number belongs to its path and bounce, so a cap cuts paths and changes nothing else."""
    short = dl.trace(room(), paths=4000, seed=3, max_bounces=3)
    assert equal(short, traced.select(traced.bounce < 3))
    assert short.bounce.max() == 2


# ---- paths ------------------------------------------------------------------------------------


def test_columns_fit_together(traced):
    count = len(traced)
    assert traced.origin.shape == traced.direction.shape == traced.power.shape == (count, 3)
    np.testing.assert_allclose(np.linalg.norm(traced.direction, axis=1), 1, atol=3e-7)
    assert (traced.length >= 0).all()
    assert (traced.extended >= traced.length).all()
    assert np.isfinite(traced.extended).all()
    np.testing.assert_array_equal(traced.power, traced.quanta * traced.quantum)
    assert len(np.unique(traced.path)) == 4000


def links(segments):
    """Pairs of rows: a flight and the next one of the same path."""
    order = np.lexsort((segments.bounce, segments.path))
    same = segments.path[order[1:]] == segments.path[order[:-1]]
    return order[:-1][same], order[1:][same]


def test_paths_are_chains(traced):
    order = np.lexsort((traced.bounce, traced.path))
    first = np.r_[True, traced.path[order][1:] != traced.path[order][:-1]]
    assert (traced.bounce[order][first] == 0).all()
    here, there = links(traced)
    assert len(here) > 2000
    np.testing.assert_array_equal(traced.bounce[there], traced.bounce[here] + 1)
    np.testing.assert_array_equal(traced.group[there], traced.group[here])
    # Of three channels only the strongest keeps its power, and none ever gains.
    assert (traced.quanta[there] <= traced.quanta[here]).all()
    assert (traced.quanta[there] < traced.quanta[here]).any()


def test_flights_begin_where_the_last_one_ended(traced):
    here, there = links(traced)
    end = traced.origin[here] + traced.direction[here].astype(float) * traced.length[here, None]
    gap = np.linalg.norm(traced.origin[there] - end, axis=1)
    # The slack of the end and of the flight above the surface, and a little for the triangle's plane;
    # mostly back along the flight: farther where it came at a slant. Coordinates round by 2e-7.
    flight = traced.direction[here] * traced.length[here, None]
    least = SLACK * np.maximum(np.abs(end).max(axis=1), np.abs(flight).max(axis=1))
    assert (gap > least - 1e-6).all()
    assert (gap < 17 * (least + 4e-6)).all()
    beside = np.linalg.norm(
        np.cross(traced.origin[there] - end, traced.direction[here].astype(float)), axis=1
    )
    assert np.median(beside) < 1e-6


def test_closed_rooms_keep_everything(traced):
    """No flight leaves a closed room, and none passes its walls."""
    end = traced.origin + traced.direction * traced.length[:, None]
    assert (np.abs(end) < np.array([2, 2, 1.5]) + 1e-4).all()
    assert (traced.primitive != 0xFFFFFFFF).all()


def test_birth_carries_the_power_of_the_lights(traced):
    """Per channel: pi L A for area lights, I times solid angle for the spot; up to half a quantum a path."""
    born = traced.bounce == 0
    emitted = traced.power[born].sum(axis=0)
    ceiling = np.pi * 5 * 0.64 * 2 * np.ones(3)
    desk = np.pi * np.array([3, 2, 1]) * 6 * 0.04 * 0.5
    inner, outer = 1.0, np.cos(0.7)
    spot = 2 * 2 * np.pi * ((1 - inner) + (inner - outer) / 3) * np.ones(3)
    np.testing.assert_allclose(emitted, ceiling + desk + spot, rtol=1e-6)
    groups = [traced.power[born & (traced.group == g)].sum(axis=0) for g in range(2)]
    np.testing.assert_allclose(groups, [desk + spot, ceiling], rtol=1e-6)


# ---- the same segments as a session's -----------------------------------------------------------


@pytest.mark.parametrize("end", ["first", "second", "bounded"])
def test_a_session_stores_these_segments(end):
    """Sums of a session in free air == the disc index over traced segments, to the bit."""
    scene = room()
    rng = np.random.default_rng(5)
    points = rng.uniform((-1.6, 0.4, -1.1), (1.6, 1.7, 1.1), (120, 3))
    normals = np.eye(3)[rng.integers(0, 3, 120)] * rng.choice([-1.0, 1.0], (120, 1))
    samples = dl.Samples(points, normals, radius=rng.uniform(0.05, 0.3, 120))
    segments = dl.trace(scene, paths=20_000, seed=9)
    options = {"paths": 20_000, "seed": 9, "disc_area": "whole", "segment_end": end, "direct": "paths"}
    with dl.Session(scene, samples, **options) as session:
        session.bake()
        sums, energy = session.sums, session.energy
        assert session.statistics["segments"] == len(segments)
    centres = lifted(points, normals)
    expected = dl.estimate.disc_index(
        segments, dl.Samples(centres, normals, radius=samples.radius), segment_end=end
    )
    assert energy["quantum"] == segments.quantum
    assert expected.stats["hits"] > 5000
    np.testing.assert_array_equal(sums, expected.sums)


def test_a_session_that_samples_direct_light_stores_the_later_bounces():
    scene = room()
    points = np.random.default_rng(5).uniform((-1.6, 0.4, -1.1), (1.6, 1.7, 1.1), (60, 3))
    samples = dl.Samples(points, (0, 1, 0), radius=0.25)
    segments = dl.trace(scene, paths=10_000)
    with dl.Session(scene, samples, paths=10_000, disc_area="whole", direct="sampled") as session:
        session.bake()
        sums = session.sums
    centres = lifted(points, np.array([[0, 1, 0]]))
    indirect = dl.estimate.disc_index(
        segments, dl.Samples(centres, (0, 1, 0), radius=0.25), segment_end="first", first_bounce=1
    )
    np.testing.assert_array_equal(sums, indirect.sums)


# ---- uniform lines ----------------------------------------------------------------------------

LINES = 200_000


@pytest.fixture(scope="module")
def lines():
    return dl.uniform_lines(LINES, seed=11)


def ends_of(lines):
    return lines.origin.astype(float), lines.origin + lines.direction.astype(float) * lines.length[:, None]


def test_chords_end_on_the_sphere(lines):
    for points in ends_of(lines):
        np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=1e-6)


def test_mean_chord_is_four_thirds(lines):
    """Length l has density l/2 on [0, 2]: mean 4/3, variance 2/9. Four standard errors."""
    length = lines.length.astype(float)
    assert abs(length.mean() - 4 / 3) < 4 * np.sqrt(2 / 9 / LINES)
    # Not only the mean: l²/4 is uniform. The seed is fixed; chance of a false alarm 1e-4.
    assert stats.kstest(length**2 / 4, "uniform").pvalue > 1e-4


def test_ends_are_uniform_and_independent(lines):
    start, end = ends_of(lines)
    for points in (start, end):
        for axis in range(3):
            assert stats.kstest((points[:, axis] + 1) / 2, "uniform").pvalue > 1e-4
    # Components of independent points: products have mean 0 and variance 1/9.
    assert (np.abs(start.T @ end / LINES) < 4.5 / 3 / np.sqrt(LINES)).all()


def test_lines_depend_on_the_seed_alone(lines):
    assert equal_lines(dl.uniform_lines(LINES, seed=11), lines)
    assert not equal_lines(dl.uniform_lines(LINES, seed=12), lines)
    np.testing.assert_array_equal(dl.uniform_lines(100, seed=11).origin, lines.origin[:100])
    np.testing.assert_allclose(lines.power.sum(axis=0), 1)


def equal_lines(a, b):
    return np.array_equal(a.origin, b.origin) and np.array_equal(a.direction, b.direction)


# ---- arguments ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [
        {"paths": 0},
        {"paths": 2.5},
        {"paths": 2**32},
        {"seed": -1},
        {"seed": 2**64},
        {"threads": 0},
        {"threads": -3},
        {"max_bounces": 0},
        {"max_bounces": 10_001},
    ],
    ids=str,
)
def test_wrong_options_are_refused(options):
    with pytest.raises(dl.OptionError, match=next(iter(options))):
        dl.trace(room(), **options)


@pytest.mark.parametrize("arguments", [(0,), (2**33,), (1.5,), (5, -1)])
def test_wrong_lines_are_refused(arguments):
    with pytest.raises(dl.OptionError, match="found"):
        dl.uniform_lines(*arguments)


def test_selection_keeps_quanta(traced):
    late = traced.select(traced.bounce >= 2)
    assert 0 < len(late) < len(traced)
    assert late.quantum == traced.quantum
    np.testing.assert_array_equal(late.quanta, traced.quanta[traced.bounce >= 2])


def test_tracing_can_be_cancelled():
    with pytest.raises(dl.Cancelled):
        dl.trace(dl.scenes.office(), paths=3_000_000, progress=lambda stage, fraction: False)
