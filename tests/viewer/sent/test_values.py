# SPDX-License-Identifier: Apache-2.0
"""Encoded values, frames of what changed, and pages that stall."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.outputs.covered import RimFill, rim_fill
from deltalux.server.drawn.values import Encoder, Values, fill_of
from deltalux.server.page import IN_FLIGHT, MAX_WAITING, Page
from deltalux.server.protocol.frames import ALL, MAX_RUNS, apply_frame, frame_bytes
from deltalux.units import photopic
from hypothesis import given
from hypothesis import strategies as st

from viewer.page_client import decoded

NOTHING = np.zeros(0, np.int64)
NO_FILL = RimFill(NOTHING, NOTHING, NOTHING)


def state(rows, scale=1.0, revision=0, preview=False):
    return Values(np.asarray(rows, np.uint64), scale, revision, preview)


@pytest.mark.parametrize("brightest", [1e-6, 0.3, 17.0, 4e4, 1e7])
def test_values_keep_half_a_per_mille_and_the_scale_is_a_power_of_two(brightest):
    rng = np.random.default_rng(1)
    given = brightest * rng.uniform(1e-4, 1, (500, 4)).astype(np.float32)
    values = Encoder(NO_FILL).encode(given, 3, preview=False, rest=False)
    assert np.log2(values.scale) % 1 == 0
    assert decoded(values.rows, values.scale) == pytest.approx(given, rel=5e-4)


def test_packed_values_are_what_is_read_in_single_precision(session):
    on_the_block = session.samples.attached == "block"

    def packed():
        values = session.read_packed()
        assert values.dtype == np.float32
        expected = np.c_[session.irradiance, photopic(session.standard_error)].astype(np.float32)
        np.testing.assert_array_equal(values, expected)
        return values

    whole = packed()
    assert (whole[on_the_block] > 0).all(axis=1).any()
    session.remove("block")
    session.dim("desk", 0.3)
    session.update()
    edited = packed()
    assert not edited[on_the_block].any()
    assert (edited[:, 3] != whole[:, 3])[~on_the_block].any()


def test_the_scale_stays_until_values_leave_its_range():
    encoder = Encoder(NO_FILL)
    ones = np.ones((4, 4), np.float32)
    factors = (1, 2, 15, 0, 0.1, 1, 1e3, 1e3, 1)
    scales = [encoder.encode(f * ones, 0, preview=False, rest=False).scale for f in factors]
    assert len(set(scales[:6])) == 1
    assert scales[6] == scales[7] < scales[5]
    assert scales[8] == scales[5]


def test_covered_samples_at_the_rim_show_their_open_neighbours():
    triangles = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2)])
    covered = np.array([False, False, True, True, True])
    values = np.array([[1.0], [3.0], [100.0], [200.0], [300.0]])
    fill = rim_fill(covered, triangles)
    # 2 lies beside 0 once and beside 1 in two triangles, 3 beside 1, 4 beside covered ones only
    assert fill(values).ravel() == pytest.approx([1, 3, (1 + 3 + 3) / 3, 3, 300])
    assert values[2] == 100


def test_samples_on_movables_are_never_filled(session):
    fill = fill_of(session).fill
    assert (session.samples.display.attached[fill.filled] < 0).all()


def test_a_frame_of_everything_and_one_of_nothing():
    values = state(np.arange(5), revision=7, preview=True)
    header, rows = apply_frame(frame_bytes(1, values, None), None)
    assert (header.seq, header.revision, header.flags) == (1, 7, 3)
    assert rows.tolist() == list(range(5))
    header, rows = apply_frame(frame_bytes(2, values, values), rows)
    assert len(header.runs) == 0


def test_a_frame_says_whether_its_light_is_at_rest():
    for rest, flags in ((True, 5), (False, 1)):
        values = Values(np.zeros(3, np.uint64), 1.0, 0, preview=False, rest=rest)
        assert apply_frame(frame_bytes(1, values, None), None)[0].flags == flags


@pytest.mark.parametrize("other", [{"scale": 2.0}, {"preview": True}])
def test_another_scale_or_the_end_of_a_preview_sends_everything(other):
    header, _ = apply_frame(
        frame_bytes(2, state(np.zeros(9)), state(np.zeros(9), **other)), np.zeros(9, np.uint64)
    )
    assert header.flags & ALL
    assert header.runs == [[0, 9]]


def test_near_runs_are_joined():
    before, after = np.zeros(1000, np.uint64), np.zeros(1000, np.uint64)
    after[[3, 60, 500, 999]] = 1
    header, rows = apply_frame(frame_bytes(2, state(after), state(before)), before)
    assert header.runs == [[3, 58], [500, 1], [999, 1]]
    assert (rows == after).all()


def test_runs_are_limited():
    before = np.zeros(100 * (MAX_RUNS + 500), np.uint64)
    after = before.copy()
    after[::100] = 1
    header, rows = apply_frame(frame_bytes(2, state(after), state(before)), before)
    assert len(header.runs) == MAX_RUNS
    assert (rows == after).all()


def test_what_is_no_frame_or_does_not_follow_is_refused():
    five = frame_bytes(1, state(np.arange(5)), None)
    part = frame_bytes(2, state(np.arange(5)), state(np.zeros(5)))
    for frame, rows, text in (
        (b"DLTX", None, "found 4 bytes without the mark of one"),
        (b"X" + five[1:], None, "without the mark of one"),
        (five[:-1], None, "found 71 bytes, expected 72"),
        (five + b" ", None, "found 73 bytes, expected 72"),
        (part, None, "expected all of them in the first frame"),
        (part, np.zeros(4, np.uint64), "found a run to vertex 5 of 4"),
    ):
        with pytest.raises(dl.FormatError, match=text):
            apply_frame(frame, rows)


@given(st.lists(st.tuples(st.integers(0, 2**32), st.booleans(), st.booleans()), max_size=40))
def test_whoever_applies_its_frames_in_order_has_the_latest_values(events):
    """Publish at random, acknowledge at random: in the end the page has what was published last."""
    page, rows, unacknowledged, latest = Page(), None, [], None
    rng = np.random.default_rng(0)
    current = np.zeros(300, np.uint64)

    def fetch():
        nonlocal rows
        while (frame := page.next_frame()) is not None:
            header, rows = apply_frame(frame, rows)
            unacknowledged.append(header.seq)
        assert len(unacknowledged) <= IN_FLIGHT

    for number, (seed, rescale, acknowledge) in enumerate(events):
        rng = np.random.default_rng(seed)
        current = current.copy()
        first = rng.integers(300)
        current[first : first + rng.integers(150)] = rng.integers(2)
        latest = state(current, 2.0 if rescale else 1.0, number)
        page.offer(latest)
        fetch()
        if acknowledge and unacknowledged:
            page.acknowledge(unacknowledged.pop(0))
            fetch()
    while unacknowledged:
        page.acknowledge(unacknowledged.pop(0))
        fetch()
    assert latest is None or (rows == latest.rows).all()


def test_a_stalled_page_gets_one_frame_of_all_that_changed():
    page = Page()
    values = np.zeros(10_000, np.uint64)
    sizes = []
    for k in range(50):
        values = values.copy()
        values[200 * k] = k + 1
        page.offer(state(values, revision=k))
        if frame := page.next_frame():
            sizes.append(len(frame))
    assert len(sizes) == IN_FLIGHT
    page.acknowledge(1)
    header, _ = apply_frame(page.next_frame(), np.zeros(10_000, np.uint64))
    assert header.revision == 49
    assert header.runs == [[200 * k, 1] for k in range(2, 50)]
    assert page.next_frame() is None


def test_acknowledging_the_newest_frame_takes_those_before_along():
    page = Page()
    for k in (1, 2):
        page.offer(state([k]))
        assert page.next_frame()
    page.offer(state([3]))
    page.acknowledge(99)  # never sent
    assert page.next_frame() is None
    page.acknowledge(2)
    assert page.next_frame()
    page.offer(state([4]))
    page.acknowledge(1)  # late
    assert page.next_frame()
    page.offer(state([5]))
    assert page.next_frame() is None


def test_newer_states_replace_older_ones_and_answers_are_kept():
    page = Page()
    for k in range(3):
        page.tell({"type": "state", "revision": k})
        page.tell({"type": "accepted", "id": k})
    texts = [page.next_text() for _ in range(5)]
    assert texts == [
        '{"type": "accepted", "id": 0}',
        '{"type": "accepted", "id": 1}',
        '{"type": "state", "revision": 2}',
        '{"type": "accepted", "id": 2}',
        None,
    ]


def test_a_page_that_never_fetches_its_answers_overflows():
    page = Page()
    for k in range(MAX_WAITING):
        page.tell({"type": "accepted", "id": k})
    assert not page.overflows
    page.tell({"type": "accepted", "id": 0})
    assert page.overflows
