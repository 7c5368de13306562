# SPDX-License-Identifier: Apache-2.0
"""Views, sizes and brightness of pictures, the same for every command that makes pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import typer

import deltalux as dl
from deltalux.outputs.camera import look_at
from deltalux.outputs.images import Picture
from deltalux.rendering import SIZE, Rendering, check_size, false_colour_picture, lit_picture

MOST_STOPS = 32
FIELD_OF_VIEW = 0.9  # radians; field of view of a camera given by --eye
PICTURE, LAYERS = ".png", ".exr"

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Shot:
    """The options of a picture.

    Parameters
    ----------
    camera : name of a camera of the scene, or None
    eye, target : positions to look from and to, or None
    size : (width, height) in pixels
    stops : exposure relative to metering, in powers of two
    false_colour : irradiance instead of the lit scene
    sized : whether the user gave `size`; else pictures that do not fit into memory are drawn from samples
    """

    camera: str | None = None
    eye: Place | None = None
    target: Place | None = None
    size: tuple[int, int] = SIZE
    stops: float = 0.0
    false_colour: bool = False
    sized: bool = False

    @property
    def given(self) -> str | None:
        """An option given for view, size or brightness; None if there is none."""
        options = {
            "--camera": self.camera is not None,
            "--eye": self.eye is not None,
            "--target": self.target is not None,
            "--size": self.sized,
            "--exposure": self.stops != 0,
        }
        return next((option for option, was in options.items() if was), None)

    def refuse_plans(self, planes: int) -> None:
        """Raise BadParameter if there are working planes, whose pictures are plans, and `given`."""
        if planes and self.given:
            raise typer.BadParameter(
                f"found {self.given} for a working plane, whose picture is a plan; leave it out"
            )

    def check_size(self, memory_limit: int | None) -> None:
        """Raise OptionError if the user gave a size that does not fit into memory."""
        if self.sized:
            check_size(self.size, memory_limit)

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.size[0] * self.size[1]

    def camera_in(self, scene: dl.Scene) -> dl.Camera | None:
        """The camera that the user chose; None if there is none.

        Raises
        ------
        BadParameter : the scene has no camera of that name
        """
        if self.eye is not None:
            return dl.Camera("eye", look_at(np.array(self.eye), np.array(self.target)), FIELD_OF_VIEW)
        if self.camera is None:
            return None
        for camera in scene.cameras:
            if camera.name == self.camera:
                return camera
        known = ", ".join(f"'{c.name}'" for c in scene.cameras) or "none; --eye and --target place one"
        raise typer.BadParameter(f"--camera: found '{self.camera}', expected a camera of the scene: {known}")

    def picture_of(self, rendering: Rendering) -> Picture:
        """The lit picture or the false-colour picture of a rendering."""
        if self.false_colour:
            return false_colour_picture(rendering)
        return lit_picture(rendering, stops=self.stops)


def shot_of(
    camera: str | None,
    eye: Place | None,
    target: Place | None,
    size: tuple[int, int] | None,
    exposure: float = 0.0,
    false_colour: bool = False,
    *,
    targets: Sequence[Path],
    planes: int = 0,
) -> Shot:
    """Make a shot of options, after checking that they fit together and suit the result files.

    Parameters
    ----------
    camera, eye, target, size, exposure, false_colour : see `Shot`; None, 0 or False if not given
    targets : result files
    planes : number of working planes, whose pictures are plans

    Raises
    ------
    BadParameter
    """
    shot = Shot(camera, eye, target, size or SIZE, exposure, false_colour, size is not None)
    suffixes = {path.suffix.lower() for path in targets}
    if (exposure or false_colour) and PICTURE not in suffixes and LAYERS in suffixes:
        option = "--exposure" if exposure else "--false-colour"
        raise typer.BadParameter(
            f"found {option} without a {PICTURE} file; {LAYERS} files hold light itself, leave it out"
        )
    if shot.given and suffixes.isdisjoint((PICTURE, LAYERS)):
        raise typer.BadParameter(
            f"found {shot.given} without a picture; add -o OUT{PICTURE}, or leave it out"
        )
    shot.refuse_plans(planes)
    if not abs(exposure) <= MOST_STOPS:
        raise typer.BadParameter(f"--exposure: found {exposure:g}, expected stops up to {MOST_STOPS}")
    if exposure and false_colour:
        raise typer.BadParameter("found --exposure and --false-colour, which has a scale; give one of them")
    if (eye is None) != (target is None):
        raise typer.BadParameter("found one of --eye and --target, expected both or none")
    if eye is not None and camera is not None:
        raise typer.BadParameter("found --camera and --eye; give one of them")
    if eye is not None and eye == target:
        raise typer.BadParameter("found --eye and --target at one place, expected two places")
    return shot
