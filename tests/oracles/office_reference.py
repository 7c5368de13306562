# SPDX-License-Identifier: Apache-2.0
"""The office's reference irradiance: which points, which settings, and the stored answers.

`benchmarks/peers/make_reference.py` computes the file; tests and benchmarks load it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.session import Session
from numpy.typing import NDArray

from . import world
from .metrics import DARK

PATH = Path(__file__).parents[2] / "benchmarks" / "peers" / "reference_office.npz"
MAKE = "benchmarks/peers/make_reference.py"

MOVED = "chair"
TRANSLATION = (0.6, 0.0, 0.4)  # metres
NEAR = 0.6  # metres from the chair
FREE_DISTANCES = (0.02, 0.1)  # metres
OPEN_SHARE = 0.5  # of the cosine-distributed rays free for FREE_DISTANCES[0]: an open point
DISAGREE = 4, 0.02  # standard errors, and of the irradiance: renderers further apart contradict each other
SETTINGS: dict[str, Any] = {
    "points": 7000,
    "points_seed": 1,
    "near_points": 1000,
    "near_seed": 2,
    "mitsuba_samples": 16384,
    "near_samples": 32768,
    "mitsuba_passes": 32,
    "mitsuba_seed": 1000,
    "radiance_passes": 16,
    "radiance": {"ad": 64, "lw": 1e-2, "ds": 0.05},
    "moved": MOVED,
    "translation": TRANSLATION,
    "near": NEAR,
    "free_distances": FREE_DISTANCES,
}


class Stale(RuntimeError):
    """There is no reference for this scene and these settings."""


def key_of(scene: Scene) -> str:
    """Digest of the scene and of the settings: equal means that the reference is still right."""
    text = world.scene_hash(scene) + json.dumps(SETTINGS, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def reference_points(scene: Scene, count: int | None = None) -> tuple[NDArray, NDArray]:
    """Area-uniform points; a larger `count` than the reference's begins with the reference's."""
    return single(*world.area_points(scene, count or SETTINGS["points"], SETTINGS["points_seed"]))


def near_points(scene: Scene) -> tuple[NDArray, NDArray]:
    """Points of static surfaces within NEAR of the chair, where it stands or will stand."""
    rng = np.random.default_rng(0)
    chairs = [
        world.points_on(part.corners, 4000, rng, offset=0)[0]
        for state in (scene, moved(scene))
        for part in world.parts(state)
        if part.mesh == MOVED
    ]
    near = np.concatenate(chairs)
    found = world.area_points(scene, SETTINGS["near_points"], SETTINGS["near_seed"], near=near, within=NEAR)
    return single(*found)


def moved(scene: Scene) -> Scene:
    """The office after the chair's move."""
    return world.moved(scene, MOVED, TRANSLATION)


def load(scene: Scene, path: Path = PATH, needed: Iterable[str] = ()) -> dict[str, NDArray]:
    """The stored arrays; `Stale` where they are of another scene or those `needed` are missing.

    Returns
    -------
    dict with `points`, `normals` (n, 3); `mitsuba_before`, `mitsuba_after`, `radiance_before`,
    `radiance_after` (n, 3) irradiance in lux, each with `..._error`, its standard error;
    `near_points`, `near_normals` (m, 3), `near_before`, `near_change` (m, 3), with `..._error`;
    `free`, `near_free` (n, 2), (m, 2) share of rays that meet no static surface for FREE_DISTANCES.
    """
    return load_file(path, key_of(scene), needed, MAKE)


def load_file(path: Path, key: str, needed: Iterable[str], make: str) -> dict[str, NDArray]:
    """The arrays of a file that is for `key` and has those `needed`; `Stale` otherwise."""
    if not path.exists():
        raise Stale(f"{path}: not found; run {make}")
    with np.load(path) as data:
        arrays = {name: data[name] for name in data.files}
    if str(arrays["key"]) != key:
        raise Stale(
            f"{path}: found key {arrays['key']}, expected {key}: the scene or the settings changed; "
            f"run {make} again"
        )
    missing = sorted(set(needed) - arrays.keys())
    if missing:
        raise Stale(f"{path}: has no {missing}; run {make} to its end")
    return arrays


def before_and_after(
    scene: Scene, count: int | None = None, **options: Any
) -> tuple[dict, dict[str, NDArray]]:
    """The stored arrays in double precision, and what a session makes of them.

    Returns
    -------
    the arrays; dict with `before`, `after` (count, 3) irradiance at the first `count` points (None:
    all), `change` (m, 3) at the near points.
    """
    data = {name: array.astype(np.float64) if array.dtype.kind == "f" else array
            for name, array in load(scene).items()}  # fmt: skip
    count = len(data["points"]) if count is None else count
    points = np.concatenate([data["points"][:count], data["near_points"]])
    normals = np.concatenate([data["normals"][:count], data["near_normals"]])
    with Session(scene, Samples(points, normals), **options) as session:
        session.bake()
        before = session.irradiance
        session.move(MOVED, moved(scene).mesh(MOVED).pose)
        session.update()
        after = session.irradiance
    return data, {"before": before[:count], "after": after[:count], "change": (after - before)[count:]}


def is_open(free: NDArray) -> NDArray:
    """(n,) bool from `free`: points that can be seen, not those in slits between touching things.

    A fifth of the office's area lies behind pictures, under cupboards and where boxes overlap;
    little or no light gets there.
    """
    return free[:, 0] >= OPEN_SHARE


def is_certain(data: dict[str, NDArray]) -> NDArray:
    """(n,) bool: points where Mitsuba and Radiance give the same irradiance, before the move and after.

    Some 40 of 7,000 lie at the mouth of slits of a millimetre, where Mitsuba's rays begin half a
    millimetre off the surface and lose up to half of the light; their errors stand for nobody's truth.
    """
    certain = np.ones(len(data["points"]), dtype=bool)
    for state in ("before", "after"):
        mitsuba, radiance = (data[f"{name}_{state}"] for name in ("mitsuba", "radiance"))
        noise = np.hypot(data[f"mitsuba_{state}_error"], data[f"radiance_{state}_error"])
        allowed = DISAGREE[0] * noise + DISAGREE[1] * np.maximum(mitsuba, DARK * mitsuba.mean(axis=0))
        certain &= (np.abs(mitsuba - radiance) <= allowed).all(axis=1)
    return certain


def single(*arrays: NDArray) -> tuple[NDArray, ...]:
    """Rounded to what the file can hold, so that every renderer gets the same points."""
    return tuple(array.astype(np.float32).astype(np.float64) for array in arrays)
