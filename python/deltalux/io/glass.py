# SPDX-License-Identifier: Apache-2.0
"""What becomes of surfaces that let light pass, whatever the format of the file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux.scene.surfaces import DIFFUSE, WINDOW, PaneSurface, Surface
from deltalux.units import photopic

from .diagnostics import Notes

LITERAL, AS_WINDOW, CLEAR, AS_BOARD = OPTIONS = ("literal", "window", "clear", "opaque")
LEAST_PASSED = 0.5  # least share of the light that glass lets through

_OPAQUE = "transparency is not honoured: surfaces count as opaque, and windows let no daylight in"
_REMEDY = '--glass literal, window or clear (glass="literal") lets light pass what is mostly transparent'
_LEFT_OUT = "glass is left out: light passes it unchanged, and results and exports do not show it"
_GLOWS = "transparent surfaces that glow count as opaque"
_AS_WINDOW = "glass counts as panes of 6 mm, whatever its own transparency"
_GONE = "surfaces of which nothing is left by their alpha let all light pass"
_GREY = "the colour of what passes glass counts as grey"
LEAST_COLOUR = 0.05  # difference between channels that is worth telling


@dataclass(frozen=True)
class Transparency:
    """What a file says of the light that passes a material.

    Parameters
    ----------
    coverage : alpha of a blended surface
    transmission : share of the covered area that is glass
    index : of refraction
    tint : (red, green, blue) factors on what passes glass
    glows : whether the material emits light
    varies : whether a texture's alpha lets more light pass at some points
    """

    coverage: float = 1.0
    transmission: float = 0.0
    index: float = 1.5
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    glows: bool = False
    varies: bool = False

    @property
    def is_glass(self) -> bool:
        """Whether at least half of the light passes, and it does not glow."""
        passes = 1 - self.coverage + self.coverage * self.transmission
        return passes >= LEAST_PASSED and not self.glows

    @property
    def _passes(self) -> bool:
        return self.transmission > 0 or self.coverage < 1 or self.varies

    def leaves_out(self, glass: str) -> bool:
        """Whether surfaces of the material are none."""
        return glass == CLEAR and self.is_glass

    def surface(self, glass: str, name: str, notes: Notes) -> Surface:
        """How the material called `name` scatters light, for one of `OPTIONS`; tells of what is lost."""
        if not self._passes:
            return DIFFUSE
        if self.leaves_out(glass):
            notes.add(_LEFT_OUT, name)
            return DIFFUSE
        if glass == AS_BOARD:
            notes.add(_OPAQUE, name)
            if self.is_glass:
                notes.add(_REMEDY, name)
            return DIFFUSE
        if self.glows:
            notes.add(_GLOWS, name)
            return DIFFUSE
        if self.coverage == 0:
            notes.add(_GONE, name)
        if glass == AS_WINDOW and self.is_glass:
            notes.add(_AS_WINDOW, name)
            return WINDOW
        if self.transmission > 0 and max(self.tint) - min(self.tint) > LEAST_COLOUR:
            notes.add(_GREY, name)
        return PaneSurface(
            self.coverage, self.transmission, self.index, tint=min(1.0, float(photopic(np.array(self.tint))))
        )


OPAQUE = Transparency()
