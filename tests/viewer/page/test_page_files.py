# SPDX-License-Identifier: Apache-2.0
"""Files that the page asks for: the lit scene, the session, the picture as seen."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pygltflib
from PIL import Image


def exported(viewer, suffix: str, tmp_path):
    """Export by the panel, then fetch by its link."""
    viewer.page.get_by_label("File name").fill("lit")
    viewer.page.get_by_label("Kind of file").select_option(suffix)
    viewer.button("Export").click()
    link = viewer.page.get_by_role("link", name=f"lit{suffix}")
    link.wait_for()
    with viewer.page.expect_download() as download:
        link.click()
    path = tmp_path / f"downloaded{suffix}"
    download.value.save_as(path)
    return path


def test_lit_scene_holds_the_irradiance_after_the_move(viewer, server, session, tmp_path):
    viewer.after(lambda: viewer.drag_arrow("X", (-30, 0)))
    path = exported(viewer, ".glb", tmp_path)
    viewer.end(server)
    model = pygltflib.GLTF2().load(str(path))
    blob = model.binary_blob()
    values = []
    for mesh in model.meshes:
        for primitive in mesh.primitives:
            accessor = model.accessors[getattr(primitive.attributes, "_IRRADIANCE")]  # noqa: B009
            view = model.bufferViews[accessor.bufferView]
            start = view.byteOffset + (accessor.byteOffset or 0)
            values.append(np.frombuffer(blob, "<f4", 3 * accessor.count, start).reshape(-1, 3))
    values = np.concatenate(values)
    rows = set(map(bytes, np.ascontiguousarray(session.irradiance.astype("<f4"))))
    assert len(values) >= len(session.irradiance)
    assert all(bytes(row) in rows for row in np.ascontiguousarray(values))


def test_saved_session_has_the_digest_of_the_one_on_show(viewer, server, session, tmp_path):
    viewer.after(lambda: viewer.drag_arrow("X", (-30, 0)))
    path = exported(viewer, ".dlx", tmp_path)
    viewer.end(server)
    with dl.Session.open(path) as again:
        assert again.digest() == session.digest()


def test_screenshot_is_the_picture_with_its_legend(viewer, tmp_path):
    viewer.press("Escape")
    viewer.show("falseColour")
    seen = viewer.picture()
    with viewer.page.expect_download() as download:
        viewer.button("Screenshot").click()
    download.value.save_as(tmp_path / "shot.png")
    shot = np.asarray(Image.open(tmp_path / "shot.png").convert("RGB")).astype(int)
    assert shot.shape == seen.shape
    assert (np.abs(shot - seen).max(axis=2)[:, :500] <= 1).all()
    assert (np.abs(shot - seen).max(axis=2)[:300, -90:] > 30).any()


def test_a_suffix_that_is_typed_chooses_the_kind(viewer):
    viewer.page.get_by_label("File name").fill("Table.CSV")
    assert viewer.page.get_by_label("Kind of file").input_value() == ".csv"
    viewer.page.get_by_label("File name").fill("table.csv")
    viewer.button("Export").click()
    viewer.page.get_by_role("link", name="table.csv", exact=True).wait_for()
