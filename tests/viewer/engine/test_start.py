# SPDX-License-Identifier: Apache-2.0
"""What waits when a view starts: edits that were queued, paths that were left, light of another build."""

from __future__ import annotations

from contextlib import ExitStack

import deltalux as dl
import pytest
from deltalux.server.drawn.values import Values
from rooms import translation, turn

from viewer.followed import Followed, assert_shown, is_message
from viewer.page_client import PageClient, decoded
from viewer.served_room import make_session

BUDGET = 1e-6  # milliseconds: nothing is done within it
POSE = translation(-0.6, 0.9, 0.4) @ turn(0.3)


def queue_edits(session):
    session.move("lamp", POSE)
    session.dim("desk", 0.5)


def leave_paths(session):
    session.set_reflectance("wall", (0.1, 0.1, 0.1))
    assert session.update(BUDGET).done < 1


def leave_both(session):
    leave_paths(session)
    queue_edits(session)


def leave_both_at_once(session):
    """Paths of the queued edits themselves."""
    queue_edits(session)
    leave_paths(session)


WAITING = (queue_edits, leave_paths, leave_both, leave_both_at_once)


@pytest.fixture(params=WAITING, ids=lambda leave: leave.__name__)
def behind(request, session, baked_file):
    """A session whose light is not that of its state, and one whose light is."""
    request.param(session)
    with dl.Session.open(baked_file) as finished:
        request.param(finished)
        finished.update()
        yield session, finished


def mean(values):
    return decoded(values.rows, values.scale)[:, :3].mean()


def test_a_session_says_whether_its_light_is_that_of_its_state(behind):
    session, finished = behind
    assert session.unfinished
    assert not finished.unfinished
    session.update()
    assert not session.unfinished


def test_what_waits_is_worked_off_before_the_light_is_ready(behind):
    session, finished = behind
    with Followed(session) as followed:
        followed.until_phase("ready")
    values = followed.of(Values)
    assert followed.phases == ["updating", "ready"]
    assert (values[0].revision, values[-1].revision) == (0, 1)
    assert not any(v.preview for v in values)
    assert abs(mean(values[0]) / mean(values[-1]) - 1) > 0.02  # else nothing was shown to be old
    assert_shown(finished, values[-1])
    frame = followed.of(dict)[-1]
    assert (frame["revision"], frame["done"]) == (1, 1)
    assert session.digest() == finished.digest()


def test_a_page_sees_the_old_light_as_that_of_an_older_revision(behind, serve):
    session, finished = behind
    server = serve(session)
    with PageClient(server) as page:
        page.rest()
        assert page.state["revision"] == page.frame["revision"] == 1
        assert page.ask("undo")["message"] == "undo: found no step to take back"
        assert page.digest() == finished.digest()
        answer = page.ask("dim", group="desk", factor=0.25)
        assert answer["revision"] == 2
        page.rest()
        page.ask("undo")
        page.rest()
        assert page.digest() == finished.digest()


def test_the_light_of_another_build_is_computed_again_with_what_waits(behind, serve):
    session, finished = behind
    old = session.read_packed()[:, :3].mean()
    session.foreign_build = "deltalux 0.0.0, another"
    with Followed(session) as followed:
        followed.until_phase("ready")
        values = followed.of(Values)
        assert followed.phases == ["baking", "ready"]
        assert [v.revision for v in values] == [0, 1]
        assert mean(values[0]) == pytest.approx(old, rel=0.05)  # covered samples are filled in
        assert_shown(finished, values[-1])
        assert session.foreign_build is None
    assert session.digest() == finished.digest()


def test_every_page_is_told_of_the_light_of_another_build(session, serve):
    session.foreign_build = "deltalux 0.0.0, another"
    server = serve(session)
    with ExitStack() as stack:
        for _ in range(2):
            page = stack.enter_context(PageClient(server))
            assert page.until("notice")["message"] == (
                "the light of this session was computed by another build (deltalux 0.0.0, another), whose "
                "bits may differ; everything is computed again before the first edit"
            )
            page.rest()


@pytest.fixture
def cancelled_foreign():
    """An engine whose user cancelled the bake that light of another build needs; an edit is queued."""
    with make_session(400_000) as session:
        session.bake()
        queue_edits(session)
        session.foreign_build = "another"
        with Followed(session) as followed:
            followed.until(lambda e: is_message(e, "progress"))
            followed.engine.cancel()
            assert followed.until(lambda e: is_message(e, "cancelled"))["task"] == "bake"
            yield followed


def test_the_light_of_another_build_never_becomes_ready_by_cancelling(cancelled_foreign):
    followed = cancelled_foreign
    followed.until_phase("empty")
    for ask in (followed.engine.check, lambda: followed.engine.export(lambda session: None)):
        with pytest.raises(dl.OptionError, match=r"found the light of another build, .* bake first"):
            ask()
    followed.want(block=translation(0.5, 0.4, 0.4))  # waits for the bake
    followed.engine.bake()
    followed.until_phase("ready")
    assert followed.phases == ["baking", "empty", "baking", "ready"]
    assert not followed.session.unfinished
    assert_shown(followed.session, followed.of(Values)[-1])


def test_edits_before_the_view_of_a_session_without_light_are_in_all_of_its_light():
    with make_session(100_000) as session, make_session(100_000) as plain:
        plain.bake()
        undimmed = plain.irradiance.mean()
        plain.dim("ceiling", 0)
        plain.update()
        session.dim("ceiling", 0)
        with Followed(session) as followed:
            followed.until_phase("ready")
        values = followed.of(Values)
        assert [(v.preview, v.revision) for v in values] == [(True, 0), (True, 0), (False, 0)]
        assert followed.phases == ["baking", "preview", "ready"]
        assert all(mean(v) < 0.5 * undimmed for v in values)
        assert_shown(plain, values[-1])
        assert session.digest() == plain.digest()


@pytest.mark.parametrize("task", ["bake", "check"])
def test_edits_that_a_cancelled_task_took_along_are_shown(task):
    with make_session(400_000) as session:
        session.bake()
        with Followed(session) as followed:
            followed.until_phase("ready")
            getattr(followed.engine, task)()
            followed.state["factor", "desk"] = 0.0
            followed.want()
            followed.until(lambda e: is_message(e, "progress"))
            followed.engine.cancel()
            followed.until(lambda e: is_message(e, "cancelled"))
            followed.rest()
            values = followed.of(Values)[-1]
            assert values.revision == followed.revision
            assert_shown(session, values)


def test_light_is_not_called_ready_where_an_update_failed(session, monkeypatch):
    def fail(*_):
        raise MemoryError("none left")

    queue_edits(session)
    with monkeypatch.context() as patch:
        patch.setattr(session, "update", fail)
        with Followed(session) as followed:
            notice = followed.until(lambda e: is_message(e, "notice"))
            assert notice["message"] == "update failed: MemoryError: none left"
            patch.undo()
            assert "ready" not in followed.phases
            followed.want()
            followed.rest()
            assert not session.unfinished
