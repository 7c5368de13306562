# SPDX-License-Identifier: Apache-2.0
"""The page bakes: progress, previews marked as such, cancelling, and light at the end."""

from __future__ import annotations

import deltalux as dl
import pytest
from deltalux.server.web.serving import Server

from viewer.page.two_cells import make_session, two_cells

PATHS = 2_000_000  # some seconds
WATCH_PROGRESS = """
window.seen = [];
new MutationObserver(() => {
  const box = document.querySelector('.progress');
  if (!box.hidden) seen.push([box.querySelector('span').textContent, box.querySelector('progress').value]);
}).observe(document.querySelector('.progress'), { subtree: true, childList: true, attributes: true });
"""


@pytest.fixture
def dark_session():
    with make_session(paths=PATHS) as session:
        yield session


def test_first_bake_shows_progress_previews_and_then_the_exact_light(open_page, dark_session):
    with Server(dark_session) as server:
        viewer = open_page(server.url)
        viewer.page.evaluate(WATCH_PROGRESS)
        viewer.until("deltalux.state().preview", 60)
        assert viewer.page.get_by_text("Preview: fewer paths").is_visible()
        viewer.until("deltalux.idle() && !deltalux.state().preview", 120)
        assert viewer.page.get_by_text("Preview: fewer paths").is_hidden()
        seen = viewer.ask("seen")
        assert seen and all(text.startswith("Baking: ") and "%" in text for text, _ in seen)
        fractions = [fraction for _, fraction in seen]
        assert fractions == sorted(fractions) and fractions[0] < 0.9
        assert viewer.page.locator(".progress").is_hidden()
        assert viewer.state()["frame"]["paths"] == PATHS
        viewer.end(server)


def test_cancelled_bake_leaves_no_light_and_can_be_started_again(open_page, dark_session):
    with Server(dark_session) as server:
        viewer = open_page(server.url)
        viewer.button("Cancel").click()
        viewer.until("deltalux.state().server.phase === 'empty'")
        assert viewer.page.get_by_text("The bake was cancelled.").is_visible()
        viewer.button("Bake").click()
        viewer.until("deltalux.idle() && !deltalux.state().preview", 120)
        viewer.end(server)


def test_scene_without_light_says_so(open_page):
    scene = two_cells()
    unlit = [dl.Material(m.name, m.reflectance) for m in scene.materials]
    dark = dl.Scene(scene.meshes, unlit, cameras=scene.cameras)
    samples = dl.Samples.on_vertices(dark, spacing=0.5)
    with dl.Session(dark, samples, paths=2000, gather="off") as session, Server(session) as server:
        viewer = open_page(server.url)
        light = viewer.page.locator(".light-state")
        assert "There is no light in this scene" in light.inner_text()
        buttons = light.get_by_role("button").filter(visible=True)
        assert buttons.all_inner_texts() == ["Add a lamp"]  # there is none to switch on
        viewer.end(server)


def test_check_recomputes_the_same_light(viewer, server, session):
    assert viewer.state()["known"]
    viewer.press("x")
    viewer.until("deltalux.state().checked !== null && deltalux.idle()")
    checked = viewer.state()["checked"]
    assert checked["same"] and checked["digest"] == checked["recomputed"]
    assert "✓ Same digest" in viewer.page.locator(".verdict").inner_text()
    viewer.end(server)
    assert session.digest() == checked["digest"]


def test_an_update_that_failed_is_told_and_undone(viewer, session, monkeypatch):
    def fail(*_):
        raise MemoryError("none left")

    said, light = viewer.page.locator(".phase"), viewer.page.locator(".light-state")
    assert (said.inner_text(), light.is_visible()) == ("Exact", False)
    with monkeypatch.context() as patch:
        patch.setattr(session, "update", fail)
        viewer.button("Remove").click()
        viewer.until("deltalux.state().server.phase === 'failed'")
    assert said.inner_text() == "Update failed"
    assert "this light is not up to date" in light.inner_text()
    assert viewer.page.get_by_text("update failed: MemoryError: none left").is_visible()
    viewer.after(lambda: viewer.press("Control+z"))
    assert (said.inner_text(), light.is_visible()) == ("Exact", False)


def test_samples_that_no_path_reached_are_counted_where_the_light_rests(open_page):
    with make_session(paths=1000) as session:
        session.bake()
        expected = [f"{session.unreached} samples that no path reached"]
        with Server(session) as server:
            viewer = open_page(server.url)
            line, mouse = viewer.page.locator(".unreached"), viewer.page.mouse
            line.wait_for()
            shown = [line.inner_text()]
            viewer.settle()
            x, y = viewer.ask("deltalux.project('post')")
            mouse.move(x, y)
            mouse.down()
            mouse.move(x - 40, y + 10, steps=3)
            line.wait_for(state="hidden")
            viewer.settle()
            assert line.is_hidden()  # nobody counts before the drag's end
            mouse.up()
            line.wait_for()
            shown.append(line.inner_text())
            viewer.end(server)
        expected.append(f"{session.unreached} samples that no path reached")
    assert shown == expected
    assert shown[0] != shown[1]
