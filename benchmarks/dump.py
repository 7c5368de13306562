# SPDX-License-Identifier: Apache-2.0
"""Writes a scene and samples for the C++ benchmark programs (see scene_dump.h)."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import deltalux as dl
import numpy as np


def _array(file: BinaryIO, values: object, dtype: type) -> None:
    flat = np.ascontiguousarray(values, dtype).ravel()
    np.array([flat.size], np.uint64).tofile(file)
    flat.tofile(file)


def write_dump(path: Path, scene: dl.Scene, samples: dl.Samples) -> None:
    """Write `scene` and `samples`; lights other than emissive surfaces are left out."""
    material = {m.name: i for i, m in enumerate(scene.materials)}
    ordered = sorted(scene.meshes, key=lambda m: m.movable)
    number = {m.name: i for i, m in enumerate(ordered)}
    with path.open("wb") as file:
        _array(file, [m.reflectance for m in scene.materials], np.float32)
        _array(file, [m.emission for m in scene.materials], np.float32)
        _array(file, [len(ordered)], np.uint32)
        for mesh in ordered:
            _array(file, mesh.vertices, np.float32)
            _array(file, mesh.triangles, np.uint32)
            _array(file, np.array([material[n] for n in mesh.material])[mesh.material_index], np.uint32)
            _array(file, [int(mesh.movable)], np.uint32)
            _array(file, mesh.pose[:3], np.float64)
        _array(file, samples.points, np.float32)
        _array(file, samples.normals, np.float32)
        _array(file, samples.radius, np.float32)
        attached = [0xFFFFFFFF if name is None else number[name] for name in samples.attached]
        _array(file, attached, np.uint32)
