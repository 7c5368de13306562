# SPDX-License-Identifier: Apache-2.0
"""Compute the rooms' reference irradiance with Mitsuba's rays: reference_ROOM.npz.

    PYTHONPATH=tests .venv/bin/python benchmarks/peers/make_rooms.py [ROOM ...]

One thread, 3 to 6 minutes of CPU time a room. Changes are differences of two runs with equal
random numbers. Points whose rays all end within 2 cm (of a room of 6 m), or that no light reaches, count
nowhere: they lie between or within things that touch, which nobody sees.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
from deltalux.scene import Scene
from oracles import office_reference, world
from oracles.pool_paths import PoolRenderer
from room_reference import (
    COUNTS,
    ROOMS,
    SEED,
    Points,
    Room,
    dark_points,
    near_points,
    receivers,
    small_points,
    static_points,
    still,
)
from stages import Arrays, compact, fill

MORE = 3  # times as many points are drawn, since some are buried
FEW = 64  # paths that tell whether any light gets to a point


def main() -> None:
    parser = argparse.ArgumentParser(description="Reference irradiance of the rooms")
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"{', '.join(ROOMS)}; none: all")
    for name in parser.parse_args().rooms or ROOMS:
        room = ROOMS[name]
        scene = room.scene()
        header = {"key": np.array(room.key(scene))}
        try:
            arrays = office_reference.load_file(room.path, str(header["key"]), [], "")
        except office_reference.Stale:
            arrays = {}
        print(name, flush=True)
        _report(room, fill(room.path, arrays, header, _stages(room, scene)))


def _stages(room: Room, scene: Scene) -> dict[str, Callable[[], Arrays]]:
    base = PoolRenderer(scene)

    def light(name: str, draw: Callable[[Room, Scene, int], Points]) -> Callable[[], Arrays]:
        def stage() -> Arrays:
            places = _seen(room, base, draw(room, scene, MORE * COUNTS[name]), COUNTS[name])
            return _light(room, name, base, places, SEED)

        return stage

    def change(index: int) -> Callable[[], Arrays]:
        def stage() -> Arrays:
            name = f"near_{index}"
            places = near_points(room, scene, index, MORE * COUNTS["near"])
            points, normals = _seen(room, PoolRenderer(still(scene)), places, COUNTS["near"])
            after = PoolRenderer(room.after(scene, room.moves[index]))
            old, new = (
                _passes(room, room.samples, renderer, points, normals, SEED + 10 + index)
                for renderer in (base, after)
            )
            found, before = world.estimate(new - old, 0), world.estimate(old, 0)
            more = {f"{name}_before": before.mean, f"{name}_before_error": before.standard_error}
            return compact(**_named(name, points, normals, found), **more)

        return stage

    def moving() -> Arrays:
        after = PoolRenderer(room.after(scene, room.moves[0]))
        places = receivers(room, scene, MORE * COUNTS["receivers"])
        return _light(room, "receivers", after, _seen(room, after, places, COUNTS["receivers"]), SEED + 1)

    def dark() -> Arrays:
        points, normals = dark_points(room, scene, COUNTS["dark"])
        assert not base.irradiance(points, normals, 256, passes=1).mean.any(), (
            "light gets behind the partition"
        )
        return compact(dark_points=points, dark_normals=normals)

    stages = {"static": light("static", static_points), "small": light("small", small_points)}
    stages |= {f"near_{i}": change(i) for i in range(len(room.moves))} | {"receivers": moving}
    stages["near_free"] = lambda: _near_free(room, scene, base)
    return stages if room.dark_beyond is None else {"dark_points": dark} | stages


def _near_free(room: Room, scene: Scene, base: PoolRenderer) -> Arrays:
    """Share of rays that meet nothing near by, before and after each move, whichever is less."""
    with np.load(room.path) as data:
        places = [(data[f"near_{i}_points"], data[f"near_{i}_normals"]) for i in range(len(room.moves))]
    free = []
    for move, place in zip(room.moves, places, strict=True):
        states = (base, PoolRenderer(room.after(scene, move)))
        free.append(np.minimum(*(state.free_share(*place, [room.buried])[:, 0] for state in states)))
    return compact(near_free=np.stack(free))


def _seen(room: Room, renderer: PoolRenderer, places: Points, count: int) -> Points:
    """The first `count` that are not buried, and that some light reaches: not within boxes that abut."""
    kept = renderer.free_share(*places, [room.buried])[:, 0] > 0
    kept &= renderer.irradiance(*places, FEW, passes=1).mean.any(axis=1)
    if kept.sum() < count:
        raise RuntimeError(f"{room.name}: found {kept.sum()} points that are not buried, expected {count}")
    points, normals = office_reference.single(*(array[kept][:count] for array in places))
    return points, normals


def _light(room: Room, name: str, renderer: PoolRenderer, places: Points, seed: int) -> Arrays:
    found = world.estimate(_passes(room, room.still_samples or room.samples, renderer, *places, seed), 0)
    free = {f"{name}_free": renderer.free_share(*places, [room.buried])[:, 0]}
    return compact(**_named(name, *places, found), **free)


def _passes(
    room: Room, samples: int, renderer: PoolRenderer, points: np.ndarray, normals: np.ndarray, seed: int
) -> np.ndarray:
    return renderer.passes(points, normals, samples * room.passes, passes=room.passes, seed=seed)


def _named(name: str, points: np.ndarray, normals: np.ndarray, found: world.Estimate) -> Arrays:
    values = {"": found.mean, "_error": found.standard_error, "_points": points, "_normals": normals}
    return {name + end: array for end, array in values.items()}


def _report(room: Room, arrays: Arrays) -> None:
    for name in [n for n in arrays if n + "_error" in arrays and not n.endswith("_before")]:
        mean, error = (arrays[name + end].astype(float) for end in ("", "_error"))
        scale = np.maximum(np.abs(mean), 0.1 * np.abs(mean).mean(axis=0))
        rms, share = np.sqrt((mean**2).mean()), np.sqrt((error**2).mean() / (mean**2).mean())
        median = np.median(error / scale)
        print(f"  {name}: RMS {rms:.4g} lx, standard error: median {median:.2%}, {share:.2%} of the RMS")


if __name__ == "__main__":
    main()
