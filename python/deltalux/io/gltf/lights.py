# SPDX-License-Identifier: Apache-2.0
"""KHR_lights_punctual of a glTF document.

``light_units`` determines the meaning of the lights' numbers; its three values are the three modes of
Blender's exporter (KhronosGroup/glTF-Blender-IO, issue 564 and pull request 1760).

``spec``
    As specified by KHR_lights_punctual and the core specification: candela for point and spot, lux for
    directional lights, cd/m2 for emission. Results are in lux.
``blender-watts``
    As Blender's exporter wrote until October 2022 (its version 3.4.38), and writes in its mode "Raw": radiant
    watts for point lights, divided here by 4 pi to give W/sr; likewise for spots, which in Blender are point
    lights behind a mask, so that a narrower cone does not make them brighter; W/m2 for suns. Emission is
    radiance, W/(sr m2). Results are in W/m2; no luminous efficacy is assumed.
``unitless``
    As in the exporter's mode "Unitless" and most real-time viewers: the numbers are W/sr for point and
    spot, W/m2 for directional lights, W/(sr m2) for emission. Results are in W/m2.

A node's scale changes neither the intensity nor the direction of its light. `range` is ignored: light
falls off with the square of the distance only.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from deltalux.io.diagnostics import Notes, UniqueNames, element, malformed
from deltalux.scene import Light, PointLight, SpotLight, SunLight
from deltalux.units import LUX, WATTS_PER_SQUARE_METRE, photopic

from .document import Document
from .nodes import PlacedNode

UNIT_OF = {"spec": LUX, "blender-watts": WATTS_PER_SQUARE_METRE, "unitless": WATTS_PER_SQUARE_METRE}
# A candle gives 12 lm, a stadium floodlight 200,000 lm; a full moon 0.3 lx, the sun 130,000 lx.
PLAUSIBLE_LUMENS = (10.0, 1e6)
PLAUSIBLE_SUN_LUX = (0.1, 2e5)
WATTS_UNTIL = (3, 4, 38)
BLENDER = re.compile(
    r"Khronos (?:glTF Blender I/O|Blender glTF 2\.0 I/O)(?: v(\d{1,4})\.(\d{1,4})\.(\d{1,4}))?"
)


class Lights:
    """Collects the lights of nodes."""

    def __init__(self, document: Document, light_units: str, by_name: bool) -> None:
        """`by_name`: lights with the same name share a group; otherwise each is a group of its own."""
        self._by_name = by_name
        self._document = document
        self._units = light_units
        self._names = UniqueNames()
        self._definitions = document.gltf.extensions.get("KHR_lights_punctual", {}).get("lights", [])
        self.found: list[Light] = []

    def add(self, node: PlacedNode, matrix: np.ndarray, attached_to: str | None) -> tuple[str, ...]:
        """Add the light of a node, if any, and return its name; `matrix` transforms the node to world or
        movable space.
        """
        reference = node.source.extensions.get("KHR_lights_punctual")
        if reference is None:
            return ()
        place = f"{node.place}.extensions.KHR_lights_punctual.light"
        source = element(self._definitions, reference["light"], place)
        base = node.name if node.source.name else source.get("name") or node.label
        name = self._names.take(base)
        shared = base if self._by_name and name != base else None
        group = node.group or source.get("extras", {}).get("group") or shared
        colour = np.array(source.get("color", (1.0, 1.0, 1.0))) * source.get("intensity", 1.0)
        if (colour < 0).any():
            raise malformed(
                f"{place} {reference['light']}: colour x intensity", colour.tolist(), "no negative channel"
            )
        if "range" in source:
            if not source["range"] > 0:
                raise malformed(f'light "{name}": range', source["range"], "a number above 0, or none at all")
            self._document.notes.add("the range of lights is not honoured", name)
        self.found.append(self._make(source, name, group, colour, matrix, attached_to))
        return (name,)

    def _make(
        self,
        source: Any,
        name: str,
        group: str | None,
        colour: np.ndarray,
        matrix: np.ndarray,
        owner: str | None,
    ) -> Light:
        kind, position, direction = source["type"], matrix[:3, 3], -matrix[:3, 2]
        if kind == "directional":
            return SunLight(name, _unit(direction, name), colour, group, owner)
        if self._units == "blender-watts":
            colour = colour / (4 * math.pi)
        if kind == "point":
            return PointLight(name, position, colour, group, owner)
        if kind == "spot":
            inner, outer = self._cone(source.get("spot", {}), name)
            return SpotLight(name, position, _unit(direction, name), colour, inner, outer, group, owner)
        raise malformed(f'light "{name}": type', repr(kind)[:40], "point, spot or directional")

    def _cone(self, spot: dict[str, Any], name: str) -> tuple[float, float]:
        inner, outer = spot.get("innerConeAngle", 0.0), spot.get("outerConeAngle", math.pi / 4)
        if not (0 <= inner <= outer + 1e-6 and 0 < outer <= math.pi / 2 + 1e-3):
            raise malformed(
                f'light "{name}": cone', f"inner {inner}, outer {outer}", "0 <= inner < outer <= pi/2"
            )
        outer = min(outer, math.pi / 2)
        if inner >= outer * 0.999:  # the falloff divides by the difference of the cosines
            inner = outer * 0.999
            self._document.notes.add("spot cones without a soft edge are given one of 0.1 %", name)
        return inner, outer

    def note_plausibility(self, area_lumens: Iterable[tuple[str, float]]) -> None:
        """Warn of powers that no real lamp has; `area_lumens` lists luminous meshes and their power."""
        if self._units != "spec":
            return
        notes = self._document.notes
        for light in self.found:
            power = light.power()
            if power is None:
                _note_range(
                    notes, light.name, float(photopic(light.strength)), PLAUSIBLE_SUN_LUX, "suns", "lx"
                )
            else:
                _note_range(notes, light.name, power, PLAUSIBLE_LUMENS, "lamps", "lm")
        for name, lumens in area_lumens:
            _note_range(notes, name, lumens, PLAUSIBLE_LUMENS, "luminous surfaces", "lm")
        generator = BLENDER.search(self._document.gltf.asset.generator or "")
        if self.found and generator and tuple(int(v or 0) for v in generator.groups()) <= WATTS_UNTIL:
            notes.add(
                "written by a Blender exporter that wrote watts, not candela: try --light-units blender-watts"
            )


def _unit(direction: np.ndarray, name: str) -> np.ndarray:
    length = float(np.linalg.norm(direction))
    if not 0 < length < math.inf:
        raise malformed(f'light "{name}"', "a node whose scale leaves no direction", "a scale other than 0")
    return direction / length


def _note_range(
    notes: Notes, name: str, value: float, plausible: tuple[float, float], kind: str, unit: str
) -> None:
    low, high = plausible
    if 0 < value < low or value > high:
        notes.add(
            f"{kind} outside {low:,g} to {high:,g} {unit}: the file may not be in metres, candela and lux; "
            "see --light-units",
            f"{name} {value:,.3g} {unit}",
        )
