# SPDX-License-Identifier: Apache-2.0
"""Bakes of another version of the scene on request: one more movable, one more lamp; edits are kept."""

from __future__ import annotations

import json
import threading
from dataclasses import replace

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene import replace_scene
from deltalux.server.edits import pose_numbers
from deltalux.server.engine.progress import TaskProgress
from deltalux.server.engine.remaking import samples_like
from rooms import box, room, translation

from viewer.page_client import TIMEOUT, PageClient, decoded, get
from viewer.served_room import PATHS, make_session

MOVED = list(pose_numbers(translation(0.4, 0.35, 0.2)))


def dark_session() -> dl.Session:
    """A session of the room without its lights, with nothing that moves either."""
    meshes = [replace(m, movable=False) for m in room().meshes if m.name in ("walls", "block")]
    scene = dl.Scene(meshes, [m for m in room().materials if not m.emissive], unit="lux")
    samples = dl.Samples.on_vertices(scene, spacing=0.6, radius=0.15)
    return dl.Session(scene, samples, paths=PATHS, threads=2, gather="off")


@pytest.fixture
def dark(serve):
    with dark_session() as session:
        server = serve(session)
        with PageClient(server) as page:
            page.rest()
            yield page, server, session


def light(page: PageClient) -> np.ndarray:
    return decoded(page.rows, page.frame["scale"])[:, :3]


def test_a_lamp_lights_a_dark_scene_and_undo_takes_it_back(dark):
    page, server, _ = dark
    assert page.state["dark"]
    assert not light(page).any()
    page.ask("add_lamp", position=[0.1, 1.6, 0.2])
    notice = page.until(lambda m: m["type"] == "notice" and "shines" in m["message"])
    assert notice["message"] == "lamp shines now: 7,200 lm at 0.1, 1.6, 0.2 m"
    page.rest()
    assert (page.state["dark"], page.state["factors"]) == (False, {"lamp": 1.0})
    assert page.state["undo"] == "add lamp"
    shining = light(page)
    assert (shining.sum(axis=1) > 0).mean() > 0.9
    # The lumen method's promise: the floor of 12 m² has some 300 lx.
    points = np.frombuffer(get(server, "/geometry.bin").read(), "<f4", len(shining) * 3).reshape(-1, 3)
    floor = shining[(points[:, 1] < 1e-3) & (np.abs(points[:, 0]) < 1.5), 1]
    assert 150 < floor.mean() < 900
    page.ask("undo")
    page.rest()
    assert page.state["dark"]
    assert not light(page).any()
    page.ask("redo")
    page.rest()
    assert np.array_equal(light(page), shining)
    page.digest()


def test_it_is_the_light_of_a_session_made_with_the_lamp(dark):
    page, server, session = dark
    page.ask("add_lamp", position=[0.1, 1.6, 0.2])
    page.until(lambda m: m["type"] == "notice" and "shines" in m["message"])
    page.rest()
    server.close()
    with dl.Session(session.scene, samples_like(session.samples, session.scene), **session.options) as own:
        own.bake()
        assert own.digest() == session.digest()
    assert [light.name for light in session.scene.lights] == ["lamp"]


def test_a_second_lamp_has_another_name_and_edits_are_kept(served_page):
    page, _ = served_page
    page.ask("move", name="block", pose=MOVED)
    page.ask("dim", group="ceiling", factor=0.25)
    page.ask("remove", name="lamp")
    for _ in range(2):
        page.ask("add_lamp", position=[0.0, 1.5, 0.0])
        page.until(lambda m: m["type"] == "notice" and "shines" in m["message"])
        page.rest()
    state = page.state
    assert state["factors"] == {"ceiling": 0.25, "desk": 1.0, "lamp": 1.0, "lamp 2": 1.0}
    assert (state["poses"]["block"], state["poses"]["lamp"]) == (MOVED, None)
    for _ in range(3):
        page.ask("undo")
    page.rest()
    assert page.state["factors"] == {"ceiling": 0.25, "desk": 1.0, "lamp": 0.0, "lamp 2": 0.0}
    assert page.state["poses"]["lamp"] is not None
    page.digest()


@pytest.fixture
def served_page(session, serve):
    server = serve(session)
    with PageClient(server) as page:
        page.rest()
        yield page, session


def test_what_was_fixed_is_moved(served_page):
    page, session = served_page
    page.ask("move", name="block", pose=MOVED)
    assert page.ask("make_movable", mesh="ceiling lamp")["type"] == "accepted"
    page.until("geometry")
    page.until(lambda m: m["type"] == "notice" and m["message"] == "ceiling lamp can be moved now")
    page.rest()
    assert page.state["poses"]["block"] == MOVED
    lower = list(pose_numbers(translation(0.2, -0.5, 0.1)))
    assert page.ask("move", name="ceiling lamp", pose=lower)["type"] == "accepted"
    page.rest()
    digest = page.digest()
    with make_session() as own:
        meshes = [replace(m, movable=m.name != "walls") for m in own.scene.meshes]
        scene = replace_scene(own.scene, meshes=meshes)
        with dl.Session(scene, samples_like(own.samples, scene), **session.options) as fresh:
            fresh.move("block", np.array(MOVED).reshape(4, 4).T)
            fresh.bake()
            fresh.move("ceiling lamp", np.array(lower).reshape(4, 4).T)
            fresh.update()
            assert fresh.digest() == digest


def test_pages_get_the_new_description(dark):
    page, server, _ = dark
    before = json.loads(get(server, "/scene.json").read())
    page.ask("make_movable", mesh="block")
    number = page.until("geometry")["number"]
    page.rest()
    after = json.loads(get(server, "/scene.json", more=f"&geometry={number}").read())
    assert (before["version"], after["version"]) == (0, 1)
    assert [m["movable"] for m in after["meshes"]] == [False, True]
    assert len(page.rows) == after["vertices"]
    with PageClient(server) as late:  # is not told that nothing can be moved
        late.until("geometry")
        late.rest()
        assert late.state["poses"].keys() == {"block"}


@pytest.mark.parametrize(
    ("kind", "fields", "text"),
    [
        ("make_movable", {"mesh": "block"}, 'mesh: found "block", expected one of ["ceiling lamp", "walls"]'),
        ("make_movable", {"mesh": "chair"}, 'mesh: found "chair", expected one of'),
        ("add_lamp", {"position": [0, 1]}, "position: found [0, 1], expected 3 numbers"),
        (
            "add_lamp",
            {"position": [0, 9, 0]},
            "add_lamp: found the position 0, 9, 0 m, expected one in the box that the session was made for, "
            "-2.08, -0.04, -1.56 m to 2.08, 2.04, 1.56 m",
        ),
    ],
)
def test_refusals(served_page, kind, fields, text):
    page, _ = served_page
    answer = page.ask(kind, **fields)
    assert answer["type"] == "error"
    assert answer["message"].startswith(text)


@pytest.mark.usefixtures("reports_at_once")
@pytest.mark.parametrize("stage", ["place samples", "make session", "trace paths"])
def test_a_cancelled_one_leaves_everything(serve, baked_file, monkeypatch, stage):
    reached, cancelled = threading.Event(), threading.Event()
    report = TaskProgress.__call__

    def wait_there(progress, name, fraction):
        if name == stage:
            reached.set()
            assert cancelled.wait(TIMEOUT)
        return report(progress, name, fraction)

    with dl.Session.open(baked_file) as session:
        digest = session.digest()
        with PageClient(serve(session)) as page:
            page.rest()
            with monkeypatch.context() as patch:
                patch.setattr(TaskProgress, "__call__", wait_there)
                # The core works on while its callback waits: it must have seconds left when asked to stop.
                patch.setitem(session._options, "paths", 300 * PATHS)
                page.ask("make_movable", mesh="ceiling lamp")
                assert reached.wait(TIMEOUT)
                assert page.ask("cancel")["type"] == "accepted"
                cancelled.set()
                page.until("cancelled")
            page.rest()
            assert page.state["poses"].keys() == {"block", "lamp"}
            assert page.digest() == digest


def test_uneven_radii_are_refused(serve):
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.9)
    uneven = dl.Samples.on_vertices(
        scene, display=samples.display, radius=np.linspace(0.1, 0.2, len(samples))
    )
    session = dl.Session(scene, uneven, paths=1000, threads=1, gather="off")
    with session, PageClient(serve(session)) as page:
        page.rest()
        page.ask("make_movable", mesh="walls")
        notice = page.until(lambda m: m["type"] == "notice")
        assert "bake failed: view: found samples with" in notice["message"]
        page.rest()


def test_darkness_is_that_of_lamps_that_are_there(served_page):
    page, _ = served_page
    for kind, fields, dark in (
        ("dim", {"group": "ceiling", "factor": 0}, False),
        ("remove", {"name": "lamp"}, True),  # and with it the spot
        ("dim", {"group": "ceiling", "factor": 0.1}, False),
    ):
        page.ask(kind, **fields)
        page.rest()
        assert page.state["dark"] == dark


def test_a_rebake_that_fails_leaves_the_session(session):
    digest = session.digest()
    vertices, triangles = box((0.1, 0.1, 0.1))
    far = dl.Mesh("far", vertices, triangles, "wall", movable=True)
    with pytest.raises(dl.Error):
        session.rebake(replace_scene(session.scene, meshes=[far]))
    assert session.digest() == digest
