# SPDX-License-Identifier: Apache-2.0
"""Facts about a session file, read without restoring its light."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from deltalux.errors import FormatError
from deltalux.scene import Scene
from deltalux.scene.editing import with_edits
from deltalux.scene.flatten import flatten

from .archive import ArchiveReader
from .fields import Fields
from .samples import FIELDS as SAMPLE_FIELDS
from .scene import FIELDS as SCENE_FIELDS
from .scene import unpack_scene
from .snapshot import CORE, index_fields, made_by, reading, stored_options

# Parts of a file, by prefix of the entries' names; the first match counts.
PARTS = {
    "scene": ("deltalux.json", "meshes/", "looks/"),
    "samples": ("samples/", "display/", "sharing/"),
    "gather": (f"{CORE}gather.",),
    "direct light": (f"{CORE}direct.",),
    "paths": (f"{CORE}level",),
    "sums": (f"{CORE}sums",),
    "other": ("",),
}


def file_facts(path: str | Path) -> tuple[dict[str, Any], Scene]:
    """Facts of a session file, and its scene as it was loaded.

    Checks the scene, the edits and the sizes of all arrays, but not the light: only opening checks that.

    Returns
    -------
    dict with `made_by` (a line for each command that led to the file), `built_by` (the build that computed
    the light, or None), `baked`, `options`, `segments` (None without light), `samples` (`count`, `spacing`,
    `vertices` of the display mesh or None, `grid` or None), `edits` (`moved`: `offset` in metres and
    `degrees` of rotation by name, `removed`: names, `dimmed`: factors by group, `reflectances` by
    material) and `bytes` by part; the Scene

    Raises
    ------
    FormatError
        For a file that is missing, truncated, foreign or of another version.
    """
    path = Path(path)
    with reading(path) as archive:
        index = index_fields(archive)
        scene = unpack_scene(index.child("scene", SCENE_FIELDS), archive, path.parent)
        baked = index.boolean("baked")
        segments = int(_core_array(archive, "level_sizes", "<u8").sum()) if baked else None
        facts = {
            "made_by": list(made_by(index)),
            "built_by": index.text("built_by") if baked else None,
            "baked": baked,
            "options": stored_options(index),
            "segments": segments,
            "samples": _samples(index, archive),
            "edits": _edits(scene, index, archive),
            "bytes": _sizes(archive.sizes),
        }
    return facts, scene


def _core_array(archive: ArchiveReader, name: str, dtype: str) -> np.ndarray:
    data = archive.array(CORE + name, "|u1")
    if len(data) % np.dtype(dtype).itemsize:
        raise FormatError(f'"{CORE}{name}": found {len(data)} bytes, expected numbers of type {dtype}')
    return data.view(dtype)


def _samples(index: Fields, archive: ArchiveReader) -> dict[str, Any]:
    samples = index.child("samples", SAMPLE_FIELDS)
    shown = samples.optional_number("display_spacing") is not None
    return {
        "count": len(archive.array("samples/points", "<f8", columns=3)),
        "spacing": samples.optional_number("spacing"),
        "vertices": len(archive.array("display/points", "<f8", columns=3)) if shown else None,
        "grid": samples.any("grid_shape"),
    }


def _edits(scene: Scene, index: Fields, archive: ArchiveReader) -> dict[str, Any]:
    """Differences of the state from the scene as loaded."""
    poses, removed, factors, reflectances = _state(scene, index, archive)
    loaded = {mesh.name: mesh.pose for mesh in scene.meshes}
    return {
        "moved": {name: _motion(loaded[name], pose) for name, pose in poses.items()},
        "removed": removed,
        "dimmed": factors,
        "reflectances": {name: value.tolist() for name, value in reflectances.items()},
    }


def edited_scene(path: str | Path) -> Scene:
    """The scene of a session file as its edits have made it, see `with_edits`.

    Raises
    ------
    FormatError
        As `file_facts`.
    """
    path = Path(path)
    with reading(path) as archive:
        index = index_fields(archive)
        scene = unpack_scene(index.child("scene", SCENE_FIELDS), archive, path.parent)
        return with_edits(scene, *_state(scene, index, archive))


def _state(
    scene: Scene, index: Fields, archive: ArchiveReader
) -> tuple[dict[str, np.ndarray], list[str], dict[str, float], dict[str, np.ndarray]]:
    """What differs from the scene as loaded: poses, removed meshes, factors of groups, reflectances."""
    flat = flatten(scene, textured=False)
    poses = _core_array(archive, "poses", "<f8")
    present = _core_array(archive, "present", "|u1")
    factors = _core_array(archive, "group_factor", "<f8")
    if (len(poses), len(present)) != (12 * len(flat.objects), len(flat.objects)):
        raise FormatError("found state of another number of objects than the scene has")
    if len(factors) < len(flat.groups):
        raise FormatError("found state of fewer light groups than the scene has")
    rows = poses.reshape(-1, 4, 3)  # 3 rows of the rotation, then the translation
    moved = {}
    for mesh in scene.meshes:
        loaded, now = flat.pose(mesh.name, mesh.pose) if mesh.movable else None, np.eye(4)
        now[:3, :3], now[:3, 3] = rows[flat.objects[mesh.name], :3], rows[flat.objects[mesh.name], 3]
        if loaded is not None and not np.array_equal(now, loaded):
            moved[mesh.name] = flat.user_pose(mesh.name, now)
    given = index.numbers("reflectances", len(scene.materials), 3)
    return (
        moved,
        [mesh.name for mesh in scene.meshes if not present[flat.objects[mesh.name]]],
        {name: float(factors[i]) for name, i in flat.groups.items() if factors[i] != 1},
        {
            material.name: row
            for material, row in zip(scene.materials, given, strict=True)
            if not np.array_equal(row, material.reflectance)
        },
    )


def _motion(before: np.ndarray, after: np.ndarray) -> dict[str, Any]:
    turn = after[:3, :3] @ before[:3, :3].T
    skew = np.array((turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]))
    degrees = np.degrees(np.arctan2(np.linalg.norm(skew), np.trace(turn) - 1))
    return {"offset": (after[:3, 3] - before[:3, 3]).tolist(), "degrees": float(degrees)}


def _sizes(entries: Mapping[str, int]) -> dict[str, int]:
    sizes = dict.fromkeys(PARTS, 0)
    for name, size in entries.items():
        part = next(part for part, starts in PARTS.items() if name.startswith(starts))
        sizes[part] += size
    return sizes
