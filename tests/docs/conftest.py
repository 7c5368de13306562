# SPDX-License-Identifier: Apache-2.0
"""Few paths, rays, triangles and samples, so that what documents and examples do takes little time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import deltalux as dl
import pytest
from builders.gltf import GltfBuilder
from deltalux import session_options
from deltalux.samples import samples
from deltalux.scene import replace_scene

HALF_TURN_UP = [-(0.5**0.5), 0, 0, 0.5**0.5]  # turns +Z, where builder quads look, to +Y
FEW = 20  # triangles of a mesh
COARSE = 2.0  # metres


def thinned(mesh: dl.Mesh) -> dl.Mesh:
    every = -(-len(mesh.triangles) // FEW)
    index = mesh.material_index[::every]
    return replace(mesh, triangles=mesh.triangles[::every], material_index=index)


@pytest.fixture
def less_light(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Few paths, rays, triangles and samples; the reader's room.glb, which has a chair."""
    office = dl.scenes.office()
    few = replace_scene(office, meshes=[thinned(mesh) for mesh in office.meshes])
    assert few.groups == office.groups
    monkeypatch.setattr(dl.scenes, "office", lambda: few)
    monkeypatch.setattr(session_options, "default_paths", lambda gather: 2000)
    monkeypatch.setattr(session_options, "RAYS", {16: 1 << 30})
    refine = samples.refine
    monkeypatch.setattr(
        samples, "refine", lambda scene, spacing, **options: refine(scene, spacing or COARSE, **options)
    )
    monkeypatch.setattr("webbrowser.open", lambda url: True)
    monkeypatch.chdir(tmp_path)
    builder = GltfBuilder()
    grey = builder.material(name="grey", colour=(0.5, 0.5, 0.5))
    floor = {"rotation": HALF_TURN_UP, "translation": [0, 0, 4], "scale": [5, 5, 5]}
    builder.node(name="floor", mesh=builder.quad(grey), **floor)
    builder.node(name="chair", mesh=builder.quad(grey), rotation=HALF_TURN_UP, translation=[1, 0.5, 2])
    lamp = builder.light(name="lamp", type="point", intensity=400.0)
    builder.node(name="lamp", translation=[2, 2, 2], extensions=lamp)
    builder.write(tmp_path, "room.glb")
