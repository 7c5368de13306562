# SPDX-License-Identifier: Apache-2.0
"""Colour scales by what is seen, their legend, numbers on isolines, and what differences are counted from."""

from __future__ import annotations

import numpy as np
from deltalux.outputs.colour_scale import ColourScale, scale_for
from deltalux.outputs.tone import encode_srgb

READ_ALL = """(places) => places.map(([x, y]) => deltalux.probe(x, y))"""


def readings(viewer, columns: int, rows: int):
    """Places of the canvas and what is read there, where something sampled is seen."""
    places = viewer.places(columns, rows)
    hits = viewer.page.evaluate(READ_ALL, [(x + 0.5, y + 0.5) for x, y in places])
    return [(place, hit) for place, hit in zip(places, hits, strict=True) if hit and hit["sampled"]]


def test_automatic_range_is_that_of_what_is_seen(viewer):
    viewer.press("Escape")
    viewer.show("falseColour")
    seen = np.array([hit["reading"]["value"] for _, hit in readings(viewer, 48, 30)])
    scale, expected = viewer.state()["scale"], scale_for(seen)
    assert (scale["low"], scale["high"]) == (expected.low, expected.high)
    assert (seen < scale["low"]).mean() <= 0.03 and (seen > scale["high"]).mean() <= 0.03
    assert not scale["logarithmic"] or scale["high"] / scale["low"] < 1000


def test_range_is_changed_in_the_legend(viewer):
    legend = viewer.page.locator(".legend")
    assert legend.is_hidden()
    viewer.show("falseColour")
    found, bar = viewer.state()["scale"], legend.get_by_role("img")
    assert "lx" in bar.get_attribute("aria-label")
    high = legend.get_by_label("Upper end of the colours")
    automatic = legend.get_by_role("button", name="Auto")
    assert automatic.get_attribute("aria-pressed") == "true" and float(high.input_value()) == found["high"]
    high.fill("120")
    high.press("Enter")
    assert viewer.state()["scale"]["high"] == 120 and bar.get_attribute("aria-label").endswith("to 120")
    assert automatic.get_attribute("aria-pressed") == "false"
    automatic.click()
    assert viewer.state()["scale"] == found


def test_standard_error_is_shown_in_per_cent_of_the_value(viewer):
    viewer.press("Escape")
    viewer.show("error")
    assert ", %, " in viewer.page.locator(".legend").get_by_role("img").get_attribute("aria-label")
    assert viewer.page.get_by_label("To, %", exact=True).is_visible()
    scale, pixels = ColourScale(**viewer.state()["scale"]), viewer.picture()
    compared = 0
    for (x, y), hit in readings(viewer, 12, 8):
        if min(hit["weights"]) < 0.1 or hit["reading"]["value"] <= 0 or "lamp" in hit["name"]:
            continue
        share = np.array(100 * hit["reading"]["error"] / hit["reading"]["value"])
        close = np.abs(pixels[y, x] - encode_srgb(scale.colours(share)).astype(int)).max()
        compared += close <= 3
    assert compared > 40


def test_isolines_carry_their_values(viewer):
    viewer.press("Escape")
    viewer.show("falseColour")
    viewer.press("i")
    viewer.until("deltalux.state().isolineLabels.length > 2")
    scale = viewer.state()["scale"]
    ticks = ColourScale(**scale).ticks()
    for label in viewer.state()["isolineLabels"]:
        assert np.isclose(ticks, label["value"]).any()
        read = viewer.probe(label["x"], label["y"])["reading"]["value"]
        assert abs(read / label["value"] - 1) < 0.1
    viewer.press("i")
    viewer.until("deltalux.state().isolineLabels.length === 0")


def test_difference_is_to_before_the_last_edit_unless_another_state_is_chosen(viewer):
    said = viewer.page.locator(".comparison")
    viewer.press("Escape")
    viewer.show("difference")
    assert said.inner_text().startswith("Nothing was edited yet")
    viewer.page.get_by_label("Selected object").select_option("crate")
    places = [place for place, hit in readings(viewer, 8, 6) if hit["name"] == "left cell"]

    def read(key: str) -> np.ndarray:
        return np.array([viewer.probe(x + 0.5, y + 0.5)["reading"][key] for x, y in places])

    values = [read("value")]
    for _ in range(2):
        viewer.after(lambda: viewer.press("ArrowLeft"))
        values.append(read("value"))
    assert said.inner_text() == "Now minus before the last edit"
    assert np.abs(values[2] - values[1]).max() > 0
    np.testing.assert_allclose(read("change"), values[2] - values[1], atol=1e-9 * values[0].max())
    choice = viewer.page.get_by_label("Compare with")
    choice.select_option("start")
    np.testing.assert_allclose(read("change"), values[2] - values[0], atol=1e-9 * values[0].max())
    assert "the start of this page" in said.inner_text()
    assert choice.locator("option[value=remembered]").is_disabled()
    viewer.press("m")
    viewer.until("deltalux.state().settings.reference === 'remembered'")
    assert (read("change") == 0).all() and "the remembered state" in said.inner_text()


def test_a_whole_drag_is_one_edit_for_the_difference(viewer):
    places = [place for place, hit in readings(viewer, 8, 6) if hit["name"] == "left cell"]
    before = [viewer.probe(x + 0.5, y + 0.5)["reading"]["value"] for x, y in places]
    viewer.after(lambda: viewer.drag_arrow("X", (-30, 0)), "deltalux.state().server.undo !== null")
    viewer.show("difference")
    for (x, y), value in zip(places, before, strict=True):
        reading = viewer.probe(x + 0.5, y + 0.5)["reading"]
        assert abs(reading["value"] - value - reading["change"]) <= 1e-9 * value
