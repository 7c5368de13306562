# SPDX-License-Identifier: Apache-2.0
"""The editable state of a session as a flat mapping, and edits that bring a session to such a state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from deltalux.errors import OptionError
from deltalux.session import Session

Kind = Literal["pose", "present", "factor", "reflectance"]
Key = tuple[Kind, str]
# Poses are 16 numbers, column-major. All values, and therefore states, can be compared by ==.
Value = tuple[float, ...] | bool | float
EditState = Mapping[Key, Value]


def state_of(session: Session) -> dict[Key, Value]:
    """Poses, presence, factors and reflectances of `session`, including queued edits."""
    state: dict[Key, Value] = {}
    for name, pose in session.poses.items():
        state["pose", name] = pose_numbers(session.pose(name))
        state["present", name] = pose is not None
    for group, factor in session.dim_factors.items():
        state["factor", group] = factor
    for material, reflectance in session.reflectances.items():
        state["reflectance", material] = reflectance
    return state


def queue_edit(session: Session, key: Key, value: Value) -> None:
    """Queue the edit that sets `key` to `value`.

    Raises
    ------
    OptionError
        If the session refuses the edit.
    """
    kind, name = key
    if kind == "pose":
        session.move(name, pose_matrix(value))
    elif kind == "present":
        (session.add if value else session.remove)(name)
    elif kind == "factor":
        session.dim(name, float(value))  # type: ignore[arg-type]
    else:
        session.set_reflectance(name, value)


def differences(session: Session, wanted: EditState) -> dict[Key, Value]:
    """The entries of `wanted` in which the session differs."""
    present = state_of(session)
    return {key: value for key, value in wanted.items() if present[key] != value}


def pose_numbers(pose: np.ndarray) -> tuple[float, ...]:
    """A 4x4 pose as 16 numbers, column by column."""
    return tuple(np.asarray(pose, np.float64).T.ravel().tolist())


def pose_matrix(numbers: object) -> np.ndarray:
    """The 4x4 pose that `pose_numbers` flattened."""
    return np.array(numbers, np.float64).reshape(4, 4).T


class Reach:
    """Checks whether the session can have objects where they are to be moved, without using the session.

    The session executes one call at a time, but a pose must be accepted or refused while it works.
    """

    def __init__(self, session: Session) -> None:
        self._origin = session.origin
        self._refusal = session.reach()
        self._points = {name: _points_of(session, name) for name in session.poses}

    def check(self, name: str, pose: np.ndarray) -> None:
        """Raise OptionError if the session refuses to move the object `name` to `pose`."""
        points = self._points[name] @ pose[:3, :3].T + pose[:3, 3] - self._origin
        if len(points) and (refusal := self._refusal(points.min(axis=0), points.max(axis=0))):
            raise OptionError(f'move "{name}": it {refusal}')


def _points_of(session: Session, name: str) -> np.ndarray:
    """Vertices of a movable, positions of its lights, and its samples, local."""
    lights = [light.position for light in session.scene.lights
              if light.attached_to == name and hasattr(light, "position")]  # fmt: skip
    samples = session.samples.points[session.samples.attached == name]
    rows = [session.scene.mesh(name).vertices, *(np.reshape(own, (-1, 3)) for own in (lights, samples))]
    return np.concatenate(rows)
