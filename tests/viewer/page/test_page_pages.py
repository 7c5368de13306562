# SPDX-License-Identifier: Apache-2.0
"""Several pages, lost connections, links: everybody sees the one state, and the view comes back."""

from __future__ import annotations

import numpy as np
from deltalux.server.web.serving import Server


def test_two_pages_see_each_others_moves(viewer, open_page, server):
    other = open_page(server.url)
    other.settle()
    viewer.after(lambda: viewer.drag_arrow("X", (-30, 0)))
    revision = viewer.state()["server"]["revision"]
    other.until(f"deltalux.state().server.revision === {revision} && deltalux.idle()")
    assert (other.pose("crate") == viewer.pose("crate")).all()
    x, y = viewer.places(4, 3)[0]
    assert other.probe(x, y)["reading"] == viewer.probe(x, y)["reading"]
    other.after(lambda: other.press("Control+z"))
    revision = other.state()["server"]["revision"]
    viewer.until(f"deltalux.state().server.revision === {revision} && deltalux.idle()")
    assert (viewer.pose("crate") == other.pose("crate")).all()


def test_page_comes_back_after_the_server_restarted(open_page, session, monkeypatch):
    monkeypatch.setattr("deltalux.server.web.serving.secrets.token_urlsafe", lambda: "the same one")
    with Server(session) as first:
        viewer = open_page(first.url)
        viewer.settle()
        viewer.show("falseColour")
        viewer.after(lambda: viewer.drag_arrow("X", (-30, 0)))
        pose, port = viewer.pose("crate"), first.port
        viewer.ask("window.samePage = true")
        viewer.expect_complaint("WebSocket connection to")
    viewer.until("deltalux.state().link === 'lost'")
    assert viewer.page.locator(".banner").is_visible()
    said = viewer.page.locator(".phase")
    assert (said.inner_text(), said.get_attribute("data-phase")) == ("Server away", "failed")
    with Server(session, port=port):
        viewer.until("deltalux.state().link === 'connected'")
        viewer.settle()
        assert said.inner_text() == "Exact"
        assert viewer.page.locator(".banner").is_hidden() and viewer.ask("window.samePage")
        assert (viewer.pose("crate") == pose).all()
        assert viewer.state()["settings"]["mode"] == "falseColour"
        viewer.after(lambda: viewer.press("ArrowRight"))
        moved = viewer.pose("crate")
        viewer.page.goto("about:blank")
    assert (session.pose("crate") == moved).all()


def test_a_link_brings_the_view_back(viewer, open_page, server):
    viewer.show("error")
    viewer.press("i")
    viewer.until("location.hash.includes('isolines=1')")
    x, y = viewer.places(3, 3)[8]
    state = viewer.state()
    box, pose = state["canvas"], state["camera"]["pose"]
    viewer.drag((box["left"] + x, box["top"] + y), (60, 20))  # orbits
    viewer.settle()
    # On a busy machine an address may be written half-way through the orbit.
    viewer.until(
        """(() => {
          const eye = new URLSearchParams(location.hash.slice(1)).get('eye').split(',').map(Number)
          return deltalux.state().camera.pose.every((value, i) => Math.abs(value - eye[i]) < 1e-3)
        })()"""
    )
    state = viewer.state()
    assert not np.allclose(state["camera"]["pose"], pose, atol=1e-2)
    other = open_page(server.url, viewer.ask("location.hash"))
    other.settle()
    again = other.state()
    assert again["settings"] == state["settings"]
    assert np.allclose(again["camera"]["pose"], state["camera"]["pose"], atol=1e-3)


def test_wrong_token_is_explained(browser, server):
    page = browser.new_page()
    page.goto(server.url[:-4] + "nope")
    page.get_by_text("lacks the right token").wait_for()
    page.close()
