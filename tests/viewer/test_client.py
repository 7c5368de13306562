# SPDX-License-Identifier: Apache-2.0
"""Programs that edit a served session: they do and read what a session of their own does and gives."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from deltalux.client import connection
from deltalux.outputs import read
from deltalux.server.edits import state_of
from deltalux.server.engine import Engine
from deltalux.server.engine.events import Wanted
from deltalux.server.web.serving import Server
from rooms import translation, turn

from viewer.page_client import PageClient
from viewer.served_room import make_session

POSE = translation(-0.6, 0.9, 0.4) @ turn(0.3)
NEAR = translation(0.5, 0.4, 0.4) @ turn(0.2)
TIMEOUT = 60.0


def edit(target: dl.Session | dl.client.Client) -> None:
    """The same for both."""
    target.move("lamp", POSE)
    target.dim("desk", 1 / 3)
    target.set_reflectance("paint", (0.1, 1 / 3, 0.7))
    target.remove("block")


def assert_same(client: dl.client.Client, session: dl.Session) -> None:
    arrays = client.read("irradiance", "standard_error", "points", "normals")
    points, normals = session.world()
    for name, expected in (
        ("irradiance", session.irradiance),
        ("standard_error", session.standard_error),
        ("points", points),
        ("normals", normals),
    ):
        assert arrays[name].dtype == np.float64
        assert np.array_equal(arrays[name], expected), name
    assert np.array_equal(client.irradiance, session.irradiance)
    assert np.array_equal(client.standard_error, session.standard_error)
    assert client.digest() == session.digest()
    for name, pose in session.poses.items():
        found = client.poses[name]
        assert (found is None and pose is None) or np.array_equal(found, pose)
    assert client.dim_factors == session.dim_factors
    assert client.reflectances == session.reflectances


def test_edits_and_values_are_those_of_a_session_to_the_bit(
    client: dl.client.Client, own: dl.Session
) -> None:
    assert_same(client, own)
    for target in (client, own):
        edit(target)
    frame, expected = client.update(), own.update()
    assert frame.affected_paths == expected.affected_paths > 0
    assert frame.retraced_segments == expected.retraced_segments
    assert frame.done == 1
    assert_same(client, own)
    for target in (client, own):
        target.add("block")
        target.move("block", NEAR)
        target.dim("desk", 1)
        target.update()
    assert_same(client, own)


def test_a_session_that_gathers_has_the_same_bits(serve: Callable[..., Server], tmp_path: Path) -> None:
    with make_session(gather=16) as session:
        session.bake()
        session.save(tmp_path / "room.dlx")
    with (
        dl.Session.open(tmp_path / "room.dlx") as first,
        dl.Session.open(tmp_path / "room.dlx") as own,
        dl.connect(serve(first, shown=False).url) as client,
    ):
        for target in (client, own):
            edit(target)
        frame, expected = client.update(), own.update()
        assert frame.gathered_rays == expected.gathered_rays > frame.changed_rays
        assert frame.changed_rays == expected.changed_rays > 0
        assert np.array_equal(client.irradiance, own.irradiance)
        assert client.digest() == own.digest()


def test_edits_wait_for_update_and_are_made_together(
    client: dl.client.Client, served: Server, own: dl.Session
) -> None:
    before = client.irradiance
    edit(client)
    assert np.array_equal(client.pose("lamp"), POSE)
    assert client.dim_factors["desk"] == 1 / 3
    assert client.poses["block"] is None
    with dl.connect(served.url) as other:
        assert other.dim_factors["desk"] == 1
        assert np.array_equal(other.irradiance, before)
        client.update()
        edit(own)
        own.update()
        assert_same(other, own)


def test_values_are_those_after_the_queued_edits(client: dl.client.Client, own: dl.Session) -> None:
    edit(client)
    edit(own)
    own.update()
    assert np.array_equal(client.irradiance, own.irradiance)


def test_an_update_without_edits_is_nothing(client: dl.client.Client) -> None:
    client.dim("desk", 0.5)
    client.move("block", NEAR)
    assert client.update().affected_paths > 0
    assert client.update() == dl.Frame()


def test_one_refused_edit_refuses_all(client: dl.client.Client, own: dl.Session) -> None:
    client.dim("desk", 0.5)
    client.remove("block")
    client.remove("block")
    with pytest.raises(dl.OptionError, match='remove "block": it is taken away'):
        client.update()
    assert_same(client, own)
    for target in (client, own):  # nor is anything of them left for later
        target.set_reflectance("paint", (0.1, 0.2, 0.3))
        target.update()
    assert_same(client, own)


def test_edits_that_cannot_be_are_refused_at_once(client: dl.client.Client) -> None:
    for wrong, text in (
        (lambda: client.move("walls", POSE), 'move: name: found "walls", expected one of'),
        (lambda: client.move("block", 2 * np.eye(4)), 'move "block": pose: .* scales, shears or mirrors'),
        (lambda: client.move("block", np.eye(3)), 'move "block": pose'),
        (lambda: client.remove("sofa"), 'remove: name: found "sofa"'),
        (lambda: client.dim("sun", 1), 'dim: group: found "sun"'),
        (lambda: client.dim("desk", float("nan")), "dim: factor: found NaN"),
        (lambda: client.set_reflectance("paint", (0, 0, 2)), "reflectance: value: found 2"),
        (lambda: client.set_reflectance("paint", 0.5), "expected 3 numbers"),
        (lambda: client.pose("sofa"), "pose: found 'sofa', expected one of"),
        (lambda: client.read("light"), 'arrays: found "light", expected one of'),
        (lambda: client.read(), "arrays: found"),
    ):
        with pytest.raises(dl.OptionError, match=text):
            wrong()
    client.remove("block")
    with pytest.raises(dl.OptionError, match='pose "block": it is taken away'):
        client.pose("block")


def test_more_edits_than_a_message_holds_are_refused(
    client: dl.client.Client, own: dl.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "MAX_TEXT", 2000)
    client.dim("desk", 0.5)
    client.update()
    for _ in range(20):
        client.move("block", NEAR)
    with pytest.raises(dl.OptionError, match=r"bytes of edits, expected up to .*; call update\(\)"):
        client.update()
    client.update()
    own.dim("desk", 0.5)
    own.update()
    assert_same(client, own)


def test_two_clients_at_once_leave_what_one_after_the_other_leaves(served: Server, own: dl.Session) -> None:
    with dl.connect(served.url) as one, dl.connect(served.url) as two:

        def dims() -> None:
            for k in range(15):
                one.dim("desk", 0.9 - 0.05 * k)
                one.update()
                one.read("irradiance")

        worker = threading.Thread(target=dims)
        worker.start()
        for k in range(15):
            two.move("block", translation(0.7 - 0.02 * k, 0.4, 0.4))
            two.update()
            two.digest()
        worker.join(TIMEOUT)
        assert not worker.is_alive()
        own.dim("desk", 0.9 - 0.05 * 14)
        own.move("block", translation(0.7 - 0.02 * 14, 0.4, 0.4))
        own.update()
        assert_same(one, own)
        assert_same(two, own)


def test_a_client_that_leaves_in_the_middle_harms_nobody(served: Server, own: dl.Session) -> None:
    with dl.connect(served.url) as other:
        for k in range(5):
            leaving = dl.connect(served.url)
            leaving.move("block", NEAR)
            threading.Timer(0.002 * k, leaving.close).start()
            with pytest.raises(dl.Error, match="it was closed; connect again"):
                while True:
                    leaving.update()
        other.move("block", NEAR)
        other.update()
        own.move("block", NEAR)
        own.update()
        assert_same(other, own)


def test_what_waits_for_an_answer_hears_of_the_server_s_end(session: dl.Session, serve: Callable[..., Server]
                                                            ) -> None:  # fmt: skip
    server = serve(session, shown=False)
    client = dl.connect(server.url)
    server.close()
    with pytest.raises(dl.Error, match="the server has ended the connection"):
        client.update()
    client.close()


def test_pages_see_what_clients_do_and_clients_what_pages_do(served: Server, own: dl.Session) -> None:
    with dl.connect(served.url) as client:
        client.dim("desk", 0.25)
        client.update()
        with PageClient(served) as page:
            page.rest()
            assert page.state["factors"]["desk"] == 0.25
            client.move("block", NEAR)
            client.update()
            page.until(lambda data: data["type"] == "state" and data["undo"] == "move block")
            page.rest()
            page.ask("undo")
            page.rest()
            own.dim("desk", 0.25)
            own.update()
            client.update()
            assert_same(client, own)


def test_what_is_made_together_is_one_step_back(served: Server, own: dl.Session) -> None:
    with dl.connect(served.url) as client, PageClient(served) as page:
        edit(client)
        client.update()
        page.until(lambda data: data["type"] == "state" and data["undo"] == "move lamp and 3 more")
        page.ask("undo")
        page.until(lambda data: data["type"] == "state" and data["undo"] is None)
        client.update()
        assert_same(client, own)


def test_what_is_read_is_the_light_of_the_state(session: dl.Session, own: dl.Session) -> None:
    """Also where the engine has not begun to follow it."""
    answers: queue.Queue = queue.Queue()
    engine = Engine(session, lambda event: None)
    engine.want(Wanted(state_of(session) | {("factor", "desk"): 0.5}, revision=1))
    engine.at_rest(lambda *answer: answers.put((*answer, session.irradiance)), answers.put)
    engine.start()
    try:
        _, revision, figure, values = answers.get(timeout=TIMEOUT)
    finally:
        engine.stop()
    own.dim("desk", 0.5)
    own.update()
    assert (revision, figure["revision"], figure["done"]) == (1, 1, 1)
    assert np.array_equal(values, own.irradiance)


def test_who_waits_for_an_update_that_fails_is_told(
    client: dl.client.Client, session: dl.Session, own: dl.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise MemoryError("none left")

    client.update()
    with monkeypatch.context() as patch:
        patch.setattr(session, "update", fail)
        client.dim("desk", 0.5)
        with pytest.raises(dl.OptionError, match="MemoryError: none left"):
            client.update()
    client.update()  # it is tried again
    own.dim("desk", 0.5)
    own.update()
    assert_same(client, own)


def test_values_are_encoded_for_pages_only(session: dl.Session, serve: Callable[..., Server],
                                           monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    encoded = []
    packed = session.read_packed
    monkeypatch.setattr(session, "read_packed", lambda **_: encoded.append(1) or packed(), raising=True)
    server = serve(session, shown=False)
    with dl.connect(server.url) as client:
        client.dim("desk", 0.5)
        client.update()
        assert encoded == []
        with PageClient(server) as page:
            page.rest()
            assert encoded
            assert page.frame["revision"] == 1
        before = len(encoded)
        deadline = time.monotonic() + TIMEOUT
        while True:  # the page's end takes a moment to be known
            client.dim("desk", 0.25)
            client.update()
            if len(encoded) == before or time.monotonic() > deadline:
                break
            before = len(encoded)
        assert len(encoded) == before


def test_files_are_written_into_the_folder_and_never_over_those_of_others(
    client: dl.client.Client, own: dl.Session, tmp_path: Path
) -> None:
    edit(client)
    assert client.save("edited.dlx") == (tmp_path / "edited.dlx").stat().st_size
    edit(own)
    own.update()
    with dl.Session.open(tmp_path / "edited.dlx") as saved:
        assert saved.digest() == own.digest()
        assert "deltalux serve" in saved.made_by[-1]
    client.export("edited.npz")
    assert np.array_equal(read(tmp_path / "edited.npz").irradiance, own.irradiance)
    (tmp_path / "mine.csv").write_text("mine")
    with pytest.raises(dl.OptionError, match=r'found a file of that name .* "mine-2.csv" is free'):
        client.export("mine.csv")
    with pytest.raises(dl.OptionError, match="expected a plain name"):
        client.export("../away.csv")
    with pytest.raises(dl.OptionError, match=r"save: found 'a.csv', expected NAME.dlx"):
        client.save("a.csv")


def test_a_working_plane_is_served_without_a_page(serve: Callable[..., Server]) -> None:
    scene = dl.scenes.cornell_box()
    plane = dl.Samples.on_grid((-2, 1, 2), (4, 0, 0), (0, 0, -4), spacing=1.0)
    with dl.Session(scene, plane, paths=2000, gather=8) as session:
        server = serve(session, shown=False)
        assert not server.places["page"]
        with dl.connect(server.url) as client:
            values = client.irradiance  # waits for the bake
            client.remove("tall_block")
            client.update()
            assert values.shape == client.irradiance.shape == (16, 3)
            assert not np.array_equal(values, client.irradiance)
            last = client.irradiance
        server.close()
        assert np.array_equal(session.irradiance, last)


def test_dl_serve_is_closed_as_a_view_is(session: dl.Session) -> None:
    with dl.serve(session) as shown, dl.connect(shown.url) as client:
        client.dim("desk", 0.5)
        client.update()
    assert session.dim_factors["desk"] == 0.5
    assert session.update().done == 1
    with pytest.raises(dl.OptionError, match="serve: found Scene, expected a Session"):
        dl.serve(session.scene)
