# SPDX-License-Identifier: Apache-2.0
"""Lit .glb files pass Khronos' validator: a node tree, lights, cameras, textures and transparency in one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import png
from deltalux import outputs
from deltalux.scene import Camera, replace_scene
from deltalux.scene.look import Look, Texture
from test_outputs import baked, tree_scene
from written_results import shift

VALIDATE = """
const {validateBytes} = require('gltf-validator'), {readFileSync} = require('fs');
validateBytes(new Uint8Array(readFileSync(process.argv[1]))).then(
  report => process.stdout.write(JSON.stringify(report.issues)));
"""


PLACE = Path(sys.prefix) / "node" / "node_modules"  # where `make test` puts it


@pytest.mark.skipif(
    not PLACE.is_dir(), reason="Khronos' gltf-validator is not there; `make test` installs it"
)
def test_glb_passes_the_official_validator(tmp_path: Path):
    cameras = [
        Camera("eye", shift(0, 1, 2), near=0.1, far=9, aspect=1.5),
        Camera("plan", shift(0, 1, 2), height=4),
    ]
    lights = [dl.SpotLight("spot", (0, 2, 0), (0, -1, 0))]
    scene = replace_scene(tree_scene(), lights=lights, cameras=cameras)
    image = png(np.arange(48, dtype=np.uint8).reshape(4, 4, 3))
    picture = Texture(image, (0.01, 0.01, 0.01), wrap=(33071, 33648), rotation=0.5, mag_filter=9728)
    grey, lamp = scene.materials
    looks = [
        Look(picture, None, "MASK", 0.5, 0.2),
        Look(None, replace(picture, mag_filter=None), "BLEND", 0.5),
    ]
    meshes = [
        replace(m, coordinates=np.random.default_rng(1).uniform(-2, 2, (len(m.triangles), 3, 2)))
        for m in scene.meshes
    ]
    materials = [replace(grey, look=looks[0]), replace(lamp, look=looks[1])]
    scene = replace_scene(scene, materials=materials, meshes=meshes)
    outputs.write(tmp_path / "a.glb", baked(scene, poses={"cart": shift(1, 2, 3)}))
    command = [Path(sys.prefix) / "bin" / "node", "-e", VALIDATE, tmp_path / "a.glb"]
    done = subprocess.run(
        command, capture_output=True, check=True, env={**os.environ, "NODE_PATH": str(PLACE)}
    )
    issues = json.loads(done.stdout)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
