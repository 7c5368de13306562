# SPDX-License-Identifier: Apache-2.0
"""Fuzz target: the reader of glTF and GLB files, and the scenes that it accepts."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import deltalux as dl
import numpy as np
from deltalux.outputs import write
from deltalux.outputs.of_session import baked_of

from fuzz.harness import Limits
from fuzz.mutate_gltf import MAX_SEED_BYTES, mutated, own_seeds, read_seeds
from fuzz.mutate_json import Rng, pick


class GltfTarget:
    """Loads mutated files."""

    name = "gltf"
    limits = Limits()

    def prepare(self, seeds: Path, scenes: Path | None) -> None:
        """Files of our own, one that a bake wrote, small ones of a folder."""
        for number, data in enumerate(own_seeds()):
            (seeds / f"own{number}.glb").write_bytes(data)
        scene = dl.scenes.cornell_box()
        with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=1.0), paths=300, threads=1) as session:
            session.bake()
            write(seeds / "baked.glb", baked_of(session, "fuzz"))
        for number, path in enumerate(sorted(scenes.rglob("*.glb")) if scenes else ()):
            if path.stat().st_size <= MAX_SEED_BYTES:
                shutil.copy(path, seeds / f"more{number}.glb")

    def load(self, seeds: Path) -> None:
        """Keep them in memory."""
        self._seeds = read_seeds(seeds)

    def make(self, rng: Rng, folder: Path) -> None:
        """One file and its options."""
        options = {
            "movable": ["MOVE_cart"] if rng.random() < 0.1 else [],
            "light_units": pick(rng, ["spec", "blender-watts", "unitless"]),
        }
        (folder / "scene.glb").write_bytes(mutated(rng, self._seeds))
        (folder / "case.json").write_text(json.dumps(options))

    def run(self, folder: Path) -> None:
        """Load it."""
        check_scene(dl.load(folder / "scene.glb", **json.loads((folder / "case.json").read_text())))


def check_scene(scene: dl.Scene) -> None:
    """Raise AssertionError where an accepted scene is not sound."""
    json.dumps(scene.info(), allow_nan=False)
    for mesh in scene.meshes:
        assert np.isfinite(mesh.world_vertices).all()
        assert mesh.coordinates is None or not np.isinf(mesh.coordinates).any()
        assert len(mesh.triangles) == 0 or mesh.triangles.max() < len(mesh.vertices)
    for node in scene.nodes:
        assert np.isfinite(node.matrix).all()
        assert node.parent < len(scene.nodes)
    for material in scene.materials:
        assert np.isfinite(material.reflectance).all()
        assert np.isfinite(material.emission).all()
    for camera in scene.cameras:
        numbers = (camera.vertical_fov, camera.height, camera.aspect, camera.near, camera.far)
        assert np.isfinite(camera.pose).all()
        assert all(value is None or np.isfinite(value) for value in numbers)
    for text in (*scene.warnings, *(m.name for m in scene.meshes)):
        text.encode("utf-8")
