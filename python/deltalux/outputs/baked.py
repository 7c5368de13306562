# SPDX-License-Identifier: Apache-2.0
"""Input of the writers: a result, with the scene and mesh that it belongs to."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from deltalux.errors import OptionError
from deltalux.files import found_among
from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.mesh.vertex_light import add_detail
from deltalux.samples import Samples
from deltalux.scene import Camera, Scene
from deltalux.units import LUX
from deltalux.version import __version__

QUANTITIES = {LUX: "illuminance"}


class Result(Protocol):
    """Irradiance at samples."""

    @property
    def points(self) -> np.ndarray:
        """(n, 3) world positions, metres."""

    @property
    def normals(self) -> np.ndarray:
        """(n, 3) unit normals."""

    @property
    def irradiance(self) -> np.ndarray:
        """(n, 3) linear RGB, in `unit`."""

    @property
    def standard_error(self) -> np.ndarray:
        """(n, 3), in `unit`."""

    @property
    def radius(self) -> np.ndarray:
        """(n,) disc radii, metres."""

    @property
    def unit(self) -> str:
        """ "lux" or "W/m2"."""

    @property
    def about(self) -> Mapping[str, Any]:
        """Command line, seed, number of paths and other statistics; JSON values."""


@dataclass(frozen=True, eq=False)
class Baked:
    """A result with the further data that a picture or a coloured mesh needs.

    Parameters
    ----------
    result : Result
    scene : Scene
    display : DisplayMesh or None
        The mesh on whose vertices the samples are; None for samples on a grid or from arrays.
    poses : mapping of movable's name to pose or None
        Present poses; None = removed, missing = as loaded.
    gradient : (n, 3, 3) array or None
    beyond : (d, 3) array or None, the value of `Session.direct_beyond_samples`
    grid : Samples or None
        The result's samples, if they form a grid.
    camera, exposure, stops, false_colour, size, threads : options of pictures, see `images.render`
    """

    result: Result
    scene: Scene
    display: DisplayMesh | None = None
    poses: Mapping[str, Any] = field(default_factory=dict)
    gradient: np.ndarray | None = None
    beyond: np.ndarray | None = None
    grid: Samples | None = None
    camera: Camera | None = None
    exposure: float | None = None
    stops: float = 0.0
    false_colour: bool = False
    size: tuple[int, int] = (960, 600)
    threads: int = 0


def vertex_irradiance(baked: Baked, display: DisplayMesh) -> np.ndarray:
    """(v, 3) at the vertices of the display mesh."""
    return add_detail(display.at_vertices(baked.result.irradiance).copy(), display, baked.beyond)


def display_of(baked: Baked, output: str) -> DisplayMesh:
    """The display mesh; OptionError if the samples are not on its vertices."""
    display = baked.display
    if display is None:
        raise OptionError(
            f"{output}: found samples that are not on the scene's display mesh, expected "
            "Samples.on_vertices(scene); write .npz or .csv instead"
        )
    expected = len(display.sample_vertices)
    if expected != len(baked.result.irradiance):
        raise OptionError(
            f"{output}: found {len(baked.result.irradiance)} values, "
            f"expected one for each of {expected} samples of the display mesh"
        )
    return display


def keep_inputs(path: str | os.PathLike[str], baked: Baked) -> None:
    """Raise OptionError if writing `path` would overwrite a file that the scene was read from."""
    if lost := found_among(path, baked.scene.files):
        raise OptionError(
            f'output "{os.fspath(path)}": found the scene\'s own file "{lost}", which writing would destroy; '
            "choose another name"
        )


def about_text(result: Result) -> dict[str, Any]:
    """Metadata of every output, as JSON values: program, quantity, unit, and the result's `about`."""
    about = {
        "program": f"deltalux {__version__}",
        "quantity": QUANTITIES.get(result.unit, "irradiance"),
        "unit": result.unit,
        "samples": len(result.irradiance),
        **dict(result.about),
    }
    return json.loads(json.dumps(about, default=_plain))


def _plain(value: Any) -> Any:
    """Convert NumPy values and other values that JSON does not have to JSON values."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    return str(value)
