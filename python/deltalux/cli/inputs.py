# SPDX-License-Identifier: Apache-2.0
"""Converts the arguments SCENE and SESSION of a command line to objects."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import deltalux as dl
from deltalux.io import LITERAL, MISSING_REFLECTANCE
from deltalux.solid_places import open_place
from deltalux.stored.facts import edited_scene

from .options import SESSION, Lamp, Sun

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
    lamp: Sequence[Lamp] | None = None,
    sun: Sun | None = None,
    light_units: str = "spec",
    unit: str | float | None = None,
    up: str = "y",
    groups: str = "auto",
    glass: str = LITERAL,
    reflectance: float = MISSING_REFLECTANCE,
) -> dl.Scene:
    """Load a scene file, take that of a session file as it was edited, or build a bundled scene.

    Parameters
    ----------
    word : path of a file, or the name of a bundled scene
    movable : names of nodes to make movable, in addition to those that the file marks
    lamp, sun : lights to add
    light_units, unit, up, groups, glass, reflectance : see `deltalux.load`; for files only

    Raises
    ------
    FormatError : there is no such file, or it is no scene
    SceneError, OptionError : see `deltalux.load`
    """
    name = word.replace("-", "_")
    if name in BUNDLED_SCENES:
        scene = _with_movable(getattr(dl.scenes, name)(), movable)
    elif Path(word).suffix.lower() == SESSION:
        given = (light_units, unit, up, groups, glass, reflectance)
        if given != ("spec", None, "y", "auto", LITERAL, MISSING_REFLECTANCE):
            raise dl.OptionError(
                f"{word}: the scene of a session has been read; leave out --light-units, --unit, --up, "
                "--groups, --glass and --reflectance"
            )
        scene = _with_movable(edited_scene(word), movable)
    else:
        scene = _load(
            word,
            movable=list(movable or ()),
            light_units=light_units,
            unit=unit,
            up=up,
            groups=groups,
            glass=glass,
            reflectance=reflectance,
        )
    for added in lamp or ():
        place = open_place(scene) if added.place is None else added.place
        scene = dl.scene.with_lamp(scene, place, added.power)
    if sun is not None:
        scene = dl.scene.with_sun(scene, sun.azimuth, sun.elevation, sun.irradiance)
    return scene


def _with_movable(scene: dl.Scene, names: Sequence[str] | None) -> dl.Scene:
    return dl.scene.make_movable(scene, names) if names else scene


def _load(word: str, **reading: Any) -> dl.Scene:
    path = Path(word)
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        close = difflib.get_close_matches(word.replace("-", "_"), BUNDLED_SCENES, n=1)
        hint = f"did you mean {close[0]}?" if close else f"or one of {', '.join(BUNDLED_SCENES)}"
        raise dl.FormatError(f"scene '{word}': found {found}, expected a .glb, .gltf or .obj file; {hint}")
    return dl.load(path, **reading)
