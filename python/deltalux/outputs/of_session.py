# SPDX-License-Identifier: Apache-2.0
"""Input of the writers from a session's present state."""

from __future__ import annotations

from dataclasses import replace

from deltalux.scene import Scene, replace_scene
from deltalux.session import Session

from .baked import Baked


def present_scene(session: Session) -> Scene:
    """The session's scene with its present reflectances."""
    present = session.reflectances
    materials = [replace(m, reflectance=present[m.name]) for m in session.scene.materials]
    return replace_scene(session.scene, materials=materials)


def baked_of(session: Session, command: str, false_colour: bool = False) -> Baked:
    """The session's results with its scene in the present state.

    Parameters
    ----------
    session : baked
    command : the command that made the result, kept in its metadata
    false_colour : whether pictures show irradiance instead of the lit scene
    """
    result = session.result
    return Baked(
        replace(result, about={"command": command, **result.about}),
        present_scene(session),
        session.samples.display,
        poses=session.poses,
        beyond=session.direct_beyond_samples(),
        grid=session.samples if session.samples.grid_shape else None,
        false_colour=false_colour,
        threads=session.options["threads"] or 0,
    )
