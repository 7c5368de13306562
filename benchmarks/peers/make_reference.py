# SPDX-License-Identifier: Apache-2.0
"""Compute the office's reference irradiance with Mitsuba 3 and Radiance: reference_office.npz.

    PYTHONPATH=tests .venv/bin/python benchmarks/peers/make_reference.py --out benchmarks/peers

Each finished stage is written at once, so that a run that was stopped goes on where it was;
nothing is done where the file is of the present office and settings and whole. One thread,
some 30 minutes of CPU time.

The file holds 7,000 points uniform over the area of the static surfaces and, as `near_*`,
1,000 that lie within 0.6 m of the chair before or after its move; for each their irradiance
in lux before and after the move, and its standard error. `near_change` is the difference of
two Mitsuba renders with equal random numbers. `free` tells open points from those in slits.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from deltalux.scene import Scene, replace_scene
from deltalux.scenes import office
from oracles import mitsuba_reference, office_reference, radiance_reference, world
from oracles.office_reference import SETTINGS
from stages import Arrays, compact, fill


def main() -> None:
    """Compute what is missing and write the file."""
    parser = argparse.ArgumentParser(description="Reference irradiance of the office")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    options = parser.parse_args()
    scene = office()
    path = options.out / office_reference.PATH.name
    settings = json.dumps(SETTINGS | {"scene": world.scene_hash(scene), "versions": _versions()})
    header = {"key": np.array(office_reference.key_of(scene)), "settings": np.array(settings)}
    try:
        arrays: Arrays = office_reference.load(scene, path)
    except office_reference.Stale:
        arrays = dict(header)
    arrays = fill(path, arrays, header, _stages(scene))
    _report(arrays)


def _stages(scene: Scene) -> dict[str, Callable[[], Arrays]]:
    """By the array that tells that a stage is done."""
    states = {"before": scene, "after": office_reference.moved(scene)}
    points, normals = office_reference.reference_points(scene)
    near, near_normals = office_reference.near_points(scene)

    def save_points() -> Arrays:
        static = replace_scene(scene, meshes=[mesh for mesh in scene.meshes if not mesh.movable])
        renderer, distances = mitsuba_reference.Renderer(static), SETTINGS["free_distances"]
        return compact(
            points=points, normals=normals, free=renderer.free_share(points, normals, distances),
            near_points=near, near_normals=near_normals,
            near_free=renderer.free_share(near, near_normals, distances),
        )  # fmt: skip

    def by_mitsuba(state: str) -> Arrays:
        renderer = mitsuba_reference.Renderer(states[state])
        found = renderer.irradiance(
            points, normals, SETTINGS["mitsuba_samples"],
            passes=SETTINGS["mitsuba_passes"], seed=SETTINGS["mitsuba_seed"],
        )  # fmt: skip
        return compact(**{f"mitsuba_{state}": found.mean, f"mitsuba_{state}_error": found.standard_error})

    def by_radiance(state: str) -> Arrays:
        settings = radiance_reference.Settings(**SETTINGS["radiance"])
        renderer = radiance_reference.Renderer(states[state])
        found = renderer.irradiance(points, normals, settings, passes=SETTINGS["radiance_passes"])
        return compact(**{f"radiance_{state}": found.mean, f"radiance_{state}_error": found.standard_error})

    def near_chair() -> Arrays:
        renderers = [mitsuba_reference.Renderer(state) for state in states.values()]
        before, after = (
            renderer.passes(
                near, near_normals, SETTINGS["near_samples"],
                passes=SETTINGS["mitsuba_passes"], seed=SETTINGS["mitsuba_seed"] + 1,
            )
            for renderer in renderers
        )  # fmt: skip
        old, change = world.estimate(before, 0), world.estimate(after - before, 0)
        return compact(
            near_before=old.mean, near_before_error=old.standard_error,
            near_change=change.mean, near_change_error=change.standard_error,
        )  # fmt: skip

    return {
        "points": save_points,
        "mitsuba_before": lambda: by_mitsuba("before"),
        "near_change": near_chair,
        "radiance_before": lambda: by_radiance("before"),
        "mitsuba_after": lambda: by_mitsuba("after"),
        "radiance_after": lambda: by_radiance("after"),
    }


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {name: version(name) for name in ("mitsuba", "drjit", "pyradiance")}


def _report(arrays: Arrays) -> None:
    print(f"open points: {office_reference.is_open(arrays['free']).sum()} of {len(arrays['points'])}")
    for state in ("before", "after"):
        for name in ("mitsuba", "radiance"):
            mean, error = (arrays[f"{name}_{state}{end}"].astype(float) for end in ("", "_error"))
            relative = error / np.maximum(mean, 0.1 * mean.mean(axis=0))
            print(f"{name} {state}: mean {mean.mean(axis=0)} lx, standard error {relative.mean():.2%}")
    rms = [np.sqrt((arrays[name].astype(float) ** 2).mean()) for name in ("near_change", "near_change_error")]
    print(f"change near the chair: RMS {rms[0]:.2f} lx, its standard error {rms[1]:.2f} lx")


if __name__ == "__main__":
    main()
