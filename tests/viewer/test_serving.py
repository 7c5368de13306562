# SPDX-License-Identifier: Apache-2.0
"""Pages and engine together: one state for all, undo to the bit, restarts, floods of poses."""

from __future__ import annotations

from contextlib import ExitStack

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene import replace_scene
from deltalux.server.drawn.values import fill_of
from deltalux.server.edits import Reach, pose_numbers
from deltalux.server.protocol.frames import PREVIEW
from deltalux.server.web.serving import Server
from rooms import room, translation, turn

from viewer.page_client import PageClient, decoded
from viewer.served_room import make_session


def numbers(*offset, angle=0.0):
    return list(pose_numbers(translation(*offset) @ turn(angle)))


NEAR = numbers(0.5, 0.4, 0.4, angle=0.2)


def test_a_drag_an_undo_and_the_digest(session, serve):
    expected = session.digest()
    with PageClient(serve(session)) as page:
        page.rest()
        start = page.state["poses"]["block"]
        for k in range(10):
            answer = page.ask("move", name="block", pose=numbers(0.7 - 0.02 * k, 0.4, 0.4), dragging=k < 9)
            assert answer["type"] == "accepted"
        page.rest()
        assert page.state["undo"] == "move block"
        assert page.digest() != expected
        page.ask("undo")
        page.rest()
        assert page.state["poses"]["block"] == start
        assert (page.state["undo"], page.state["redo"]) == (None, "move block")
        assert page.digest() == expected


def test_every_edit_arrives(session, serve):
    server = serve(session)
    with PageClient(server) as page:
        page.rest()
        for kind, fields in (
            ("move", {"name": "block", "pose": NEAR}),
            ("dim", {"group": "desk", "factor": 0.25, "dragging": False}),
            ("reflectance", {"material": "paint", "value": [0.5, 0.25, 0.125]}),
            ("remove", {"name": "lamp"}),
        ):
            assert page.ask(kind, **fields)["type"] == "accepted"
        page.rest()
        assert page.state["poses"] == {"block": NEAR, "lamp": None}
        assert page.state["factors"]["desk"] == 0.25
        assert page.state["reflectances"]["paint"] == [0.5, 0.25, 0.125]
        page.ask("budget", milliseconds=33)
        while page.state["budget"] != 33:
            page.take()
        assert page.ask("remove", name="lamp")["message"] == 'remove "lamp": it is taken away; add it first'
        assert page.ask("move", name="lamp", pose=NEAR)["type"] == "error"
        assert page.ask("add", name="block")["message"] == 'add "block": it is in the scene already'
        rows, scale = page.rows, page.frame["scale"]
    server.close()
    assert np.array_equal(session.pose("block"), np.array(NEAR).reshape(4, 4).T)
    assert session.poses["lamp"] is None
    shown = fill_of(session)(session.irradiance)
    assert decoded(rows, scale)[:, :3] == pytest.approx(shown, rel=1e-3, abs=1e-4 * shown.max())
    with make_session() as fresh:
        fresh.bake()
        fresh.move("block", session.pose("block"))
        fresh.dim("desk", 0.25)
        fresh.set_reflectance("paint", (0.5, 0.25, 0.125))
        fresh.remove("lamp")
        fresh.update()
        assert fresh.digest() == session.digest()


def test_a_pose_too_far_away_is_refused_and_changes_nothing(session, serve):
    with PageClient(serve(session)) as page:
        page.rest()
        before = page.state
        answer = page.ask("move", name="block", pose=numbers(2e15, 0, 0), dragging=True)
        assert answer["type"] == "error"
        assert "pose: found 2000000000000000.0, expected a number from" in answer["message"]
        assert page.ask("undo")["message"] == "undo: found no step to take back"
        assert page.state == before


@pytest.mark.parametrize("shape", ["boxes", "rod"])
def test_the_reach_is_the_core_s(shape):
    """What `Reach` allows the session takes, what it refuses the session refuses: also of a slanting rod."""
    lit, names, samples = room(), ["block", "lamp"], dl.Samples([(0, 0, 0)], (0, 1, 0), radius=0.1)
    suns = [dl.SunLight("sun", (0.1, -1, 0.05), (1, 1, 1))]
    scene = dl.Scene(lit.meshes, lit.materials, [*lit.lights, *suns])
    if shape == "rod":
        ends, names = np.array([(-0.5, -0.2, -0.5), (0.5, 0.2, 0.5), (0.5, 0.21, 0.5)]), ["rod"]
        rod = dl.Mesh("rod", ends, [(0, 1, 2)], "paint", pose=translation(0, 1, 0), movable=True)
        samples = dl.Samples(ends[:2], [(0, 1, 0)], radius=0.1, attached_to="rod")
        scene = dl.Scene([lit.mesh("walls"), rod], lit.materials, suns)
    session = dl.Session(scene, samples, paths=100)
    reach, rng = Reach(session), np.random.default_rng(5)
    outcomes = set()
    for _ in range(300):
        name = str(rng.choice(names))
        pose = translation(*rng.uniform((-2.5, -0.1, -2), (2.5, 5, 2))) @ turn(rng.uniform(0, 6))
        allowed = []
        for check in (reach.check, session.move):
            try:
                check(name, pose)
                allowed.append(True)
            except dl.OptionError as error:
                assert "would leave the box" in str(error)
                allowed.append(False)
        assert allowed[0] == allowed[1]
        outcomes.add(allowed[0])
    assert outcomes == {True, False}


def test_two_pages_see_the_same(session, serve):
    server = serve(session)
    with PageClient(server) as one, PageClient(server) as two:
        one.rest()
        two.rest()
        one.ask("move", name="block", pose=NEAR)
        two.until(lambda data: data["type"] == "state" and data["poses"]["block"] == NEAR)
        two.ask("dim", group="ceiling", factor=0.5)
        for page in (one, two):
            page.until(lambda data: data["type"] == "state" and data["revision"] == 2)
            page.rest()
        assert one.state == two.state
        assert (one.rows == two.rows).all()
        assert one.frame["scale"] == two.frame["scale"]


def test_a_page_that_stalls_has_the_latest_values_when_it_goes_on(session, serve):
    server = serve(session)
    with PageClient(server) as stalled, PageClient(server) as busy:
        stalled.rest()
        busy.rest()
        stalled.acknowledging = False
        for k in range(8):
            busy.ask("move", name="block", pose=numbers(0.7 - 0.05 * k, 0.4, 0.4))
            busy.rest()
        frames = 0
        while stalled.state["revision"] < 8 or stalled.state["phase"] != "ready":
            frames += stalled.take()["type"] == "values"
        assert frames <= 2
        stalled.acknowledging = True
        stalled.acknowledge()
        stalled.rest()
        assert (stalled.rows == busy.rows).all()


def test_a_page_that_leaves_in_a_drag_lets_go(session, serve):
    server = serve(session)
    with PageClient(server) as other:
        other.rest()
        with PageClient(server) as page:
            page.rest()
            page.ask("move", name="block", pose=NEAR, dragging=True)
        other.until(lambda data: data["type"] == "state" and data["revision"] == 2)
        assert other.state["poses"]["block"] == NEAR
        assert other.state["undo"] == "move block"


def test_a_thousand_poses_of_five_pages_at_once(session, serve):
    server = serve(session)
    with ExitStack() as stack:
        pages = [stack.enter_context(PageClient(server)) for _ in range(5)]
        pages[0].rest()
        for k in range(190):
            for i, page in enumerate(pages):
                page.send(
                    "move", name="block", pose=numbers(0.7 - 0.001 * k, 0.4, 0.3 + 0.01 * i), dragging=True
                )
        pages[0].until(lambda data: data["type"] == "state" and data["revision"] == 950)
        pages[0].rest()
        last = pages[0].state["poses"]["block"]
        digest = pages[0].digest()
    with make_session() as fresh:
        fresh.bake()
        fresh.move("block", np.array(last).reshape(4, 4).T)
        fresh.update()
        assert fresh.digest() == digest


def test_a_page_that_comes_while_baking_sees_progress_and_the_preview(serve):
    with make_session(3_000_000) as session:
        server = serve(session)
        with PageClient(server) as first:
            first.until("values")
            assert first.frame["flags"] & PREVIEW
            with PageClient(server) as late:
                late.until("values")
                assert late.frame["flags"] & PREVIEW
                assert late.state["phase"] in ("baking", "preview")
                progress = late.until("progress")
                while progress["fraction"] == 0:  # it has only begun
                    progress = late.until("progress")
                assert progress["task"] == "bake"
                assert 0 < progress["fraction"] < 1
            assert first.ask("check")["message"].startswith("check: found the bake still at work")
            assert first.ask("cancel")["type"] == "accepted"
            assert first.until("cancelled")["task"] == "bake"
            first.until(lambda data: data["type"] == "state" and data["phase"] == "empty")
        server.close()


def test_a_session_saved_and_served_again_is_the_same(session, serve, tmp_path):
    server = serve(session, folder=tmp_path)
    with PageClient(server) as page:
        page.rest()
        page.ask("move", name="block", pose=NEAR)
        page.ask("dim", group="desk", factor=0.3)
        page.ask("reflectance", material="paint", value=[0.1, 0.7, 0.3])
        assert page.ask("export", file="saved.dlx")["type"] == "exported"
        page.rest()
        digest, state = page.digest(), page.state
    server.close()
    with dl.Session.open(tmp_path / "saved.dlx") as opened:
        again = serve(opened)
        with PageClient(again) as page:
            page.rest()
            assert page.state["poses"] == state["poses"]
            assert page.state["factors"] == state["factors"]
            assert page.state["reflectances"]["paint"] == pytest.approx(
                state["reflectances"]["paint"], abs=1e-7
            )
            assert page.digest() == digest
        again.close()


def test_without_movables_every_page_is_told_how_to_have_some(serve):
    scene = room()
    still = replace_scene(scene, meshes=[m for m in scene.meshes if not m.movable], lights=[])
    session = dl.Session(still, dl.Samples.on_vertices(still, spacing=0.8), paths=1000)
    with PageClient(serve(session)) as page:
        assert "--movable NAME" in page.until("notice")["message"]


def test_a_port_in_use_is_named(session, serve):
    server = serve(session)
    with make_session() as other, pytest.raises(OSError, match="choose another --port"):
        serve(other, port=server.port)


@pytest.mark.parametrize("host", ["", "256.0.0.1", "no such host", "x" * 300, "\udcff"])
def test_a_host_that_is_no_address_is_named(session, serve, host):
    with pytest.raises(dl.OptionError, match=r"host: found '.*', expected an address of this machine"):
        serve(session, host=host)


def test_a_missing_page_is_an_error(session, tmp_path):
    with pytest.raises(dl.Error, match="found no page"):
        Server(session, page=tmp_path)
