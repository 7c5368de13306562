# SPDX-License-Identifier: Apache-2.0
"""Many lamps: found, folded, dimmed together in one step, and alone."""

from __future__ import annotations

import deltalux as dl
import pytest
from deltalux.server.web.serving import Server

from viewer.page.many_lamps import NAMES, make_session
from viewer.served_room import saved


@pytest.fixture(scope="module")
def lamps_file(tmp_path_factory):
    return saved(make_session(), tmp_path_factory.mktemp("lamps") / "lamps.dlx")


@pytest.fixture
def lamps(lamps_file, open_page):
    with dl.Session.open(lamps_file) as session, Server(session) as server:
        viewer = open_page(server.url)
        viewer.settle()
        yield viewer
        viewer.end(server)


def factors(viewer) -> dict[str, float]:
    return viewer.state()["server"]["factors"]


def rows(viewer) -> list[str]:
    """Names of the dimmers in sight."""
    found = viewer.page.locator(".dimmer > span:visible").all_inner_texts()
    return [text for text in found if text != "Exposure"]


def page_title(viewer, text: str) -> str:
    """The whole name, under the pointer."""
    return viewer.page.locator(".dimmer > span:visible", has_text=text).get_attribute("title")


def test_lamps_are_folded_by_name_and_found_by_search(lamps):
    assert rows(lamps) == ["All lights", "hall", "stairs", "spot", "sign"]
    search = lamps.page.get_by_label("Search lights")
    search.fill("LAMP 2")
    assert rows(lamps) == ["All lights", "hall", "lamp 2", "stairs", "lamp 2"]
    search.fill("")
    assert rows(lamps) == ["All lights", "hall", "stairs", "spot", "sign"]
    lamps.page.get_by_text("stairs: 3 lights").click()
    assert rows(lamps)[3:6] == ["lamp 1", "lamp 2", "lamp 3"]
    assert page_title(lamps, "lamp 3") == "stairs / lamp 3"


def test_all_lights_and_families_are_dimmed_in_one_step_that_keeps_proportions(lamps):
    page = lamps.page
    lamps.after(lambda: page.get_by_label("Light of sign", exact=True).fill("250"))  # half
    lamps.after(lambda: page.get_by_label("All lights", exact=True).fill("250"))
    assert factors(lamps) == {name: 0.25 if name == "sign" else 0.5 for name in NAMES}
    lamps.after(lambda: page.get_by_label("Lights of spot", exact=True).fill("0"))
    assert factors(lamps)["spot 1"] == factors(lamps)["spot 2"] == 0
    lamps.after(lambda: page.get_by_label("Lights of spot", exact=True).fill("500"))
    assert factors(lamps)["spot 1"] == 0.5
    for _ in range(2):
        lamps.after(lambda: lamps.press("Control+z"))
    lamps.after(lambda: lamps.press("Control+z"))
    assert factors(lamps) == {name: 0.5 if name == "sign" else 1.0 for name in NAMES}


def test_solo_leaves_some_alone_and_brings_the_others_back(lamps):
    lamps.after(lambda: lamps.page.get_by_label("Light of sign", exact=True).fill("250"))
    before = factors(lamps)
    lamps.after(lambda: lamps.button("Solo sign").click())
    assert factors(lamps) == {name: 0.5 if name == "sign" else 0.0 for name in NAMES}
    assert lamps.button("Solo sign").get_attribute("aria-pressed") == "true"
    lamps.after(lambda: lamps.button("Solo spot").click())
    assert factors(lamps) == {name: 1.0 if name.startswith("spot") else 0.0 for name in NAMES}
    lamps.after(lambda: lamps.button("Solo spot").click())
    assert factors(lamps) == before
