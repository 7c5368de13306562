# SPDX-License-Identifier: Apache-2.0
"""Lights without a surface: one class per kind, with everything that the package needs to know of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from deltalux.errors import SceneError
from deltalux.units import photopic
from deltalux.vectors import unit, versine

from .arrays import NUMBER, VECTOR, frozen_array

# least half angle of a spot, radians; single precision represents directions to within 1e-7
MIN_CONE = 1e-5


@dataclass(frozen=True, eq=False)
class Light:
    """Common base of all kinds.

    A kind has a `position` or shines from outside the scene; it has a `direction` or shines equally in all.
    """

    name: str
    group: str | None = None
    attached_to: str | None = None

    # the name in session files, in `Scene.info` and in the core
    kind: ClassVar[str]
    fields: ClassVar[Mapping[str, tuple[int, ...]]]  # the other fields, with their shapes
    brightness: ClassVar[str] = "intensity"  # the field that holds the brightness

    def __init__(self, name: str, group: str | None, attached_to: str | None, **values: Any) -> None:
        for key, value in (("name", name), ("group", group), ("attached_to", attached_to)):
            object.__setattr__(self, key, value)
        for key, value in values.items():
            object.__setattr__(self, key, self._checked(key, value))

    def _checked(self, key: str, value: Any) -> Any:
        if self.fields[key] == NUMBER:
            return float(value)
        what = f'light "{self.name}": {key}'
        array = frozen_array(value, np.float64, self.fields[key], what)
        if key == self.brightness and (array < 0).any():
            raise SceneError(f"{what}: found {array}, expected no negative channel")
        if key == "direction":
            if not array.any():
                raise SceneError(f"{what}: found a zero vector, expected a direction")
            array = unit(array)
            array.setflags(write=False)
        return array

    @property
    def place(self) -> np.ndarray | None:
        """(3,) position; None: the light shines from outside the scene."""
        return getattr(self, "position", None)

    @property
    def axis(self) -> np.ndarray | None:
        """(3,) unit direction; None: the light has none."""
        return getattr(self, "direction", None)

    @property
    def strength(self) -> np.ndarray:
        """(3,) largest intensity, or the irradiance of a light from outside the scene."""
        return np.asarray(getattr(self, self.brightness))

    def parameters(self) -> tuple[float, ...]:
        """Further parameters of the core's light of this kind."""
        return ()

    def power(self) -> float | None:
        """Total photopic power; None if it is not bounded."""
        return None

    def gltf(self) -> dict[str, Any] | None:
        """`type` and its properties in KHR_lights_punctual; None if that has no such light."""
        return None


@dataclass(frozen=True, eq=False, init=False)
class PointLight(Light):
    """Uniform point source; `intensity` in W/sr or candela per channel.

    With `attached_to`, position (and direction) are local to that movable.
    """

    position: Any = (0.0, 0.0, 0.0)
    intensity: Any = (1.0, 1.0, 1.0)

    kind = "point"
    fields: ClassVar = {"position": VECTOR, "intensity": VECTOR}

    def __init__(
        self,
        name: str,
        position: Any,
        intensity: Any = (1, 1, 1),
        group: str | None = None,
        attached_to: str | None = None,
    ) -> None:
        super().__init__(name, group, attached_to, position=position, intensity=intensity)

    def power(self) -> float:
        """Total photopic power."""
        return float(photopic(4 * np.pi * self.intensity))

    def gltf(self) -> dict[str, Any]:
        """Properties in KHR_lights_punctual."""
        return {"type": "point"}


@dataclass(frozen=True, eq=False, init=False)
class SpotLight(Light):
    """Point source within a cone: full intensity inside `inner_angle`, zero outside `outer_angle`.

    Both are half angles in radians. The falloff between them is the one of KHR_lights_punctual.
    """

    position: Any = (0.0, 0.0, 0.0)
    direction: Any = (0.0, -1.0, 0.0)
    intensity: Any = (1.0, 1.0, 1.0)
    inner_angle: float = 0.0
    outer_angle: float = np.pi / 4

    kind = "spot"
    fields: ClassVar = {
        "position": VECTOR,
        "direction": VECTOR,
        "intensity": VECTOR,
        "inner_angle": NUMBER,
        "outer_angle": NUMBER,
    }

    def __init__(
        self,
        name: str,
        position: Any,
        direction: Any,
        intensity: Any = (1, 1, 1),
        inner_angle: float = 0.0,
        outer_angle: float = np.pi / 4,
        group: str | None = None,
        attached_to: str | None = None,
    ) -> None:
        if not (0 <= inner_angle < outer_angle and MIN_CONE <= outer_angle <= np.pi / 2 + 1e-6):
            raise SceneError(
                f'light "{name}": found inner angle {inner_angle}, outer angle {outer_angle}; '
                f"expected 0 <= inner < outer, outer from {MIN_CONE:g} to pi/2 (radians)"
            )
        super().__init__(
            name,
            group,
            attached_to,
            position=position,
            direction=direction,
            intensity=intensity,
            inner_angle=inner_angle,
            outer_angle=outer_angle,
        )

    def parameters(self) -> tuple[float, ...]:
        """Versines of the half angles: the cosine of a narrow cone rounds to 1 in single precision."""
        return versine(self.inner_angle), versine(self.outer_angle)

    def power(self) -> float:
        """Total photopic power."""
        return float(photopic(self.intensity * spot_solid_angle(self.inner_angle, self.outer_angle)))

    def gltf(self) -> dict[str, Any]:
        """Properties in KHR_lights_punctual."""
        cone = {"innerConeAngle": self.inner_angle, "outerConeAngle": self.outer_angle}
        return {"type": "spot", "spot": cone}


@dataclass(frozen=True, eq=False, init=False)
class SunLight(Light):
    """Parallel light; `irradiance` (W/m2 or lux) on a plane facing it, `direction` of travel."""

    direction: Any = (0.0, -1.0, 0.0)
    irradiance: Any = (1.0, 1.0, 1.0)

    kind = "sun"
    fields: ClassVar = {"direction": VECTOR, "irradiance": VECTOR}
    brightness = "irradiance"

    def __init__(
        self,
        name: str,
        direction: Any,
        irradiance: Any = (1, 1, 1),
        group: str | None = None,
        attached_to: str | None = None,
    ) -> None:
        super().__init__(name, group, attached_to, direction=direction, irradiance=irradiance)

    def gltf(self) -> dict[str, Any]:
        """Properties in KHR_lights_punctual."""
        return {"type": "directional"}


KINDS: dict[str, type[Light]] = {cls.kind: cls for cls in (PointLight, SpotLight, SunLight)}


def spot_solid_angle(inner: float, outer: float) -> float:
    """Integral of the KHR_lights_punctual falloff over directions, steradians.

    The falloff is clamp((cos a - cos outer)/(cos inner - cos outer), 0, 1) squared.
    """
    return 2 * np.pi * (versine(inner) + (versine(outer) - versine(inner)) / 3)
