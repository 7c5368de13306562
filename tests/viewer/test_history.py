# SPDX-License-Identifier: Apache-2.0
"""Undo and redo: steps, drags, and the digest that returns."""

from __future__ import annotations

import deltalux as dl
import pytest
from deltalux.server.edits import differences, pose_numbers, queue_edit, state_of
from deltalux.server.history import MAX_STEPS, History
from hypothesis import given
from hypothesis import strategies as st
from rooms import translation, turn

A, B = ("factor", "a"), ("factor", "b")


def history():
    return History({A: 1.0, B: 1.0})


def test_steps_go_back_and_forth():
    steps = history()
    steps.edit(A, 0.5, "page")
    steps.edit(B, 0.3, "page")
    assert (steps.undo_name, steps.redo_name) == ("dim b", None)
    steps.undo()
    assert (steps.state, steps.undo_name, steps.redo_name) == ({A: 0.5, B: 1.0}, "dim a", "dim b")
    steps.undo()
    assert steps.state == {A: 1.0, B: 1.0}
    with pytest.raises(dl.OptionError, match="undo: found no step"):
        steps.undo()
    steps.redo()
    steps.redo()
    assert steps.state == {A: 0.5, B: 0.3}
    with pytest.raises(dl.OptionError, match="redo: found no step"):
        steps.redo()


def test_several_keys_are_one_step():
    steps = history()
    steps.edit(A, 0.9, "page", dragging=True)
    steps.edit_together({A: 0.5, B: 0.25}, "page", dragging=True)  # other keys: another step
    steps.edit_together({A: 0.4, B: 0.2}, "page", dragging=True)
    steps.edit_together({A: 0.3, B: 0.15}, "page")
    assert (steps.undo_name, steps.dragging) == ("dim a and 1 more", False)
    steps.undo()
    assert (steps.state, steps.undo_name) == ({A: 0.9, B: 1.0}, "dim a")
    steps.redo()
    assert steps.state == {A: 0.3, B: 0.15}


def test_an_edit_ends_the_way_forth():
    steps = history()
    steps.edit(A, 0.5, "page")
    steps.undo()
    steps.edit(B, 0.3, "page")
    assert steps.redo_name is None


def test_a_drag_is_one_step():
    steps = history()
    for value in (0.9, 0.8, 0.7):
        steps.edit(A, value, "page", dragging=True)
    assert steps.dragging
    steps.edit(A, 0.6, "page")
    assert not steps.dragging
    steps.edit(A, 0.5, "page")
    for value in (0.4, 0.3):
        steps.edit(A, value, "page", dragging=True)
    steps.release("page")
    steps.undo()
    assert steps.state[A] == 0.5
    steps.undo()
    assert steps.state[A] == 0.6
    steps.undo()
    assert steps.state[A] == 1.0


def test_undo_ends_a_drag():
    steps = history()
    steps.edit(A, 0.5, "page", dragging=True)
    steps.undo()
    assert not steps.dragging
    steps.redo()
    assert not steps.dragging
    assert steps.state[A] == 0.5


def test_two_pages_that_drag_at_once_have_a_step_each():
    steps = history()
    for value in (0.9, 0.8):
        steps.edit(A, value, "one", dragging=True)
        steps.edit(B, value, "two", dragging=True)
    steps.edit(A, 0.7, "one")
    steps.edit(B, 0.7, "two")
    steps.undo()
    assert steps.state == {A: 0.7, B: 1.0}
    steps.undo()
    assert steps.state == {A: 1.0, B: 1.0}


def test_what_changes_nothing_is_no_step():
    steps = history()
    steps.edit(A, 1.0, "page")
    assert steps.undo_name is None
    steps.edit(A, 0.5, "page", dragging=True)
    steps.edit(A, 1.0, "page")
    assert steps.undo_name is None


def test_an_edit_of_what_another_page_drags_ends_that_drag():
    steps = history()
    steps.edit(A, 0.5, "one", dragging=True)
    steps.edit(A, 0.2, "two")
    assert not steps.dragging
    steps.edit(A, 0.7, "one", dragging=True)
    steps.release("one")
    values = []
    while steps.undo_name:
        steps.undo()
        values.append(steps.state[A])
    assert values == [0.2, 0.5, 1.0]


def test_a_drag_back_to_the_beginning_forgets_what_was_undone():
    steps = history()
    steps.edit(A, 0.5, "one", dragging=True)
    steps.edit(B, 0.5, "two")
    steps.undo()
    steps.edit(A, 1.0, "one")
    assert (steps.undo_name, steps.redo_name) == (None, None)


def test_a_drag_goes_on_as_a_new_step_where_another_pages_was_undone():
    steps = history()
    steps.edit(A, 0.0, "one", dragging=True)
    steps.edit(A, 0.5, "two", dragging=True)
    steps.undo()
    steps.edit(A, 1.0, "one")
    assert steps.redo_name is None
    steps.undo()
    steps.undo()
    assert steps.state[A] == 1.0
    assert steps.undo_name is None


def test_a_page_that_leaves_lets_go():
    steps = history()
    steps.edit(A, 0.5, "page", dragging=True)
    steps.release("page")
    assert not steps.dragging
    assert steps.undo_name == "dim a"


def test_the_oldest_steps_are_forgotten():
    steps = history()
    for k in range(MAX_STEPS + 10):
        steps.edit(A, float(k), "page")
    for _ in range(MAX_STEPS):
        steps.undo()
    assert steps.undo_name is None
    assert steps.state[A] == 9.0


EDITS = st.tuples(
    st.dictionaries(st.sampled_from([A, B]), st.sampled_from([0.0, 0.5, 1.0]), min_size=1),
    st.sampled_from("xy"),
    st.booleans(),
)


@given(st.lists(EDITS | st.sampled_from(["undo", "redo"]), max_size=30))
def test_all_undone_is_the_beginning_and_all_redone_the_end(actions):
    steps = history()
    for action in actions:
        if isinstance(action, tuple):
            steps.edit_together(*action)
        elif action == "undo" and steps.undo_name:
            steps.undo()
        elif action == "redo" and steps.redo_name:
            steps.redo()
    for page in "xy":
        steps.release(page)
    end = dict(steps.state)
    while steps.redo_name:
        steps.redo()
    last = dict(steps.state)
    count = 0
    while steps.undo_name:
        steps.undo()
        count += 1
    assert steps.state == {A: 1.0, B: 1.0}
    for _ in range(count):
        steps.redo()
    assert steps.state == last
    assert steps.undo_name or end == last


def follow(session, steps):
    for key, value in differences(session, steps.state).items():
        queue_edit(session, key, value)
    session.update()
    return session.digest()


def test_the_digest_returns(session):
    steps = History(state_of(session))
    block = pose_numbers(session.pose("block"))
    moved = pose_numbers(translation(0.1, 0.4, 0.2) @ turn(0.3))
    edits = [
        (("pose", "block"), moved),
        (("factor", "desk"), 0.37),
        (("reflectance", "paint"), (0.123, 0.4, 0.9)),
        (("present", "lamp"), False),
        (("pose", "block"), block),
        (("present", "lamp"), True),
    ]
    digests = [session.digest()]
    for key, value in edits:
        steps.edit(key, value, "page")
        digests.append(follow(session, steps))
    assert len(set(digests)) >= 6  # edits were felt
    for expected in reversed(digests[:-1]):
        steps.undo()
        assert follow(session, steps) == expected
    for expected in digests[1:]:
        steps.redo()
        assert follow(session, steps) == expected


def test_reflectances_survive_saving(session, tmp_path):
    session.set_reflectance("paint", (0.123, 0.4, 0.9))
    session.update()
    session.save(tmp_path / "painted.dlx")
    with dl.Session.open(tmp_path / "painted.dlx") as opened:
        again = opened.reflectances["paint"]
        assert again == pytest.approx((0.123, 0.4, 0.9), abs=1e-7)
        opened.set_reflectance("paint", (0, 0, 0))
        opened.update()
        opened.set_reflectance("paint", again)
        opened.update()
        assert opened.digest() == session.digest()
