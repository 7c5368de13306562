# SPDX-License-Identifier: Apache-2.0
"""Versions of a scene that need a bake: one more object that can be moved, one more lamp."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from deltalux.errors import OptionError
from deltalux.samples import Samples
from deltalux.samples.shared_samples import MOST_SAMPLES
from deltalux.scene import Scene, replace_scene
from deltalux.scene.adding import usual_power, with_lamp


@dataclass(frozen=True)
class Remake:
    """A scene to be baked in place of the present one."""

    make: Callable[[Scene], Scene]
    done: str  # what pages are told then
    group: str | None = None  # the added lamp's


def movable(scene: Scene, name: str) -> Remake:
    """Make the mesh `name` of `scene` movable.

    Raises
    ------
    OptionError
        If it is so already, or has no triangles.
    """
    mesh = scene.mesh(name)
    if mesh.movable:
        raise OptionError(f'make_movable "{name}": it can be moved already')
    if not len(mesh.triangles):
        raise OptionError(f'make_movable "{name}": found no triangles, expected something to move')

    def make(before: Scene) -> Scene:
        meshes = [replace(m, movable=True) if m.name == name else m for m in before.meshes]
        return replace_scene(before, meshes=meshes)

    return Remake(make, f"{name} can be moved now")


def lamp(scene: Scene, box: np.ndarray, position: Sequence[float]) -> Remake:
    """Add a point light to `scene`, strong enough to light a floor as large as `scene`.

    Raises
    ------
    OptionError
        If the position is outside of the session's `box`.
    """
    place = np.array(position, np.float64)
    if (place < box[0]).any() or (place > box[1]).any():
        raise OptionError(
            f"add_lamp: found the position {_places(place)}, expected one in the box that the session was "
            f"made for, {_places(box[0])} to {_places(box[1])}"
        )
    power = usual_power(scene)
    name = with_lamp(scene, place, power).lights[-1].name
    unit = "lm" if scene.unit == "lux" else "W"
    return Remake(
        lambda before: with_lamp(before, place, power),
        f"{name} shines now: {power:,g} {unit} at {_places(place)}",
        name,
    )


def _places(point: np.ndarray) -> str:
    return ", ".join(f"{value:.4g}" for value in point) + " m"


def samples_like(samples: Samples, scene: Scene) -> Samples:
    """Samples on the vertices of `scene`, on the sides that light reaches, as fine and shared as `samples`.

    Raises
    ------
    OptionError
        If those are not on a display mesh, or have radii of their own.
    """
    display = samples.display
    if display is None:
        raise OptionError("view: found samples on no display mesh, expected Samples.on_vertices(scene)")
    radii = np.unique(samples.radius)
    if len(radii) > 1:
        raise OptionError(
            f"view: found samples with {len(radii)} different radii, expected one radius, or automatic ones; "
            "make a session of the other scene"
        )
    return Samples.on_vertices(
        scene,
        spacing=display.spacing,
        radius=None if not len(radii) or np.isnan(radii[0]) else float(radii[0]),
        share=display.sharing is not None or len(display.points) <= MOST_SAMPLES,
        detail=display.detail_length,
    )
