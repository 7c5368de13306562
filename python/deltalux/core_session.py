# SPDX-License-Identifier: Apache-2.0
"""The core's session: checks its options, and converts scene and samples to the core's input."""

from __future__ import annotations

from typing import Any, NamedTuple, TypedDict

import numpy as np

from . import _core
from .errors import OptionError
from .estimate.inputs import SEGMENT_ENDS, check_choice
from .memory import available_memory
from .samples import Samples
from .scene import Mesh, Scene
from .scene.flatten import FlatScene
from .scene.frame import is_lost, place_slack
from .segments import check_bounces, check_integer, check_paths, check_seed, check_threads

DIRECT_MODES = ("auto", "paths", "sampled")
LIGHT_PARTS = ("all", "direct", "indirect")
RAY_COUNTS = (8, 65536)  # bounds of the number of rays of a place
DISC_AREAS = ("reachable", "whole")
METHODS = ("auto", *_core.METHODS)
# Rays per sample with gather="auto": an entry applies if all samples together cast at most this many rays.
# More rays than 256, for few samples, cost no more time than 16,384 samples of 256 rays do. With fewer than
# 64 rays, light under narrow spots is far noisier than it should be.
RAYS = {1536: 1 << 22, 1024: 1 << 22, 512: 1 << 22, 256: 1 << 24, 128: 1 << 24, 64: 1 << 24}
AT_REST = 0xFFFFFFFF  # object number of samples that belong to no movable


class SessionOptions(TypedDict):
    """Options of a session, checked; a session file stores them."""

    paths: int
    seed: int
    threads: int | None
    segment_end: str
    disc_area: str
    direct: str
    static_method: str
    moving_method: str
    max_bounces: int
    memory_limit: int | None
    gather: str | int
    path_range: tuple[int, int] | None


def checked_options(options: SessionOptions) -> SessionOptions:
    """Check the options; counts become Python integers, which the session file's JSON can hold.

    Raises
    ------
    OptionError
    """
    check_choice("segment_end", options["segment_end"], SEGMENT_ENDS)
    check_choice("disc_area", options["disc_area"], DISC_AREAS)
    check_choice("direct", options["direct"], DIRECT_MODES)
    check_choice("static_method", options["static_method"], METHODS)
    check_choice("moving_method", options["moving_method"], METHODS)
    check_paths(options["paths"])
    check_seed(options["seed"])
    check_threads(options["threads"])
    check_bounces(options["max_bounces"])
    gather_rays(options["gather"])
    limit = options["memory_limit"]
    if limit is not None and not 0 < limit < 2**63:
        raise OptionError(f"memory_limit: found {limit}, expected bytes, or None for what is free")
    good = options.copy()
    good["paths"], good["seed"] = int(options["paths"]), int(options["seed"])
    good["path_range"] = _checked_range(options["path_range"], good["paths"])
    return good


def _checked_range(given: Any, paths: int) -> tuple[int, int] | None:
    """The range of paths; a list, as JSON has it, becomes a tuple.

    Raises
    ------
    OptionError
    """
    if given is None:
        return None
    pair = isinstance(given, tuple | list) and len(given) == 2
    whole = pair and all(isinstance(n, int | np.integer) and not isinstance(n, bool) for n in given)
    if not whole or not 0 <= given[0] <= given[1] <= paths:
        raise OptionError(
            f"path_range: found {given!r:.60}, expected (first, last) with 0 <= first <= last <= {paths}, "
            "the number of paths, or None for all of them"
        )
    return int(given[0]), int(given[1])


def resolved_gather(gather: str | int, samples: int, segment_end: str, disc_area: str) -> str | int:
    """The value that "auto" stands for; any other value unchanged."""
    if gather != "auto":
        return gather
    if (segment_end, disc_area) != ("first", "reachable"):
        return "off"
    fitting = (rays for rays, together in RAYS.items() if rays * samples <= together)
    return next(fitting, "off")


def default_paths(gather: str | int) -> int:
    """Default number of paths: discs need many, whereas the cells that rays read need fewer."""
    return 1_000_000 if gather == "off" else 300_000


def gather_rays(gather: str | int) -> int:
    """Rays of each sample; 0: all light is estimated by discs.

    Raises
    ------
    OptionError
    """
    if gather == "off":
        return 0
    check_integer("gather", gather, *RAY_COUNTS)
    return int(gather)


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
        For a static mesh, a name that is taken, an unknown material, or light of a new group.
    """
    if not mesh.movable:
        raise OptionError(f'add "{mesh.name}": found a static mesh, expected movable=True')
    if mesh.name in flat.objects:
        raise OptionError(f'add "{mesh.name}": the scene has a mesh of that name')
    for material in {flat.scene.material(name) for name in mesh.material}:
        if material.emissive and (material.group or mesh.name) not in flat.groups:
            raise OptionError(
                f'add "{mesh.name}": its light group "{material.group or mesh.name}" is new; give the '
                f"material one of the session's groups {list(flat.groups)}"
            )


def core_pose(scene: Scene, flat: FlatScene, box: np.ndarray, name: str, pose: np.ndarray) -> np.ndarray:
    """The pose of a movable in the core's coordinates.

    Raises
    ------
    OptionError
        For a pose within `box` (the core refuses poses beyond it) that is so far from the scene's
        middle that single precision cannot represent the mesh's shape there.
    """
    inside = bool(((box[0] <= pose[:3, 3]) & (pose[:3, 3] <= box[1])).all())
    slack, size = place_slack(scene.mesh(name), pose, flat.origin)
    if inside and is_lost(slack, size, flat.radius):
        raise OptionError(
            f'move "{name}": single precision holds places there to {slack:.2g} m, and it is {size:.2g} m '
            "large; move it nearer to the middle of the scene"
        )
    return np.ascontiguousarray(flat.pose(name, pose))


def _core_points(flat: FlatScene, samples: Samples) -> np.ndarray:
    """(n, 3) float32: in the core's world space, or in the space of the movable of a sample."""
    begin = np.broadcast_to(flat.origin, samples.points.shape).copy()
    for name in {name for name in samples.attached if name is not None}:
        begin[samples.attached == name] = flat.local[name]
    return np.ascontiguousarray(samples.points - begin, np.float32)


def make_core_session(scene: Scene, flat: FlatScene, samples: Samples, options: SessionOptions) -> Any:
    """A session of the core, before its bake.

    Raises
    ------
    OptionError, SceneError
    """
    numbers = [AT_REST if name is None else movable_index(scene, flat, name) for name in samples.attached]
    limit = options["memory_limit"]
    return _core.Session(
        flat.core,
        _core_points(flat, samples),
        np.ascontiguousarray(samples.normals, np.float32),
        np.ascontiguousarray(samples.radius, np.float32),
        np.array(numbers, np.uint32),
        options["paths"],
        options["seed"],
        options["threads"] or 0,
        options["segment_end"],
        options["disc_area"],
        options["direct"],
        options["static_method"],
        options["moving_method"],
        options["max_bounces"],
        available_memory() if limit is None else int(limit),
        gather_rays(options["gather"]),
        options["path_range"],
    )


class PresentState(NamedTuple):
    """What edits made of a session, by names."""

    poses: dict[str, np.ndarray]  # of all movables, 4x4
    removed: set[str]
    factors: dict[str, float]  # of light groups
    reflectances: np.ndarray  # (m, 3) float32, of the scene's materials


def present_state(core: Any, flat: FlatScene) -> PresentState:
    """The state of a session of the core that was restored from a file."""
    state = core.save()
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
