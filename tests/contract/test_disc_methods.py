# SPDX-License-Identifier: Apache-2.0
"""The contract of disc methods: exact, order-free, additive sums that are equal for all of them.

The first one is the reference of the others.
"""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from hypothesis import given
from oracles.disc_crossings import crossings

from contract.disc_worlds import World, examples, few, nothing, pick, worlds
from contract.methods import DISC_METHODS as METHODS

ENDS = ["first", "second", "bounded"]

every_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: m.__name__)
every_other_method = pytest.mark.parametrize("method", METHODS[1:], ids=lambda m: m.__name__)
every_end = pytest.mark.parametrize("end", ENDS)


def one_disc(radius=1.0):
    return dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=radius)


def check(method, world: World):
    """Compare with the reference under every rule."""
    for end in ENDS:
        expected = METHODS[0](world.segments, world.samples, segment_end=end)
        found = method(world.segments, world.samples, segment_end=end)
        np.testing.assert_array_equal(found.sums, expected.sums)
        assert found.stats["hits"] == expected.stats["hits"]


# ---- equal to each other and to an oracle -----------------------------------------------------


@every_other_method
@examples(100)
@given(world=worlds())
def test_equals_the_reference(method, world: World):
    check(method, world)


@every_other_method
@examples(100)
@given(world=few())
def test_equals_the_reference_on_chosen_numbers(method, world: World):
    check(method, world)


@every_method
@examples(40)
@given(world=worlds())
def test_agrees_with_float64_but_for_rounding_at_borders(method, world: World):
    """Sums lie between those of the sure crossings and those of the possible ones, exactly."""
    quanta = world.segments.quanta.astype(np.int64)
    for end in ENDS:
        found = method(world.segments, world.samples, segment_end=end)
        pairs = crossings(world.segments, world.samples, end)
        least, most = (which.T.astype(np.int64) @ quanta for which in (pairs.sure, pairs.possible))
        assert (least <= found.sums).all()
        assert (found.sums <= most).all()
        assert pairs.sure.sum() <= found.stats["hits"] <= pairs.possible.sum()


@every_end
def test_the_oracle_decides_nearly_all_pairs(end):
    """Else the test above would say little: random pairs leave less than one in 10,000 open."""
    rng = np.random.default_rng(7)
    count = 3000
    directions = rng.normal(size=(count, 3))
    segments = dl.Segments(rng.uniform(-1, 1, (count, 3)), directions, rng.uniform(0, 2, count), 1.0)
    samples = dl.Samples(rng.uniform(-1, 1, (300, 3)), rng.normal(size=(300, 3)), radius=0.2)
    pairs = crossings(segments, samples, end)
    assert pairs.sure.sum() > 2000
    assert (pairs.possible & ~pairs.sure).sum() < 1e-4 * pairs.sure.size
    for method in METHODS:
        hits = method(segments, samples, segment_end=end).stats["hits"]
        assert pairs.sure.sum() <= hits <= pairs.possible.sum()


# ---- additive, in any order, by any number of threads -------------------------------------------


@every_method
@examples(25)
@given(world=worlds())
def test_parts_add_up(method, world: World):
    whole = method(world.segments, world.samples)
    odd = np.arange(len(world.segments)) % 2 == 1
    parts = [method(world.segments.select(which), world.samples) for which in (odd, ~odd)]
    np.testing.assert_array_equal(parts[0].sums + parts[1].sums, whole.sums)
    assert parts[0].stats["hits"] + parts[1].stats["hits"] == whole.stats["hits"]


@every_method
@examples(25)
@given(world=worlds())
def test_order_does_not_matter(method, world: World):
    rng = np.random.default_rng(len(world.segments))
    expected = method(world.segments, world.samples)
    shuffled = world.segments.select(rng.permutation(len(world.segments)))
    order = rng.permutation(len(world.samples))
    samples = pick(world.samples, order)
    np.testing.assert_array_equal(method(shuffled, world.samples).sums, expected.sums)
    np.testing.assert_array_equal(method(world.segments, samples).sums, expected.sums[order])


@every_method
@every_end
def test_threads_do_not_matter(method, end):
    segments = dl.uniform_lines(20_000, seed=3)
    rng = np.random.default_rng(1)
    samples = dl.Samples(rng.uniform(-0.7, 0.7, (300, 3)), rng.normal(size=(300, 3)), radius=0.1)
    one, two, four = (method(segments, samples, segment_end=end, threads=n) for n in (1, 2, 4))
    assert one.stats["hits"] > 1000
    for other in (two, four):
        np.testing.assert_array_equal(other.sums, one.sums)
        assert other.stats == one.stats


@every_method
@examples(25)
@given(world=worlds())
def test_samples_do_not_influence_each_other(method, world: World):
    """Each sample alone has the value it has in company."""
    together = method(world.segments, world.samples)
    for i in range(min(3, len(world.samples))):
        alone = pick(world.samples, [i])
        np.testing.assert_array_equal(method(world.segments, alone).sums[0], together.sums[i])


# ---- statistics and units -----------------------------------------------------------------------


@every_method
@examples(25)
@given(world=worlds())
def test_hits_count_pairs(method, world: World):
    """With equal powers every crossing adds one power, so the sums count the crossings."""
    equal = dl.Segments(
        world.segments.origin, world.segments.direction, world.segments.length, 1.0, world.segments.extended
    )
    found = method(equal, world.samples)
    if not len(equal):
        assert found.stats["hits"] == 0
        return
    per_hit = int(equal.quanta[0, 0])
    assert (found.sums % per_hit == 0).all()
    assert found.sums[:, 0].sum() == per_hit * found.stats["hits"]
    assert found.stats["disc_tests"] >= found.stats["hits"]


@every_method
def test_irradiance_is_power_over_area(method):
    """Ten vertical segments of 3 W through a disc of radius 2: 30 / (4 pi)."""
    origin = np.stack([np.linspace(-1, 1, 10), np.ones(10), np.zeros(10)], axis=1)
    segments = dl.Segments(origin, [(0, -1, 0)] * 10, np.full(10, 2.0), [(3, 0, 1.5)] * 10)
    found = method(segments, one_disc(2.0))
    np.testing.assert_allclose(found.irradiance, [[30 / (4 * np.pi), 0, 15 / (4 * np.pi)]], rtol=1e-8)
    assert found.quantum == segments.quantum
    assert found.stats["hits"] == 10


@every_method
def test_first_bounce_leaves_direct_light_out(method):
    segments = dl.Segments(
        [(0, 1, 0)] * 3, [(0, -1, 0)] * 3, np.full(3, 2.0), [1.0, 2.0, 4.0], bounce=[0, 1, 2]
    )
    sums = [method(segments, one_disc(), first_bounce=b).irradiance[0, 0] for b in range(4)]
    np.testing.assert_allclose(np.array(sums) * np.pi, [7, 6, 4, 0], rtol=1e-8)


# ---- the definition, on numbers that are exact --------------------------------------------------

DOWN = (0, -1, 0)


@every_method
@pytest.mark.parametrize(
    ("origin", "direction", "length", "extended", "hits"),
    [
        ((0, 1, 0), DOWN, 2.0, 2.0, (1, 1, 1)),  # from the front
        ((0, -1, 0), (0, 1, 0), 2.0, 2.0, (0, 0, 0)),  # from behind
        ((0, 1, 0), DOWN, 1.0, 1.0, (1, 1, 1)),  # ends on the plane: counts
        ((0, 1, 0), DOWN, 0.75, 0.75, (0, 0, 0)),  # ends before it
        ((0, 0, 0), DOWN, 1.0, 1.0, (0, 0, 0)),  # starts on the plane: does not count
        ((1, 1, 0), DOWN, 2.0, 2.0, (1, 1, 1)),  # through the rim: counts
        ((1.0000002, 1, 0), DOWN, 2.0, 2.0, (0, 0, 0)),  # past the rim
        ((0, 1, 0), (1, 0, 0), 2.0, 2.0, (0, 0, 0)),  # parallel
        ((-2, 0, 0), (1, 0, 0), 4.0, 4.0, (0, 0, 0)),  # in the plane
        ((0, 1, 0), DOWN, 0.0, 0.0, (0, 0, 0)),  # no length
        ((0, 1, 0), DOWN, np.inf, np.inf, (1, 1, 1)),  # endless
        ((0, 5, 0), DOWN, 4.0, 6.0, (0, 1, 1)),  # second hit, within three radii of the first
        ((0, 5, 0), DOWN, 1.0, 6.0, (0, 1, 0)),  # second hit, too far beyond the first
        ((0, 5, 0), DOWN, 2.0, 6.0, (0, 1, 1)),  # at three radii exactly
        ((0, 5, 0), DOWN, 4.0, 4.5, (0, 0, 0)),  # the second hit comes before the disc
        ((0, 5, 0), DOWN, 1.0, np.inf, (0, 1, 0)),
    ],
)
def test_which_crossings_count(method, origin, direction, length, extended, hits):
    segments = dl.Segments([origin], [direction], [length], 1.0, extended=[extended])
    found = tuple(method(segments, one_disc(), segment_end=end).stats["hits"] for end in ENDS)
    assert found == hits


@every_method
def test_nothing_gives_nothing(method):
    none, nowhere = nothing()
    lines = dl.uniform_lines(10)
    for segments, samples in ((none, one_disc()), (lines, nowhere), (none, nowhere)):
        found = method(segments, samples)
        assert found.sums.shape == found.irradiance.shape == (len(samples), 3)
        assert not found.sums.any()
        assert found.stats["hits"] == 0


# ---- refusals -----------------------------------------------------------------------------------

GOOD = {"origin": [(0.0, 1, 0)], "direction": [(0.0, -1, 0)], "length": [2.0], "power": [1.0]}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"origin": [(0, np.nan, 0)]}, "origin: found nan"),
        ({"origin": [(0, np.inf, 0)]}, "origin: found inf"),
        ({"direction": [(0, np.nan, 0)]}, "direction: found nan"),
        ({"direction": [(0, np.inf, 0)]}, "direction: found inf"),
        ({"direction": [(0, 0, 0)]}, "direction: found zero"),
        ({"length": [np.nan]}, "length: found nan"),
        ({"length": [-1.0]}, "length: found a negative"),
        ({"extended": [np.nan]}, "extended: found nan"),
        ({"power": [np.nan]}, "power: found nan"),
        ({"power": [np.inf]}, "power: found inf"),
        ({"power": [-1.0]}, "power: found a negative"),
        ({"power": ["bright"]}, "power: expected numbers"),
        ({"power": [1.0, 2.0]}, "power: found shape"),
        ({"length": [1.0, 2.0]}, "length: found shape"),
        ({"path": [1, 2]}, "path: found shape"),
        ({"bounce": [[0]]}, "bounce: found shape"),
        ({"path": [-1]}, "path: found -1"),
        ({"bounce": [0.5]}, "bounce: found 0.5"),
        ({"bounce": [65536]}, "bounce: found 65536"),
        ({"group": [np.nan]}, "group: found nan"),
    ],
)
def test_wrong_segments_are_refused(change, words):
    with pytest.raises(dl.OptionError, match=words):
        dl.Segments(**{**GOOD, **change})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": [(0, np.nan, 0)]}, "points: found .*nan"),
        ({"points": [(0, np.inf, 0)]}, "points: found .*inf"),
        ({"normals": [(0, np.nan, 0)]}, "normals: found .*nan"),
        ({"normals": [(0, np.inf, 0)]}, "normals: found .*inf"),
        ({"radius": [np.inf]}, "radius: found"),
        ({"radius": [0.0]}, "radius: found"),
    ],
)
def test_wrong_samples_are_refused(change, words):
    good = {"points": [(0.0, 0, 0)], "normals": [(0.0, 1, 0)], "radius": [1.0]}
    with pytest.raises(dl.OptionError, match=words):
        dl.Samples(**{**good, **change})


@every_method
def test_wrong_samples_and_options_are_refused(method):
    segments = dl.Segments(**GOOD)
    with pytest.raises(dl.OptionError, match="radius is automatic"):
        method(segments, dl.Samples([(0, 0, 0)], [(0, 1, 0)]))
    with pytest.raises(dl.OptionError, match="attached"):
        method(segments, dl.Samples([(0, 0, 0)], [(0, 1, 0)], radius=1.0, attached_to="chair"))
    with pytest.raises(dl.OptionError, match="segment_end"):
        method(segments, one_disc(), segment_end="third")
    with pytest.raises(dl.OptionError, match="at most 1e"):
        method(segments, dl.Samples([(1e16, 0, 0)], [(0, 1, 0)], radius=1.0))
    with pytest.raises(dl.OptionError, match="farther"):
        method(segments, dl.Samples([(9e14, 0, 0)], [(0, 1, 0)], radius=5e14))
    with pytest.raises(dl.OptionError, match="radius"):
        method(segments, one_disc(1e-60))
    with pytest.raises(dl.OptionError, match="threads"):
        method(segments, one_disc(), threads=0)
