# SPDX-License-Identifier: Apache-2.0
"""What the page shows is what the session holds: probe, colours, difference, dimmers."""

from __future__ import annotations

import numpy as np
import pytest
from deltalux.mesh.surfaces import Surfaces
from deltalux.outputs.colour_scale import ColourScale
from deltalux.outputs.images import render
from deltalux.outputs.tone import encode_srgb
from deltalux.outputs.view import camera_rays
from deltalux.samples.clearance import covered_samples
from deltalux.scene import Camera
from deltalux.units import photopic


def camera_of(viewer) -> tuple[Camera, tuple[int, int]]:
    """The page's camera and its picture's size."""
    state = viewer.state()
    pose = np.array(state["camera"]["pose"]).reshape(4, 4).T
    size = round(state["canvas"]["width"]), round(state["canvas"]["height"])
    return Camera("page", pose, np.radians(state["camera"]["fov"])), size


def test_probe_reads_the_session_to_a_thousandth(viewer, server, session):
    places = np.array(viewer.places(14, 8)) + 0.5
    camera, size = camera_of(viewer)
    read = [viewer.probe(x, y) for x, y in places]
    viewer.end(server)
    display = session.samples.display
    surfaces = Surfaces(session.scene, display, session.poses)
    hits = surfaces.intersect(*camera_rays(camera, size, places[:, 0], places[:, 1]))
    values, covered = photopic(session.irradiance), covered_samples(surfaces)
    compared = 0
    for i, found in enumerate(read):
        if found is None or not found["sampled"] or not hits.facing[i] or hits.weights[i].min() < 0.02:
            continue
        corners = display.triangles[hits.triangle[i]]
        if covered[corners].any():
            continue  # shows its neighbours' light
        expected = hits.weights[i] @ values[corners]
        assert abs(found["reading"]["value"] - expected) < 1e-3 * expected
        errors = photopic(session.standard_error)[corners]
        assert abs(found["reading"]["error"] - hits.weights[i] @ errors) < 2e-3 * errors.max()
        compared += 1
    assert compared > 40


def test_click_shows_value_and_error_at_the_pointer(viewer):
    x, y = viewer.places(3, 3)[0]
    box = viewer.state()["canvas"]
    viewer.page.mouse.click(box["left"] + x, box["top"] + y)
    pin = viewer.page.locator(".pin")

    def shows_the_reading() -> bool:
        value = viewer.probe(x, y)["reading"]["value"]
        return float(pin.inner_text().split(" ")[0]) == float(f"{value:.3g}")

    assert shows_the_reading() and " ± " in pin.inner_text() and "lx" in pin.inner_text()
    viewer.after(lambda: viewer.press("ArrowLeft"))
    assert shows_the_reading()
    viewer.press("Escape")
    assert pin.count() == 0


@pytest.mark.parametrize("false_colour", [False, True])
def test_pictures_equal_the_renderers(viewer, server, session, false_colour):
    viewer.press("Escape")
    if false_colour:
        viewer.show("falseColour")
    viewer.settle()
    state, pixels = viewer.state(), viewer.picture()
    camera, size = camera_of(viewer)
    viewer.end(server)
    scale = state["scale"] and ColourScale(**state["scale"])
    expected = render(
        session.scene, session.samples.display, session.irradiance, poses=session.poses, camera=camera,
        size=size, exposure=state["exposure"], false_colour=false_colour, scale=scale,
    ).pixels[:, : size[0]]  # fmt: skip
    difference = np.abs(pixels - expected.astype(int)).max(axis=2)
    assert np.percentile(difference, 90) <= 2  # the rest is the softness of edges


def test_automatic_exposure_is_the_renderers(viewer, server, session):
    exposure = viewer.state()["exposure"]
    camera, size = camera_of(viewer)
    viewer.end(server)
    display = session.samples.display
    picture = render(
        session.scene, display, session.irradiance, poses=session.poses, camera=camera, size=size
    )
    assert abs(np.log2(exposure / picture.exposure)) < 0.1  # stops; the page measures fewer points


def test_isolines_are_drawn_and_taken_away(viewer):
    viewer.show("falseColour")
    plain = viewer.picture()
    viewer.press("i")
    viewer.settle()
    assert 0.002 < (np.abs(viewer.picture() - plain).max(axis=2) > 30).mean() < 0.3
    viewer.press("i")
    viewer.settle()
    assert (viewer.picture() == plain).all()


def test_difference_is_of_the_scales_colour_also_where_nothing_changed(viewer, server, session):
    places = viewer.places(16, 9)
    viewer.press("m")
    viewer.after(lambda: viewer.drag_arrow("X", (-30, 0)))
    viewer.press("Escape")
    viewer.show("difference")
    pixels, found = viewer.picture(), [viewer.probe(x + 0.5, y + 0.5) for x, y in places]
    scale = ColourScale(**viewer.state()["scale"])
    viewer.end(server)
    scene_meshes = [m.name for m in session.scene.meshes]
    mesh_of = session.samples.display.vertex_mesh
    outside = inside = 0
    signs = set()
    for (x, y), hit in zip(places, found, strict=True):
        if hit is None or not hit["sampled"] or min(hit["weights"]) < 0.1:
            continue  # nothing there, or close to an edge, where a line may be
        change = hit["reading"]["change"]
        expected = encode_srgb(scale.colours(np.array(change)))
        assert np.abs(pixels[y, x] - expected.astype(int)).max() <= 2
        corners = np.array(hit["vertices"])
        assert scene_meshes[mesh_of[corners[0]]] == hit["name"]
        if hit["name"] in ("right cell", "right lamp", "post"):
            assert change == 0
            outside += 1
        elif hit["name"] == "left cell":
            inside += change != 0
            signs.add(np.sign(change))
    assert outside > 20 and inside > 20
    assert signs >= {-1, 1}


def test_lights_that_are_all_off_are_said_and_can_be_switched_on(viewer):
    said = viewer.page.locator(".light-state")
    assert said.is_hidden()
    viewer.after(lambda: viewer.page.get_by_label("All lights", exact=True).fill("0"))
    assert "No lamp shines" in said.inner_text()
    viewer.show("falseColour")
    assert viewer.state()["scale"]["high"] == 1  # there is nothing to go by
    viewer.after(lambda: viewer.button("Switch them on").click())
    assert viewer.state()["scale"]["high"] > 10
    assert said.is_hidden() and set(viewer.state()["server"]["factors"].values()) == {1.0}


def test_dimmer_scales_the_light_of_its_group(viewer, server, session):
    places = viewer.places(10, 6)
    before = [viewer.probe(x, y) for x, y in places]
    slider = viewer.page.get_by_label("Light of left", exact=True)
    viewer.after(lambda: slider.fill("250"))  # of 1000, which are twice the loaded power
    assert viewer.state()["server"]["factors"] == {"left": 0.5, "right": 1.0}
    for (x, y), old in zip(places, before, strict=True):
        if old is None or not old["sampled"] or old["reading"]["value"] < 1:
            continue
        factor = 0.5 if old["name"] in ("left cell", "crate") else 1.0
        if old["name"] in ("left cell", "crate", "right cell", "post"):
            assert abs(viewer.probe(x, y)["reading"]["value"] / old["reading"]["value"] - factor) < 1.5e-3
    viewer.end(server)
    assert session.dim_factors == {"left": 0.5, "right": 1.0}
