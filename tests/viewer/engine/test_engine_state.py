# SPDX-License-Identifier: Apache-2.0
"""The engine's table: in each state the next piece of work, phase and pause; no session, no thread."""

from __future__ import annotations

from typing import Any

import deltalux as dl
import pytest
from deltalux.server.engine.events import Wanted
from deltalux.server.engine.state import CALM, GRACE, State, is_asked, next_work, pause, phase
from deltalux.server.engine.tasks import Task, Tasks


def nothing(_: Any) -> None:
    """Work of a task that is never begun."""


def waiting(*names: str) -> Tasks:
    tasks = Tasks()
    for name in names:
        tasks.add(Task(name, nothing))
    return tasks


def state(revision: int = 3, dragging: bool = False, **differences: Any) -> State:
    """A state at rest with all done, but for the differences."""
    at_rest: dict[str, Any] = {"lit": True, "followed": 3, "counted": 3, "refined": 3, "refinable": True}
    return State(Wanted({}, revision, dragging), **(at_rest | differences))


def answers(of: State) -> tuple[str | None, str, float, bool]:
    return next_work(of), phase(of), pause(of), is_asked(of)


@pytest.mark.parametrize(
    ("differences", "expected"),
    [
        ({}, (None, "ready", 0, False)),
        ({"refined": 2}, ("refine", "ready", CALM, False)),
        ({"refined": None}, ("refine", "ready", CALM, False)),
        ({"counted": 2, "refined": 2}, ("count", "ready", 0, False)),
        ({"pending": True, "counted": 2, "refined": 2}, (None, "failed", 0, False)),
        ({"failed": True, "counted": 2, "refined": 2}, (None, "failed", 0, False)),
        ({"unpublished": 3, "counted": 2}, ("show", "ready", 0, False)),
        ({"unpublished": 3, "failed": True}, ("show", "failed", 0, False)),
        ({"unfinished": True, "unpublished": 3}, ("follow", "updating", 0, False)),
        ({"revision": 4, "unfinished": True, "failed": True}, ("follow", "updating", 0, True)),
        ({"lit": False, "revision": 4, "unpublished": 3, "refined": 2}, (None, "empty", 0, False)),
        ({"tasks": waiting("read"), "lit": False}, ("task", "empty", 0, True)),
        ({"tasks": waiting("bake"), "revision": 4}, ("task", "updating", 0, True)),
        ({"tasks": waiting("bake"), "stopping": True, "revision": 4}, ("stop", "updating", 0, True)),
    ],
)
def test_the_first_row_that_holds_answers(differences, expected):
    assert answers(state(**differences)) == expected


@pytest.mark.parametrize(
    ("differences", "expected"),
    [
        ({"counted": 2, "refined": 2}, (None, "ready", GRACE, False)),
        ({"unfinished": True}, ("follow", "updating", GRACE, False)),
        ({"unpublished": 3}, ("show", "ready", GRACE, False)),
        ({"revision": 4, "unfinished": True}, ("follow", "updating", 0, True)),
        ({"tasks": waiting("check")}, ("task", "ready", 0, True)),
        ({"stopping": True}, ("stop", "ready", 0, True)),
    ],
)
def test_a_drag_waits_a_moment_for_its_next_pose_and_rests_from_everything_else(differences, expected):
    assert answers(state(dragging=True, **differences)) == expected


@pytest.mark.parametrize("differences", [{"shown": False}, {"refinable": False}])
def test_a_mesh_that_nobody_sees_or_that_follows_no_shadow_is_not_refined(differences):
    assert answers(state(refined=2, **differences)) == (None, "ready", 0, False)


def test_an_edit_while_a_task_runs_is_followed_after_it():
    now = state(tasks=waiting("check"))
    now.tasks.begin()
    assert next_work(now) is None  # besides the task
    now.wanted = Wanted({}, 4)
    now.tasks.end()
    assert answers(now) == ("follow", "updating", 0, True)


def test_the_newest_edit_is_followed_and_those_before_it_are_skipped():
    now = state()
    for revision in (4, 5, 6):
        now.wanted = Wanted({}, revision)
    handed = now.wanted
    now.wanted = Wanted({}, 7)  # between taking the state and handing it over
    now.handed_over(handed, edits=True)
    assert (now.followed, next_work(now), is_asked(now)) == (6, "follow", True)


def test_a_cancelled_update_keeps_its_edits():
    now = state(revision=4)
    now.handed_over(now.wanted, edits=True)
    assert not is_asked(now)
    # The work is cancelled here: nothing else is noted.
    assert answers(now) == ("follow", "updating", 0, False)
    now.handed_over(now.wanted, edits=False)  # they are with the session already
    assert answers(now) == ("follow", "updating", 0, False)
    now.unfinished = False
    assert answers(now) == ("count", "ready", 0, False)


def test_a_failed_update_is_tried_again_with_the_next_edit_only():
    now = state(revision=4)
    now.handed_over(now.wanted, edits=True)
    now.give_up()
    assert answers(now) == (None, "failed", 0, False)
    now.wanted = Wanted({}, 5)
    assert answers(now) == ("follow", "updating", 0, True)


def test_an_update_that_failed_before_its_edits_were_handed_over_is_not_repeated_either():
    now = state(revision=4)
    now.give_up()
    assert answers(now) == (None, "failed", 0, False)


def test_values_that_no_page_displayed_are_shown_when_one_does():
    now = state(shown=False)
    now.kept_back(3)
    assert answers(now) == (None, "ready", 0, False)
    now.shown = True
    assert answers(now) == ("show", "ready", 0, False)
    now.shown = False  # the page was hidden once more before they were sent
    assert answers(now) == (None, "ready", 0, False)


def test_without_light_nothing_is_shown_or_followed_but_tasks_run():
    now = state(lit=False, shown=True, revision=4)
    now.kept_back(0)
    assert answers(now) == (None, "empty", 0, False)
    now.tasks.add(Task("bake", nothing))
    assert answers(now) == ("task", "empty", 0, True)


def test_refining_gives_way_to_requests_and_is_taken_up_again_at_rest():
    now = state(refined=2)
    assert next_work(now) == "refine"
    now.wanted = Wanted({}, 4)
    assert is_asked(now)  # which stops the work
    now.handed_over(now.wanted, edits=True)
    now.unfinished = False
    now.counted = 4
    assert answers(now) == ("refine", "ready", CALM, False)


class TestTasks:
    def test_they_are_begun_in_their_order(self):
        tasks = waiting("export", "read", "bake")
        assert [tasks.begin().name for _ in range(3)] == ["export", "read", "bake"]
        assert not tasks

    @pytest.mark.parametrize("busy", ["bake", "check", "export"])
    def test_one_that_waits_refuses_others(self, busy):
        with pytest.raises(dl.OptionError, match=f"bake: found the {busy} still at work, expected none"):
            waiting("read", busy).refuse_if_busy("bake")

    @pytest.mark.parametrize("busy", ["bake", "check"])
    def test_a_long_one_at_work_refuses_others(self, busy):
        tasks = waiting(busy)
        tasks.begin()
        with pytest.raises(dl.OptionError, match=f"export: found the {busy} still at work"):
            tasks.refuse_if_busy("export")
        tasks.end()
        tasks.refuse_if_busy("export")

    def test_short_ones_at_work_and_readings_refuse_none(self):
        tasks = waiting("export", "read")
        tasks.begin()
        tasks.refuse_if_busy("bake")

    def test_the_long_one_at_work_is_told_to_stop(self):
        tasks = waiting("bake", "check")
        tasks.begin()
        tasks.cancel()
        assert tasks.cancelled
        tasks.end()
        tasks.begin()
        assert not tasks.cancelled  # another one

    def test_one_that_is_cancelled_before_its_turn_gives_up_at_once(self):
        tasks = waiting("export", "check")
        tasks.begin()
        tasks.cancel()
        assert not tasks.cancelled  # the export goes on
        tasks.end()
        with pytest.raises(dl.errors.Cancelled, match="before it began"):
            tasks.begin().work(None)

    def test_short_ones_cannot_be_cancelled(self):
        tasks = waiting("export", "read")
        tasks.begin()
        with pytest.raises(dl.OptionError, match="cancel: found no bake and no check at work"):
            tasks.cancel()
