# SPDX-License-Identifier: Apache-2.0
"""Sessions that share the paths of a bake: whatever the ranges, they add up to one session, to the bit."""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise

import deltalux as dl
import numpy as np
import pytest
from deltalux.errors import Cancelled, OptionError
from deltalux.session import ranges
from edit_sequences import SEQUENCES, apply
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lit_scenes import sunny_room
from rooms import room, samples_in, translation
from shared_sessions import NONE, Shared
from thoroughness import examples, slow

PATHS = 640
OPTIONS = [
    {"direct": "paths", "gather": "off"},
    {"direct": "sampled", "gather": "off", "segment_end": "second", "disc_area": "whole"},
    {"direct": "auto", "gather": 16},
    {"direct": "paths", "gather": 8, "threads": 2, "segment_end": "bounded"},
]


@contextmanager
def baked(count: int) -> Iterator[tuple[dl.Session, Shared]]:
    """A session of all paths, and one that `count` ranges share, both baked."""
    scene = room()
    samples, options = samples_in(scene), {"paths": PATHS, "gather": 8, "threads": 1}
    with (
        dl.Session(scene, samples, **options) as one,
        Shared(scene, samples, ranges.ranges_of(PATHS, count), **options) as shared,
    ):
        one.bake()
        shared.bake()
        yield one, shared


def added(frames: Sequence[dl.Frame]) -> list[int]:
    return [
        sum(getattr(frame, name) for frame in frames)
        for name in ("affected_paths", "removed_segments", "retraced_segments")
    ]


CUTS = st.lists(st.integers(0, PATHS), max_size=4).map(lambda cuts: [0, *sorted(cuts), PATHS])
RANGES = st.one_of(
    st.sampled_from([1, 2, 4, 16]).map(lambda count: ranges.ranges_of(PATHS, count)),
    CUTS.map(lambda cuts: [own for own in pairwise(cuts) if own[0] < own[1]]),
)


@pytest.mark.parametrize("options", OPTIONS, ids=lambda o: "-".join(map(str, o.values())))
@settings(max_examples=examples(12), suppress_health_check=[HealthCheck.too_slow])
@given(cuts=RANGES, sequence=SEQUENCES)
def test_ranges_add_up_after_bake_and_edits(options, cuts, sequence):
    scene = room()
    samples, options = samples_in(scene), {"paths": PATHS, "threads": 1} | options
    with dl.Session(scene, samples, **options) as one, Shared(scene, samples, cuts, **options) as shared:
        assert added(shared.bake()) == added([one.bake()])
        shared.equals(one)
        for edits in sequence:
            for edit in edits:
                apply(one, edit)
            assert added(shared.update(edits)) == added([one.update()])
            shared.equals(one)
        np.testing.assert_array_equal(shared.gradient(), one.gradient)
        for part in shared.parts:
            digest = part.digest()
            part.recompute()
            assert part.digest() == digest


@pytest.mark.parametrize("count", [slow(1), slow(2), 4, slow(16)])
def test_numbers_of_ranges(count):
    """Each range has paths of each light and each batch, and everything that a bake chooses is the same."""
    scene = room(groups=3)
    samples, options = samples_in(scene), {"paths": 6400, "gather": 16}
    with (
        dl.Session(scene, samples, **options) as one,
        Shared(scene, samples, ranges.ranges_of(6400, count), **options) as shared,
    ):
        one.bake()
        shared.bake()
        shared.equals(one)
        for part in shared.parts:
            assert abs(part.statistics["held_paths"] - 6400 / count) <= 8 * 4
            assert part.statistics["lights"] == one.statistics["lights"]
            assert part.energy["quantum"] == one.energy["quantum"]
            np.testing.assert_array_equal(part.radius, one.radius)
            assert (ranges.path_sums(part).cells.sum(axis=(0, 3)) > 0).all()
        gather = shared.whole.statistics["gather"]
        same = ("rays", "chains", "guides", "beams", "suns", "cells")
        assert {k: gather[k] for k in same} == {k: one.statistics["gather"][k] for k in same}


def test_suns_that_gather_rays_ask_for():
    """All sessions choose the sun, whose first flights are then in no range's cells."""
    scene = sunny_room()
    samples, options = dl.Samples.on_vertices(scene, spacing=0.5), {"paths": 2000, "gather": 64, "threads": 1}
    with (
        dl.Session(scene, samples, **options) as one,
        Shared(scene, samples, ranges.ranges_of(2000, 4), **options) as shared,
    ):
        one.bake()
        shared.bake()
        assert one.statistics["gather"]["suns"] == 1
        shared.equals(one)
        name = scene.movable[0]
        pose = translation(0.1, 0.0, 0.05) @ one.pose(name)
        one.move(name, pose)
        one.update()
        shared.update([("move", name, pose)])
        shared.equals(one)


def test_files_keep_the_range(tmp_path):
    """Parts and the session without paths come back; the latter is given the sums again."""
    scene = room()
    samples, options = samples_in(scene), {"paths": PATHS, "gather": 16}
    edits = [("move", "block", translation(0.2, 0.4, 0.1))]
    with (
        dl.Session(scene, samples, **options) as one,
        Shared(scene, samples, ranges.ranges_of(PATHS, 2), **options) as shared,
    ):
        one.bake()
        shared.bake()
        for k, session in enumerate((*shared.parts, shared.whole)):
            session.save(tmp_path / f"{k}.dlx")
            session.close()
        *shared.parts, shared.whole = (dl.Session.open(tmp_path / f"{k}.dlx") for k in range(3))
        assert [s.options["path_range"] for s in shared.parts] == [(0, 320), (320, 640)]
        assert shared.whole.options["path_range"] == NONE
        shared.add()
        shared.equals(one)
        for edit in edits:
            apply(one, edit)
        one.update()
        shared.update(edits)
        shared.equals(one)


@pytest.mark.parametrize("bad", [(5, 3), (-1, 2), (0, 641), (0,), "ab", (0.0, 64.0), (False, True), 3])
def test_bad_ranges(bad):
    with pytest.raises(OptionError, match=r"^path_range: found .*first <= last <= 640.* None for all"):
        dl.Session(room(), samples_in(room()), paths=PATHS, path_range=bad)


def test_a_part_has_no_light_to_read():
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=PATHS, gather=8, path_range=(0, 320)) as part:
        part.bake()
        for read in (lambda: part.irradiance, part.read_packed, lambda: part.at([(0, 1, 0)], [(0, 1, 0)])):
            with pytest.raises(OptionError, match=r"holds paths 0 to 320 of 640 .*path_range=\(0, 0\)"):
                read()
        with pytest.raises(OptionError, match="expected a baked one of path_range"):
            ranges.add_path_changes(part, ranges.path_changes(part))


@pytest.mark.usefixtures("reports_at_once")
def test_sums_are_added_completely_and_once():
    scene = room()
    with Shared(scene, samples_in(scene), ranges.ranges_of(PATHS, 2), paths=PATHS, gather=8) as shared:
        for session in (*shared.parts, shared.whole):
            session.bake()
        first, second = (ranges.path_changes(part) for part in shared.parts)
        ranges.add_path_changes(shared.whole, first)
        with pytest.raises(OptionError, match=r"found the sums of \d+ paths .* expected those of all 640"):
            ranges.gather(shared.whole)
        ranges.add_path_changes(shared.whole, second)
        with pytest.raises(
            OptionError, match=r"paths 320 to 640 of 640, of which some are added already; add"
        ):
            ranges.add_path_changes(shared.whole, second)
        with pytest.raises(OptionError, match=r"call gather\(\)"):
            shared.whole.update()
        shared.whole.progress = lambda stage, fraction: stage != "find noisy places"
        with pytest.raises(Cancelled):
            ranges.gather(shared.whole)
        shared.whole.progress = None
        shared.gather()
        assert np.isfinite(shared.whole.irradiance).all()
        sums = ranges.path_sums(shared.parts[0])
        with pytest.raises(OptionError, match="path sums: found"):
            sums + ranges.PathSums(1, sums.discs, sums.cells[1:])
        with pytest.raises(OptionError, match="sums: found a row of 5 numbers beside one of"):
            first.discs + ranges.SparseRow(5, first.discs.at, first.discs.values)
        with pytest.raises(OptionError, match="from edit 2 to edit 3 beside those from None to 0"):
            first + ranges.PathChanges((), 3, 2, first.discs, first.cells, first.openness)


def test_no_half_update_is_read():
    """Edits count: until the changes of all ranges are there, the session without paths has no light."""
    with baked(2) as (one, shared):
        for session in (one, *shared.parts, shared.whole):
            session.dim("desk", 0.5)
            session.move("block", translation(0.2, 0.4, 0.1))
            session.update()
        for k in range(2):
            for read in (lambda: shared.whole.irradiance, shared.whole.read, shared.digest):
                with pytest.raises(OptionError, match="after 2 edits, expected those of all 640"):
                    read()
            ranges.add_path_changes(shared.whole, ranges.path_changes(shared.parts[k]))
        shared.equals(one)


@pytest.mark.parametrize(
    "numbers", [[], [0], [127], [128], [-(2**31) - 1, 2**31], [2**62, -5], list(range(-300, 300))]
)
def test_rows_travel_whole(numbers):
    values = np.array(numbers, np.int64)
    at = np.cumsum(np.abs(values) % 1000 + 1).astype(np.uint64) * np.uint64(2**33)
    for row in (ranges.SparseRow(9, at, values), ranges.SparseRow(9, at, np.tile(values[:, None], 3))):
        back = pickle.loads(pickle.dumps(row))
        assert back.size == 9 and back.at.dtype == np.uint64 and back.values.dtype == np.int64
        np.testing.assert_array_equal(back.at, row.at)
        np.testing.assert_array_equal(back.values, row.values)


def test_a_recompute_asks_for_the_sums_again():
    with baked(4) as (one, shared):
        edits = [("move", "lamp", translation(0.5, 1.0, 0.2)), ("paint", "wall", 0.3)]
        for edit in edits:
            apply(one, edit)
        one.update()
        shared.update(edits)
        for session in (*shared.parts, shared.whole):
            session.recompute()
        with pytest.raises(OptionError, match="found the sums of 0 paths"):
            shared.whole.read()
        shared.add()
        shared.equals(one)


@pytest.mark.parametrize("paths", [1 << 26, 2**32 - 16])
def test_many_paths_are_admitted_with_a_coarser_quantum(paths):
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=paths) as session:
        assert not session.baked
