# SPDX-License-Identifier: Apache-2.0
"""Fuzz target: the reader of OBJ files with their MTL."""

from __future__ import annotations

import json
from pathlib import Path

import deltalux as dl
from builders.obj import mtl_text, obj_text
from rooms import room

from fuzz.gltf_target import check_scene
from fuzz.harness import Limits
from fuzz.mutate_json import Rng, pick
from fuzz.mutate_text import mutated_text

MAX_SEED_BYTES = 100_000
POLYGONS = """# polygons, groups, negative indexes, a texture that is not there
mtllib scene.mtl
g first
v 0 0 0 0.5 0.5 0.5
v 1 0 0
v 1 1 0
v 0.5 1.5 0
v 0 1 0
vt 0 0
vn 0 0 1
usemtl paper
f 1/1/1 2/1/1 3/1/1 4/1/1 5/1/1
g MOVE_second
s 1
usemtl glow
f -5//1 -3//1 \\
  -2//1
"""
MATERIALS = """newmtl paper
Kd 0.7
map_Kd -s 1 1 1 -o 0.5 0.5 -clamp on paper.png
d 0.5
newmtl glow
Kd 0 0 0
Ke 10 10 10
illum 2
"""


class ObjTarget:
    """Loads mutated OBJ files, or good ones with a mutated MTL."""

    name = "obj"
    limits = Limits()

    def prepare(self, seeds: Path, scenes: Path | None) -> None:
        """A file by hand, two scenes of our own, small ones of a folder."""
        pairs = [(POLYGONS, MATERIALS)]
        pairs += [(obj_text(scene), mtl_text(scene)) for scene in (dl.scenes.cornell_box(), room())]
        for path in sorted(scenes.rglob("*.obj")) if scenes else ():
            library = path.with_suffix(".mtl")
            if path.stat().st_size <= MAX_SEED_BYTES:
                text = library.read_text(errors="replace") if library.is_file() else MATERIALS
                pairs.append((path.read_text(errors="replace"), text))
        (seeds / "pairs.json").write_text(json.dumps(pairs))

    def load(self, seeds: Path) -> None:
        """Keep them in memory."""
        self._pairs = json.loads((seeds / "pairs.json").read_text())

    def make(self, rng: Rng, folder: Path) -> None:
        """A pair of files."""
        obj, mtl = pick(rng, self._pairs)
        which = rng.random()
        data = obj.encode() if which < 0.3 else mutated_text(rng, obj)
        (folder / "scene.obj").write_bytes(data)
        (folder / "scene.mtl").write_bytes(mutated_text(rng, mtl) if which < 0.4 else mtl.encode())
        movable = ["block"] if rng.random() < 0.1 else []
        (folder / "case.json").write_text(json.dumps({"movable": movable}))

    def run(self, folder: Path) -> None:
        """Load them."""
        check_scene(dl.load(folder / "scene.obj", **json.loads((folder / "case.json").read_text())))
