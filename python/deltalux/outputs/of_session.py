# SPDX-License-Identifier: Apache-2.0
"""Input of the writers from a session's present state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.scene import Scene
from deltalux.scene.editing import dimmed, repainted
from deltalux.session import Session

from .baked import Baked


def present_scene(session: Session) -> Scene:
    """The session's scene with its present reflectances, and its lights as they are dimmed."""
    return dimmed(repainted(session.scene, session.reflectances), session.dim_factors)


def present_display(display: DisplayMesh, loaded: Scene, present: Scene) -> DisplayMesh:
    """The display mesh of the scene as loaded, with the materials of the present one."""
    number = {m.name: i for i, m in enumerate(present.materials)}
    material = display.triangle_material.copy()
    first = np.searchsorted(display.triangle_mesh, np.arange(len(loaded.meshes) + 1))
    for mesh, (before, now) in enumerate(zip(loaded.meshes, present.meshes, strict=True)):
        own = slice(first[mesh], first[mesh + 1])
        for old, new in zip(before.material, now.material, strict=True):
            if old != new:
                material[own][display.triangle_material[own] == number[old]] = number[new]
    material.setflags(write=False)
    return replace(display, triangle_material=material)


def baked_of(session: Session, command: str, false_colour: bool = False) -> Baked:
    """The session's results with its scene in the present state.

    Parameters
    ----------
    session : baked
    command : the command that made the result, kept in its metadata
    false_colour : whether pictures show irradiance instead of the lit scene
    """
    result, display, scene = session.result, session.samples.display, present_scene(session)
    return Baked(
        replace(result, about={"command": command, **result.about}),
        scene,
        None if display is None else present_display(display, session.scene, scene),
        poses=session.poses,
        beyond=session.direct_beyond_samples(),
        grid=session.samples if session.samples.grid_shape else None,
        false_colour=false_colour,
        threads=session.options["threads"] or 0,
    )
