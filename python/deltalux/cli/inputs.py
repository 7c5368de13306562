# SPDX-License-Identifier: Apache-2.0
"""Converts the arguments SCENE and SESSION of a command line to objects."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path

import deltalux as dl

BUNDLED_SCENES = ("atrium", "expo", "office", "cornell_box")


def foreign_light(session: dl.Session, name: str) -> list[str]:
    """Why the light of an opened session must be recomputed before an edit: one sentence, or none.

    Parameters
    ----------
    session : session opened from a file
    name : name of the file
    """
    if session.foreign_build is None:
        return []
    return [
        f"{name}: its light was computed by another build or processor ({session.foreign_build}), whose bits "
        "may differ; everything is computed again before the first edit"
    ]


def open_scene(
    word: str,
    movable: Sequence[str] | None = None,
    light_units: str = "spec",
    unit: str | float | None = None,
    up: str = "y",
    groups: str = "auto",
) -> dl.Scene:
    """Load a scene file or build a bundled scene.

    Parameters
    ----------
    word : path of a file, or the name of a bundled scene
    movable : names of nodes to make movable, in addition to those that the file marks
    light_units, unit, up, groups : see `deltalux.load`; for files only

    Raises
    ------
    FormatError : there is no such file, or it is no scene
    SceneError, OptionError : see `deltalux.load`
    """
    name = word.replace("-", "_")
    if name in BUNDLED_SCENES:
        scene = getattr(dl.scenes, name)()
        return dl.scene.make_movable(scene, movable) if movable else scene
    path = Path(word)
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        close = difflib.get_close_matches(name, BUNDLED_SCENES, n=1)
        hint = f"did you mean {close[0]}?" if close else f"or one of {', '.join(BUNDLED_SCENES)}"
        raise dl.FormatError(f"scene '{word}': found {found}, expected a .glb, .gltf or .obj file; {hint}")
    return dl.load(
        path, movable=list(movable or ()), light_units=light_units, unit=unit, up=up, groups=groups
    )
