# SPDX-License-Identifier: Apache-2.0
"""The core's session: converts scene, samples and options to the core's input, and edits' arguments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from . import _core
from .errors import OptionError
from .estimate.inputs import check_choice
from .samples import Samples
from .scene import Mesh, Scene
from .scene.flatten import FlatScene
from .scene.frame import SLACK, is_lost, place_slack
from .segments import check_integer
from .session_options import RAY_COUNTS, core_options
from .units import FARTHEST

LIGHT_PARTS = ("all", "direct", "indirect")
AT_REST = 0xFFFFFFFF  # object number of samples that belong to no movable


def description() -> str:
    """What the bits of results depend on: Embree, instruction set, build, and how the machine reckons."""
    return _core.description()


def check_asked(part: str, rays: int | None, gather: str | int) -> None:
    """Check the options of `Session.at`.

    Raises
    ------
    OptionError
    """
    check_choice("part", part, LIGHT_PARTS)
    if rays is not None:
        check_integer("rays", rays, *RAY_COUNTS)
    if gather == "off" and (part != "all" or rays is not None):
        raise OptionError(
            'at: found part or rays in a session of gather="off", expected neither: discs know no parts'
        )


def movable_index(scene: Scene, flat: FlatScene, name: str) -> int:
    """Number of a movable in the core.

    Raises
    ------
    OptionError
        For an unknown or a static name.
    """
    if not scene.mesh(name).movable:
        raise OptionError(
            f'"{name}" is static, expected one of the movables {list(scene.movable)}; '
            "name it in `movable` when the scene is loaded"
        )
    return flat.objects[name]


def check_insertion(mesh: Mesh, flat: FlatScene) -> None:
    """Check that a session of `flat` can insert this mesh.

    Raises
    ------
    OptionError
        For a static mesh, a name that is taken, an unknown material, or a place so far away that single
        precision cannot represent the mesh's shape there.
    """
    if not mesh.movable:
        raise OptionError(f'add "{mesh.name}": found a static mesh, expected movable=True')
    if mesh.name in flat.objects:
        raise OptionError(f'add "{mesh.name}": the scene has a mesh of that name')
    for name in mesh.material:
        flat.scene.material(name)
    _check_shape(f'add "{mesh.name}"', mesh, flat, mesh.pose)


def core_pose(scene: Scene, flat: FlatScene, name: str, pose: np.ndarray) -> np.ndarray:
    """The pose of a movable in the core's coordinates.

    Raises
    ------
    OptionError
        For a pose so far from the scene's middle that single precision cannot represent the mesh's shape
        there.
    """
    _check_shape(f'move "{name}"', scene.mesh(name), flat, pose)
    return np.ascontiguousarray(flat.pose(name, pose))


def _check_shape(what: str, mesh: Mesh, flat: FlatScene, pose: np.ndarray) -> None:
    """Raise OptionError if single precision cannot represent the mesh's shape at `pose`."""
    slack, size = place_slack(mesh, pose, flat.origin)
    # beyond FARTHEST, the core raises the error
    if is_lost(slack, size, flat.radius) and slack / SLACK <= FARTHEST:
        raise OptionError(
            f"{what}: single precision holds places there to {slack:.2g} m, and it is {size:.2g} m "
            "large; move it nearer to the middle of the scene"
        )


def _core_points(flat: FlatScene, samples: Samples) -> np.ndarray:
    """(n, 3) float32: in the core's world space, or in the space of the movable of a sample."""
    begin = np.broadcast_to(flat.origin, samples.points.shape).copy()
    for name in {name for name in samples.attached if name is not None}:
        begin[samples.attached == name] = flat.local[name]
    return np.ascontiguousarray(samples.points - begin, np.float32)


def make_core_session(scene: Scene, flat: FlatScene, samples: Samples, options: Mapping[str, Any]) -> Any:
    """A session of the core, before its bake.

    Raises
    ------
    OptionError, SceneError
    """
    numbers = [AT_REST if name is None else movable_index(scene, flat, name) for name in samples.attached]
    return _core.Session(
        flat.core,
        points=_core_points(flat, samples),
        normals=np.ascontiguousarray(samples.normals, np.float32),
        radius=np.ascontiguousarray(samples.radius, np.float32),
        attached=np.array(numbers, np.uint32),
        options=core_options(options),
    )


class PresentState(NamedTuple):
    """What edits made of a session, by names."""

    poses: dict[str, np.ndarray]  # of all movables, 4x4
    removed: set[str]
    factors: dict[str, float]  # of light groups
    reflectances: np.ndarray  # (m, 3) float32, of the scene's materials


def present_state(core: Any, flat: FlatScene) -> PresentState:
    """The state of a session of the core that was restored from a file."""
    state = core.save_choices()
    rows = np.frombuffer(state["poses"], np.float64).reshape(-1, 4, 3)  # of a rotation, then the translation
    present = np.frombuffer(state["present"], np.uint8)
    factors = np.frombuffer(state["group_factor"], np.float64)
    poses = {}
    for name in flat.scene.movable:
        pose, number = np.eye(4), flat.objects[name]
        pose[:3, :3], pose[:3, 3] = rows[number, :3], rows[number, 3]
        poses[name] = flat.user_pose(name, pose)
    return PresentState(
        poses,
        {name for name, number in flat.objects.items() if not present[number]},
        {name: float(factors[number]) for name, number in flat.groups.items()},
        np.frombuffer(state["reflectance"], np.float32).reshape(-1, 3),
    )
