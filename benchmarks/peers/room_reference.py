# SPDX-License-Identifier: Apache-2.0
"""The rooms that judge what light does beside things: their moves, their points, stored references."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import judging_rooms
import near_rooms
import numpy as np
from deltalux.scene import Scene, replace_scene
from numpy.typing import NDArray
from oracles import office_reference, world

MAKE = "benchmarks/peers/make_rooms.py"
COUNTS = {"static": 1200, "small": 300, "near": 300, "receivers": 200, "dark": 200}
SEED = 11
Points = tuple[NDArray, NDArray]


@dataclass(frozen=True)
class Move:
    """An edit of the room as loaded: metres, and degrees about the object's own +y."""

    mesh: str
    translation: tuple[float, float, float]
    degrees: float = 0.0


@dataclass(frozen=True)
class Room:
    """A room, what moves in it, and how densely its reference is sampled.

    `near`: metres from the object, before or after; `offset`: metres from points to their surface;
    `buried`: nothing within so many metres: a point counts; `samples`, `passes`: paths a point and
    pass, independent passes; `still_samples`: those of light that is no change, 0: `samples`;
    `dark_beyond`: x from which no lamp is seen.
    """

    name: str
    scene: Callable[[], Scene]
    moves: tuple[Move, ...]
    near: float
    samples: int
    passes: int = 16
    still_samples: int = 0
    offset: float = 1e-4
    buried: float = 0.02
    dark_beyond: float | None = None

    @property
    def path(self) -> Path:
        return Path(__file__).parent / f"reference_{self.name}.npz"

    def key(self, scene: Scene) -> str:
        """Digest of the scene and of the settings."""
        settings = asdict(self) | {"scene": world.scene_hash(scene), "counts": COUNTS, "seed": SEED}
        return hashlib.sha256(json.dumps(settings, sort_keys=True, default=str).encode()).hexdigest()[:16]

    def after(self, scene: Scene, move: Move) -> Scene:
        return world.moved(scene, move.mesh, move.translation, move.degrees)

    def load(self, scene: Scene) -> dict[str, NDArray]:
        """The stored arrays in double precision; `office_reference.Stale` where there are none of this room.

        `NAME_points`, `NAME_normals` (n, 3), `NAME` (n, 3) irradiance in lux, `NAME_error` its
        standard error, for NAME in static, small; `near_I` and `receivers`: the change by the I-th
        move, and light on the object after the first one; `near_free` (moves, n) share of rays that
        meet nothing near by, before or after; `dark_points`, `dark_normals`.
        """
        stored = office_reference.load_file(self.path, self.key(scene), ["near_free"], MAKE)
        return {n: a.astype(np.float64) if a.dtype.kind == "f" else a for n, a in stored.items()}


ROOMS = {
    room.name: room
    for room in (
        Room(
            "spots",
            near_rooms.spots,
            (
                Move("cube", (0.45, 0, -0.2), 20),
                Move("cube", (-0.9, 0, 0.2), -30),
                Move("chair", (-0.3, 0, -0.1), 25),
            ),
            near=0.6,
            samples=784,
        ),
        Room(
            "contacts",
            near_rooms.contacts,
            (
                Move("armchair", (-0.1, 0, -0.7), 40),
                Move("small_box", (0.35, 0, 0.3), 30),
                Move("chair", (0.2, 0, 0.5), -35),
                Move("desk_lamp", (0.5, 0, -0.05), 60),
            ),
            near=0.6,
            samples=484,
            still_samples=900,
            dark_beyond=near_rooms.PARTITION,
        ),
        Room(
            "little_box",
            judging_rooms.little_box,
            (
                Move("seat", (-0.14, 0, -0.03), 40),
                Move("plate", (-0.12, 0, 0.04), 25),
                Move("seat", (0.1, 0, 0.02), -60),
            ),
            near=0.1,
            samples=400,
            offset=2e-5,
            buried=0.02 / 6,
        ),
        Room(
            "hall",
            judging_rooms.hall,
            (
                Move("crates", (-2.0, 0, 1.2), 50),
                Move("bench", (1.6, 0, -1.0), 35),
                Move("crates", (1.5, 0, 3.0), -20),
            ),
            near=1.5,
            samples=484,
        ),
        Room(
            "shop",
            judging_rooms.shop,
            (
                Move("parcel", (0.45, 0, 0.2), 35),
                Move("stool", (0.15, 0, -0.5), -40),
                Move("till", (-0.05, 0, -0.35), 30),
            ),
            near=0.6,
            samples=784,
        ),
    )
}


def still(scene: Scene) -> Scene:
    return replace_scene(scene, meshes=[mesh for mesh in scene.meshes if not mesh.movable])


def static_points(room: Room, scene: Scene, count: int) -> Points:
    """Uniform over the area of what does not move, where there are lamps."""
    points, normals = world.area_points(scene, count, SEED, offset=room.offset)
    return _taken(points, normals, _lit(room, points))


def small_points(room: Room, scene: Scene, count: int) -> Points:
    """Uniform over the area of the small objects."""
    corners = np.concatenate(
        [p.corners for p in world.parts(scene) if p.mesh.startswith("small_") and not p.movable]
    )
    return world.points_on(corners, count, np.random.default_rng(SEED + 1), room.offset)


def near_points(room: Room, scene: Scene, index: int, count: int) -> Points:
    """On what does not move, near the object before or after its `index`-th move."""
    move, rng = room.moves[index], np.random.default_rng(SEED)
    places = [
        world.points_on(part.corners, 4000, rng, offset=0)[0]
        for state in (scene, room.after(scene, move))
        for part in world.parts(state)
        if part.mesh == move.mesh
    ]
    found = world.area_points(
        scene, count, SEED + 2 + index, offset=room.offset, near=np.concatenate(places), within=room.near
    )
    return _taken(*found, _lit(room, found[0]))


def receivers(room: Room, scene: Scene, count: int) -> Points:
    """On the object of the first move, in its new pose."""
    state = room.after(scene, room.moves[0])
    corners = np.concatenate([p.corners for p in world.parts(state) if p.mesh == room.moves[0].mesh])
    return world.points_on(corners, count, np.random.default_rng(SEED + 7), room.offset)


def dark_points(room: Room, scene: Scene, count: int) -> Points:
    """Behind the one-polygon wall: half on its back, half on what it stands on, up to 0.3 m from it."""
    assert room.dark_beyond is not None
    wall = np.concatenate([part.corners for part in world.parts(scene) if part.mesh == "partition"])
    half = count // 2
    back = world.points_on(wall[:, ::-1], half, np.random.default_rng(SEED + 8), room.offset)
    points, normals = world.area_points(scene, 60 * count, SEED + 9, offset=room.offset)
    beside = (points[:, 0] > room.dark_beyond + 2 * room.offset) & (points[:, 0] < room.dark_beyond + 0.3)
    found = _taken(points, normals, beside)
    return np.concatenate([back[0], found[0][:half]]), np.concatenate([back[1], found[1][:half]])


def _lit(room: Room, points: NDArray) -> NDArray:
    return np.full(len(points), True) if room.dark_beyond is None else points[:, 0] < room.dark_beyond


def _taken(points: NDArray, normals: NDArray, kept: NDArray) -> Points:
    return points[kept], normals[kept]
