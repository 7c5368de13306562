# SPDX-License-Identifier: Apache-2.0
"""The engine: it follows the newest state, keeps to budgets, bakes with previews, stops when told."""

from __future__ import annotations

import threading

import deltalux as dl
import numpy as np
import pytest
from deltalux.server.drawn.values import Values
from deltalux.server.edits import pose_numbers
from deltalux.server.engine import engine
from deltalux.server.engine.events import Phase, Refused
from deltalux.server.engine.figures import Figures
from rooms import translation, turn

from viewer.followed import Followed, assert_shown, is_message
from viewer.page_client import TIMEOUT, decoded
from viewer.served_room import make_session


@pytest.fixture
def followed(session):
    with Followed(session) as engine:
        engine.until(lambda e: e == Phase("ready"))
        yield engine


def path_of_the_block(count):
    return [translation(0.7 - 0.3 * k / count, 0.4, 0.4) @ turn(0.3 * k / count) for k in range(1, count + 1)]


def test_a_session_with_light_shows_it_at_once(followed):
    (values,) = followed.of(Values)
    assert not values.preview
    assert_shown(followed.session, values)


def test_a_thousand_poses_are_absorbed(followed, baked_file):
    poses = path_of_the_block(1000)
    for pose in poses:
        followed.want(dragging=True, block=pose)
    followed.want(block=poses[-1])
    followed.rest()
    frames = [e for e in followed.seen if is_message(e, "frame")]
    assert 1 <= len(frames) < 500
    followed.engine.stop()
    with dl.Session.open(baked_file) as other:
        other.move("block", poses[-1])
        other.update()
        assert followed.session.digest() == other.digest()
        assert np.array_equal(followed.session.irradiance, other.irradiance)


def test_a_budget_leaves_work_which_is_finished_at_rest(followed):
    followed.engine.set_budget(0.001)
    followed.state["factor", "desk"] = 0.5
    followed.want(dragging=True, lamp=translation(0.5, 0.8, 0.5))  # its light is traced anew
    first = followed.until(lambda e: is_message(e, "frame"))
    assert first["done"] < 1
    assert first["speed_up"] is None
    followed.rest()
    last = followed.seen[-2]
    assert last["affected_paths"] > first["affected_paths"]  # of the whole edit
    assert last["milliseconds"]["total"] > first["milliseconds"]["total"]


def test_values_belong_to_the_newest_revision(followed):
    followed.want(block=translation(0.5, 0.4, 0.4))
    followed.rest()
    values = followed.of(Values)[-1]
    assert values.revision == followed.revision == 1
    assert_shown(followed.session, values)


def test_samples_that_no_path_reached_are_counted_at_rest():
    with make_session(paths=60) as session:
        session.bake()
        before = session.unreached
        assert before > 0
        with Followed(session) as followed:
            first = followed.until(lambda e: is_message(e, "unreached"))
            assert first == {"type": "unreached", "revision": 0, "samples": before}
            for pose in path_of_the_block(5):
                followed.want(dragging=True, block=pose)
                followed.rest()  # while the mouse is held still
            followed.state["factor", "ceiling"] = 0.5
            followed.want(block=pose)
            last = followed.until(lambda e: is_message(e, "unreached"))
            assert last["revision"] == followed.revision == 6
            followed.engine.check()
            followed.until(lambda e: is_message(e, "checked"))
            followed.until_phase("ready")
        assert last["samples"] == session.unreached
        assert sum(is_message(e, "unreached") for e in followed.seen) == 2


def test_gathered_light_follows_a_drag_exactly():
    with make_session(gather=32) as session, Followed(session) as followed:
        followed.until_phase("ready")
        for pose in path_of_the_block(8):
            followed.want(dragging=True, block=pose)
        followed.want(block=pose)
        followed.rest()
        followed.engine.check()
        assert followed.until(lambda e: is_message(e, "checked"))["same"]
        assert_shown(session, followed.of(Values)[-1])


def test_what_the_session_refuses_is_told_and_the_rest_is_done(followed):
    followed.state["factor", "desk"] = 0.25
    followed.want(block=translation(2e15, 0, 0))
    refused = followed.until(lambda e: isinstance(e, Refused))
    assert refused.key == ("pose", "block")
    assert "would lie beyond 1e15 m" in refused.message
    followed.until(lambda e: e == Phase("ready"))
    assert followed.session.dim_factors["desk"] == 0.25
    assert refused.value == pose_numbers(followed.session.pose("block"))


def test_a_check_finds_the_same_digest_and_how_long_it_took(followed):
    followed.want(block=translation(0.5, 0.4, 0.4))
    followed.engine.check()
    checked = followed.until(lambda e: is_message(e, "checked"))
    assert checked["same"]
    assert checked["digest"] == checked["recomputed"]
    followed.until(lambda e: e == Phase("ready"))
    followed.want(block=translation(0.6, 0.4, 0.4))
    frame = followed.until(lambda e: is_message(e, "frame"))
    assert frame["recompute_milliseconds"] == checked["milliseconds"]
    assert frame["speed_up"] == pytest.approx(checked["milliseconds"] / frame["milliseconds"]["total"])


def test_what_is_asked_during_an_export_waits_for_it(followed):
    begun, finish = threading.Event(), threading.Event()
    digests = []

    def work(session):
        begun.set()
        assert finish.wait(TIMEOUT)
        digests.append(session.digest())

    followed.engine.export(work)
    assert begun.wait(TIMEOUT)
    followed.engine.check()
    with pytest.raises(dl.OptionError, match="bake: found the check still at work"):
        followed.engine.bake()
    assert not digests
    finish.set()
    checked = followed.until(lambda e: is_message(e, "checked"))
    assert digests == [checked["digest"]] == [checked["recomputed"]]


@pytest.mark.parametrize("task", ["bake", "check"])
def test_what_is_cancelled_before_its_turn_never_begins(followed, task):
    begun, finish = threading.Event(), threading.Event()

    def work(_):
        begun.set()
        assert finish.wait(TIMEOUT)

    followed.engine.export(work)
    assert begun.wait(TIMEOUT)
    with pytest.raises(dl.OptionError, match="cancel: found no bake and no check"):
        followed.engine.cancel()  # an export is short
    getattr(followed.engine, task)()
    followed.engine.cancel()
    finish.set()
    ended = followed.until(lambda e: is_message(e, "cancelled") or is_message(e, "checked"))
    assert ended == {"type": "cancelled", "task": task}
    followed.want(block=translation(0.5, 0.4, 0.4))
    followed.rest()
    followed.engine.check()  # nothing is left of it
    assert followed.until(lambda e: is_message(e, "checked"))["same"]


def test_a_cancelled_check_leaves_the_light_as_it_was():
    with make_session(200_000) as session:
        session.bake()
        digest = session.digest()
        with Followed(session) as followed:
            followed.until(lambda e: e == Phase("ready"))
            followed.engine.check()
            followed.until(lambda e: is_message(e, "progress"))
            followed.engine.cancel()
            ended = followed.until(lambda e: is_message(e, "cancelled") or is_message(e, "checked"))
            assert ended == {"type": "cancelled", "task": "check"}
            followed.until(lambda e: e == Phase("ready"))
        assert session.digest() == digest


@pytest.mark.parametrize("method", ["update", "read_packed"])  # which reads what is shown
@pytest.mark.parametrize("way_on", ["edit", "undo", "check", "bake"])
def test_an_update_that_failed_is_told_and_whatever_comes_next_tries_again(
    followed, monkeypatch, method, way_on
):
    def fail(*_, **__):
        raise MemoryError("none left")

    before, there = followed.session.pose("block"), translation(0.5, 0.4, 0.4)
    with monkeypatch.context() as patch:
        patch.setattr(followed.session, method, fail)
        followed.want(block=there)
        notice = followed.until(lambda e: is_message(e, "notice"))
        assert notice["message"] == "update failed: MemoryError: none left"
        followed.until_phase("failed")
        assert followed.events.empty()  # nobody works on it
    if way_on in ("edit", "undo"):
        followed.want(block=before if way_on == "undo" else translation(0.6, 0.4, 0.4))
    else:
        getattr(followed.engine, way_on)()
    followed.until_phase("ready")
    assert followed.of(Values)[-1].revision == followed.revision
    assert_shown(followed.session, followed.of(Values)[-1])


def test_the_first_bake_shows_coarse_light_before_it_ends():
    with make_session(100_000) as session:
        with Followed(session) as followed:
            followed.until(lambda e: e == Phase("ready"))
            values = followed.of(Values)
            assert [v.preview for v in values] == [True, True, False]
            light = [decoded(v.rows, v.scale)[:, :3].sum() for v in values]
            assert light[0] == pytest.approx(light[2], rel=0.3)
            phases = [e.name for e in followed.of(Phase)]
            assert phases == ["baking", "preview", "ready"]
            fractions = [e["fraction"] for e in followed.seen if is_message(e, "progress")]
            assert fractions == sorted(fractions)
            assert fractions[0] >= 0
            assert fractions[-1] <= 1
            frame = next(e for e in followed.seen if is_message(e, "frame"))
            assert frame["paths"] == frame["affected_paths"] == 100_000
            assert frame["speed_up"] is None
        digest = session.digest()
    with make_session(100_000) as plain:
        plain.bake()
        assert plain.digest() == digest  # previews leave no trace


def test_edits_before_the_first_bake_are_in_it():
    pose = translation(0.5, 0.4, 0.4)
    with make_session() as session, make_session() as plain:
        with Followed(session) as followed:
            followed.want(block=pose)
            followed.until(lambda e: e == Phase("ready"))
        plain.move("block", pose)
        plain.bake()
        assert session.digest() == plain.digest()


def test_a_cancelled_bake_leaves_no_light_and_can_be_repeated():
    with make_session(50_000_000) as session, Followed(session) as followed:
        followed.until(lambda e: is_message(e, "progress"))
        followed.engine.cancel()
        assert followed.until(lambda e: is_message(e, "cancelled")) == {"type": "cancelled", "task": "bake"}
        followed.until(lambda e: e == Phase("empty"))
        assert not session.baked
        with pytest.raises(dl.OptionError, match="cancel: found no bake and no check"):
            followed.engine.cancel()
        followed.engine.bake()
        with pytest.raises(dl.OptionError, match="check: found the bake still at work"):
            followed.engine.check()
        followed.until(lambda e: is_message(e, "progress"))


def test_the_light_of_another_build_is_shown_and_computed_again(session):
    digest = session.digest()
    session.foreign_build = "another"
    with Followed(session) as followed:
        followed.until(lambda e: e == Phase("ready"))
        assert len(followed.of(Values)) == 2
        followed.want(block=translation(0.5, 0.4, 0.4))
        followed.rest()
        followed.want(block=translation(0.7, 0.31, 0.4))
        followed.rest()
    assert session.foreign_build is None
    assert session.digest() == digest


def test_stopping_gives_the_session_back(session):
    def mine(stage, fraction):
        return True

    session.progress = mine
    with Followed(session) as followed:
        followed.until(lambda e: e == Phase("ready"))
    assert session.progress is mine
    session.move("block", translation(0.5, 0.4, 0.4))
    assert session.update().done == 1


def test_free_memory_is_returned_after_tasks_and_not_after_updates(followed, monkeypatch):
    returned = []
    monkeypatch.setattr(engine, "return_free_memory", lambda: returned.append(None))
    followed.want(block=translation(0.5, 0.4, 0.4))
    followed.rest()
    assert not returned
    followed.engine.check()
    followed.until(lambda e: is_message(e, "checked"))
    followed.until(lambda e: e == Phase("ready"))
    assert len(returned) == 1
    done = threading.Event()
    followed.engine.export(lambda session: done.set())
    assert done.wait(TIMEOUT)
    followed.want(block=translation(0.6, 0.4, 0.4))
    followed.rest()
    assert len(returned) == 2


@pytest.mark.parametrize("gather", ["off", 16])
def test_before_a_check_a_recompute_counts_with_all_stages_that_it_has(gather):
    with make_session(gather=gather) as session:
        baked, again = session.bake(), session.recompute()
        figures = Figures()
        figures.of_bake(session, baked, 0, 1.0)
        repeated = set(again.milliseconds) - {"total"}
        assert "trace" in repeated
        assert figures.recompute_milliseconds == pytest.approx(
            sum(time for stage, time in baked.milliseconds.items() if stage in repeated)
        )
