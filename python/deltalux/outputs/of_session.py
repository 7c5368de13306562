# SPDX-License-Identifier: Apache-2.0
"""What the writers need of a session in its present state."""

from __future__ import annotations

from dataclasses import replace

from deltalux.scene import Scene, replace_scene
from deltalux.session import Session

from .baked import Baked


def present_scene(session: Session) -> Scene:
    """The session's scene with the reflectances that it has now."""
    present = session.reflectances
    materials = [replace(m, reflectance=present[m.name]) for m in session.scene.materials]
    return replace_scene(session.scene, materials=materials)


def baked_of(session: Session, command: str, false_colour: bool = False) -> Baked:
    """The session's results with its scene as it is now.

    Parameters
    ----------
    session : baked
    command : what made the result, which names it
    false_colour : pictures show irradiance instead of the lit scene
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
