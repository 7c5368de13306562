# SPDX-License-Identifier: Apache-2.0
"""The drawn mesh is refined where shadows lie, once light has been at rest for a moment."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from typing import Any
from urllib.error import HTTPError

import deltalux as dl
import numpy as np
import pytest
from deltalux.server.drawn.geometry import geometry_of
from deltalux.server.drawn.values import Values
from deltalux.server.engine import publishing, state
from deltalux.server.engine.events import Phase, Refined, Wanted
from deltalux.server.engine.state import next_work
from deltalux.server.protocol.frames import ALL
from rooms import room, translation

from viewer.followed import Followed, assert_shown, is_message
from viewer.page_client import TIMEOUT, PageClient, get
from viewer.served_room import PATHS, saved

AWAY = translation(-0.5, 0.4, -0.4)


def make_session() -> dl.Session:
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.6, radius=0.15, detail=0.1)
    return dl.Session(scene, samples, paths=PATHS, threads=2, gather=16)


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> str:
    """The room, refined where the shadows of its movables lie at first, too."""
    session = make_session()
    session.bake()
    session.refine()
    return str(saved(session, tmp_path_factory.mktemp("refined") / "room.dlx"))


@pytest.fixture
def session(file, monkeypatch) -> Iterator[dl.Session]:
    monkeypatch.setattr(state, "CALM", 0.05)
    with dl.Session.open(file) as session:
        yield session


@pytest.fixture
def followed(session) -> Iterator[Followed]:
    with Followed(session, geometry_of(session)) as engine:
        engine.until(lambda e: e == Phase("ready"))
        yield engine


def wait_while(condition: Callable[[], bool]) -> None:
    """Until it no longer holds; of what no event tells."""
    end = time.monotonic() + TIMEOUT
    while condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def refined_at(session: dl.Session, **poses: np.ndarray) -> np.ndarray:
    """Vertices of the mesh that `Session.refine` makes with movables at these poses."""
    for name, pose in poses.items():
        session.move(name, pose)
    session.update()
    session.refine()
    return session.samples.display.points


def test_the_mesh_follows_the_shadow(followed, file):
    followed.want(block=AWAY)
    followed.rest()
    geometry = followed.until(lambda e: isinstance(e, Refined)).geometry
    values = followed.until(lambda e: isinstance(e, Values))
    with dl.Session.open(file) as other:
        assert np.array_equal(followed.session.samples.display.points, refined_at(other, block=AWAY))
        digest = other.digest()
    assert geometry.number == 1
    assert (
        geometry.description["vertices"] == len(values.rows) == len(followed.session.samples.display.points)
    )
    assert values.rest
    assert values.revision == followed.revision
    followed.engine.stop()
    assert_shown(followed.session, values)
    assert followed.session.digest() == digest


def test_a_bake_is_followed_by_it(monkeypatch):
    monkeypatch.setattr(state, "CALM", 0.05)
    with make_session() as own, Followed(own, geometry_of(own)) as followed:
        followed.until(lambda e: isinstance(e, Refined))
        assert followed.phases[-1] == "ready"


def test_the_same_shadows_need_no_other_mesh(followed):
    followed.want(block=AWAY)
    followed.rest()
    followed.until(lambda e: isinstance(e, Refined))
    followed.state["factor", "desk"] = 1.0
    followed.want()  # nothing changes
    followed.engine.at_rest(lambda *_: followed.events.put({"type": "read"}), print)
    followed.until(lambda e: is_message(e, "read"))
    count = len(followed.of(Refined))
    wait_while(lambda: next_work(followed.engine.state) is not None)
    followed.engine.stop()
    while not followed.events.empty():
        followed.seen.append(followed.events.get())
    assert len(followed.of(Refined)) == count == 1


def test_it_gives_way_to_edits_and_is_taken_up_again(session, monkeypatch, file):
    begun = []

    def refine(own: dl.Session) -> int:
        begun.append(own.poses["block"][0, 3])
        if begun[-1] == 0.5:
            followed.want(block=AWAY)
        return whole(own)

    whole = dl.Session.refine
    monkeypatch.setattr(dl.Session, "refine", refine)
    with Followed(session, geometry_of(session)) as followed:
        followed.until_phase("ready")
        followed.want(block=translation(0.5, 0.4, 0.4))
        followed.until(lambda e: isinstance(e, Refined))
        followed.engine.stop()
    assert begun[-2:] == [0.5, AWAY[0, 3]]
    assert len(followed.of(Refined)) == 1
    with dl.Session.open(file) as other:
        assert np.array_equal(session.samples.display.points, refined_at(other, block=AWAY))


def test_nothing_is_refined_under_a_drag_or_where_nobody_looks(followed):
    followed.engine.show(False)
    followed.want(block=AWAY)
    followed.rest()
    assert next_work(followed.engine.state) != "refine"
    followed.engine.show(True)
    followed.until(lambda e: isinstance(e, Refined))
    followed.want(dragging=True, block=translation(0.2, 0.4, 0.4))
    followed.until(lambda e: is_message(e, "frame") and e["revision"] == followed.revision)
    followed.until_phase("ready")
    assert next_work(followed.engine.state) != "refine"
    followed.engine.want(Wanted(dict(followed.state), followed.revision + 1, False))
    followed.until(lambda e: isinstance(e, Refined))


@pytest.mark.parametrize("broken", ["session.refine", "refined_geometry", "fill_of"])
def test_a_mesh_that_cannot_be_refined_stays(session, monkeypatch, caplog, broken):
    def fail(*_: Any) -> None:
        raise MemoryError("no room")

    before = session.samples
    with Followed(session, geometry_of(session)) as followed:
        followed.until_phase("ready")
        monkeypatch.setattr(*((dl.Session, "refine") if "." in broken else (publishing, broken)), fail)
        followed.want(block=AWAY)
        followed.rest()
        wait_while(lambda: "no room" not in caplog.text)
        monkeypatch.undo()
        assert session.samples is before
        followed.want(block=translation(0.5, 0.4, 0.4))
        followed.rest()
        assert not followed.of(Refined)
        assert set(followed.phases) == {"updating", "ready"}


def test_pages_are_told_and_get_all_values(session, serve):
    server = serve(session)
    with PageClient(server) as page:
        page.rest()
        count = len(page.rows)
        assert page.ask("move", name="block", pose=AWAY.T.ravel().tolist())["type"] == "accepted"
        assert page.until("geometry")["number"] == 1
        assert page.until("values")["flags"] & ALL
        about = json.load(get(server, "/scene.json"))
        assert about["geometry"] == 1
        assert about["vertices"] == len(page.rows) != count
        page.rest()
        rows = page.rows.copy()
    with PageClient(server) as late:
        assert late.until("geometry")["number"] == 1
        late.until("values")
        assert np.array_equal(late.rows, rows)


def test_a_geometry_that_is_gone_is_said_to_be(session, serve):
    server = serve(session)
    with PageClient(server) as page:
        page.rest()
        assert get(server, "/scene.json", more="&geometry=0").status == 200
        page.ask("move", name="block", pose=AWAY.T.ravel().tolist())
        page.until("geometry")
    assert get(server, "/geometry.bin", more="&geometry=1").status == 200
    for path in ("/scene.json", "/geometry.bin"):
        with pytest.raises(HTTPError, match="410"):
            get(server, path, more="&geometry=0")
