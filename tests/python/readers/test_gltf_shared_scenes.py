# SPDX-License-Identifier: Apache-2.0
"""The folder of real scenes: every file gives what its tables say. Left out where the folder is absent."""

import json
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from deltalux.io.decoding.process import PACKAGES
from real_scenes import FOLDER

KIND = {dl.PointLight: "point", dl.SpotLight: "spot", dl.SunLight: "directional"}


def table(name):
    path = FOLDER / name
    return json.loads(path.read_text()) if path.exists() else {}


FACTS = table("facts.json")
EXPECTED_BAD = {k: v["expect"] for k, v in table("expected_bad.json").items() if v["expect"] != "-"}


@pytest.mark.parametrize("name", FACTS)
def test_facts(name):
    facts = FACTS[name]
    for extension in PACKAGES.keys() & set(facts["extensionsRequired"]):
        pytest.importorskip(PACKAGES[extension])
    scene = dl.load(FOLDER / name)
    info = scene.info()
    assert info["triangles"] == facts["triangles"]
    assert info["area"] == pytest.approx(facts["area"], rel=1e-4)
    assert info["emissive_area"] == pytest.approx(facts["emissive_area"], rel=1e-4)
    low, high = np.array(info["bounds"])
    size = np.max(np.subtract(facts["bbox_max"], facts["bbox_min"]))
    np.testing.assert_allclose(low, facts["bbox_min"], atol=1e-4 * size)
    np.testing.assert_allclose(high, facts["bbox_max"], atol=1e-4 * size)
    assert sorted(KIND[type(light)] for light in scene.lights) == sorted(facts["lights"])
    assert len(scene.nodes) <= facts["nodes"]
    movable = [node.name for node in scene.nodes if node.name.startswith("MOVE_")]
    assert list(scene.movable) == movable


@pytest.mark.parametrize("name", EXPECTED_BAD)
def test_malformed_files(name):
    if EXPECTED_BAD[name] == "accept":
        info = dl.load(FOLDER / name).info()
        assert info["emissive_area"] == pytest.approx(0.36)
        return
    with pytest.raises((dl.FormatError, dl.SceneError)) as error:
        dl.load(FOLDER / name)
    assert str(error.value).startswith(Path(name).name + ": ")
    word = {"missing_bin": "does_not_exist.bin", "required_extension_unknown": "VENDOR_future"}
    assert word.get(Path(name).stem, "found") in str(error.value)


@pytest.mark.skipif("assets/quirks_transforms.glb" not in FACTS, reason="the file is not there")
def test_lamps_of_the_mirrored_scene_face_down():
    scene = dl.load(FOLDER / "assets/quirks_transforms.glb")
    for name in ("lamp", "lamp_mirrored"):
        mesh = scene.mesh(name)
        a, b, c = (mesh.world_vertices[mesh.triangles[:, i]] for i in range(3))
        normal = np.cross(b - a, c - a)
        assert (normal[:, 1] < -0.1).all()


@pytest.mark.skipif("assets/CornellBox_quantized.glb" not in FACTS, reason="the file is not there")
def test_quantised_and_plain_box_agree():
    plain, quantised = (
        dl.load(FOLDER / f"assets/{name}.glb").info() for name in ("CornellBox", "CornellBox_quantized")
    )
    assert quantised["area"] == pytest.approx(plain["area"], rel=1e-4)


@pytest.mark.skipif("atrium_standin.glb" not in FACTS, reason="the file is not there")
def test_the_trolley_is_one_movable_with_its_load():
    scene = dl.load(FOLDER / "atrium_standin.glb")
    trolley = scene.mesh("MOVE_trolley")
    assert len(trolley.material) > 1
    assert len([n for n in scene.nodes if n.parts and n.parts[0][0] == "MOVE_trolley"]) == 8
    np.testing.assert_array_equal(trolley.pose[:3, 3], (-6, 0, 0))
