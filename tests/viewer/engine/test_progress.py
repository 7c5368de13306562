# SPDX-License-Identifier: Apache-2.0
"""Progress that pages are told: an estimate from forecasts, also while the work says nothing."""

from __future__ import annotations

import queue
import time

import pytest
from deltalux.pace import Step
from deltalux.server.engine import engine
from deltalux.server.engine.progress import TaskProgress

from viewer.followed import Followed, is_message
from viewer.served_room import make_session


def told(messages: queue.Queue) -> dict:
    return messages.get(timeout=10)


def test_silent_work_is_told_of_with_the_time_left():
    messages: queue.Queue = queue.Queue()
    with TaskProgress("bake", messages.put, lambda: False) as progress:
        progress.expect([Step("short", 2.0), Step("long", 60.0)])
        assert progress("short", 0.0)
        first = told(messages)
        assert first["stage"] == "short" and first["eta"] == pytest.approx(62.0, abs=1.0)
        second = told(messages)  # nothing was reported in between
        assert second["fraction"] > first["fraction"] and second["eta"] < first["eta"]


def test_nothing_is_told_after_the_end():
    messages: queue.Queue = queue.Queue()
    with TaskProgress("check", messages.put, lambda: True) as progress:
        assert not progress("work", 0.5)
        assert told(messages)["eta"] is None  # nothing was forecast
    while not messages.empty():
        messages.get()
    time.sleep(0.3)
    assert messages.empty()


@pytest.mark.parametrize("gather", ["off", 64])
def test_every_stage_of_a_first_bake_is_foreseen(gather, monkeypatch):
    """What a stage without forecast takes would be missing in the time left."""
    made = []

    class Kept(TaskProgress):
        def __init__(self, *values):
            super().__init__(*values)
            made.append(self)

    monkeypatch.setattr(engine, "TaskProgress", Kept)
    with make_session(300_000, gather=gather) as session, Followed(session) as followed:
        followed.until_phase("ready")
        etas = [event["eta"] for event in followed.seen if is_message(event, "progress")]
        assert etas and None not in etas
        followed.engine.check()
        followed.until(lambda event: is_message(event, "checked"))
    assert [progress.unforeseen for progress in made] == [[]] * len(made)
    assert len(made) == 2
