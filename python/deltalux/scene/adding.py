# SPDX-License-Identifier: Apache-2.0
"""Lights added to scenes that have none, or too few."""

from __future__ import annotations

import math
from itertools import count
from typing import Any

import numpy as np

from deltalux.errors import OptionError

from .lights import Light, PointLight, SunLight
from .scene import Scene, replace_scene

# mean light that a lamp brings to a floor as large as the scene's bounds, by the scene's unit
USUAL = {"lux": 300.0, "W/m2": 1.0}
REACHING_FLOOR = 0.5  # share of a lamp's power
SUNSHINE = {"lux": 80_000.0, "W/m2": 800.0}  # of a clear sky, on a plane that faces the sun
NO_LIGHT = (
    "no light: neither a luminous material nor a lamp; add some (--lamp auto, --lamp X,Y,Z or --sun "
    "AZIMUTH,ELEVATION)"
)


def with_lamp(scene: Scene, position: Any, power: float | None = None) -> Scene:
    """A copy with one more point light, white, in a light group of its own.

    Parameters
    ----------
    scene : Scene
    position : (3,) metres
    power : lumens, or watts in a scene of W/m2; None lights a floor as large as the scene as usual (300 lx)

    Raises
    ------
    OptionError
        For a power that is not finite or below 0.
    """
    value = usual_power(scene) if power is None else float(power)
    if not 0 <= value < math.inf:
        raise OptionError(f"lamp: found a power of {value:g}, expected a finite one of 0 or more")
    return _with_light(scene, PointLight(_free_name(scene, "lamp"), position, (value / (4 * math.pi),) * 3))


def with_sun(scene: Scene, azimuth: float, elevation: float, irradiance: float | None = None) -> Scene:
    """A copy with the sun, white, in a light group of its own.

    Parameters
    ----------
    scene : Scene
    azimuth : degrees about +Y; at 0 the sun stands towards +Z, at 90 towards +X
    elevation : degrees above the horizon
    irradiance : on a plane that faces it, in the scene's unit; None is that of a clear sky (80,000 lx)

    Raises
    ------
    OptionError
        For an elevation beyond -90 to 90 degrees, an irradiance below 0, or numbers that are not finite.
    """
    value = SUNSHINE[scene.unit] if irradiance is None else float(irradiance)
    if not (math.isfinite(azimuth) and -90 <= elevation <= 90 and 0 <= value < math.inf):
        raise OptionError(
            f"sun: found azimuth {azimuth:g}, elevation {elevation:g}, irradiance {value:g}; expected finite "
            "numbers, an elevation from -90 to 90 degrees, and an irradiance of 0 or more"
        )
    turn, rise = math.radians(azimuth), math.radians(elevation)
    towards = np.array([math.sin(turn) * math.cos(rise), math.sin(rise), math.cos(turn) * math.cos(rise)])
    return _with_light(scene, SunLight(_free_name(scene, "sun"), -towards, (value,) * 3))


def usual_power(scene: Scene) -> float:
    """Power of a lamp that lights the scene as usual, with two digits."""
    low, high = scene.bounds
    width, height, depth = high - low
    floor = max(width, 0.1 * height) * max(depth, 0.1 * height)
    return float(f"{USUAL[scene.unit] * floor / REACHING_FLOOR:.2g}")


def _with_light(scene: Scene, light: Light) -> Scene:
    warnings = [text for text in scene.warnings if text != NO_LIGHT]
    return replace_scene(scene, lights=(*scene.lights, light), warnings=warnings)


def _free_name(scene: Scene, word: str) -> str:
    taken = {*scene.groups, *(light.name for light in scene.lights)}
    return next(name for name in (word if k == 1 else f"{word} {k}" for k in count(1)) if name not in taken)
