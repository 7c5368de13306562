# SPDX-License-Identifier: Apache-2.0
"""What the server knows of a session without asking it, which works meanwhile: names, reach, lamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux.scene import Scene
from deltalux.server.edits import EditState, Key, Reach, Value, state_of
from deltalux.server.protocol.messages import Names
from deltalux.session import Session


@dataclass(frozen=True, eq=False)
class Known:
    """Facts that only another version of the scene changes, and the state at that time."""

    scene: Scene
    box: np.ndarray
    names: Names
    reach: Reach
    state: dict[Key, Value]
    lamps: frozenset[tuple[str, str | None]]  # group, and the movable that carries it, of all that shine

    def is_dark(self, state: EditState) -> bool:
        """Whether no lamp shines in this state."""
        return not any(
            state["factor", group] != 0 and (carrier is None or state["present", carrier])
            for group, carrier in self.lamps
        )


def known_of(session: Session) -> Known:
    """What is known of `session` now; nobody may use it meanwhile."""
    scene = session.scene
    fixed = [mesh.name for mesh in scene.meshes if not mesh.movable]
    names = Names(list(session.poses), list(session.dim_factors), list(session.reflectances), fixed)
    return Known(scene, session.box, names, Reach(session), state_of(session), _lamps_of(scene))


def _lamps_of(scene: Scene) -> frozenset[tuple[str, str | None]]:
    glowing = {material.name: material for material in scene.materials if material.emissive}
    surfaces = {
        (glowing[name].group or mesh.name, mesh.name if mesh.movable else None)
        for mesh in scene.meshes
        for name in (mesh.material[i] for i in np.unique(mesh.material_index))
        if name in glowing
    }
    lights = {
        (light.group or light.name, light.attached_to) for light in scene.lights if light.strength.any()
    }
    return frozenset(surfaces | lights)
