# SPDX-License-Identifier: Apache-2.0
"""Factors that unlit viewers multiply: base colour, an optional texture, and light in vertex colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux.scene import Material
from deltalux.scene.look import Texture
from deltalux.units import photopic

# Vertex colours are at most 1 and typically 0.4: a texture that needs a larger gain than this is omitted.
MOST_GAIN = 4.0


@dataclass(frozen=True, eq=False)
class Shown:
    """A material's surface as texture x `base` x vertex colour.

    Parameters
    ----------
    base : (3,) in [0, 1], glTF's baseColorFactor
    texture : Texture or None
    reflected : (3,) vertex colour for an irradiance of 1, so that its product with `base` and the mean of the
        texture is the reflectance
    emitted : (3,) likewise for pi times a radiance of 1
    """

    base: np.ndarray
    texture: Texture | None
    reflected: np.ndarray
    emitted: np.ndarray

    def colours(
        self, material: Material, exposure: float, irradiance: np.ndarray, emits: np.ndarray
    ) -> np.ndarray:
        """(n, 3) vertex colours in [0, 1] for `irradiance` (n, 3); `emits` (n,) on a luminous side."""
        light = self.reflected * (exposure * irradiance) * (self.base > 0)  # nothing is seen of the others
        if material.emissive:
            glow = np.pi * exposure * material.emission * self.emitted
            light += glow * (emits | material.two_sided)[:, None]
        return np.clip(light, 0, 1)


def shown_as(material: Material, textured: bool, irradiance: np.ndarray) -> Shown:
    """How a material is shown, with texture coordinates (`textured`) or without.

    Viewers support only one texture. A luminous material with two shows the emission's texture if it emits
    more than it reflects of its mean `irradiance` (3,), unless the reflectance's texture is brighter: a
    screen or a lamp is visible by its own light, but a room's atlas or a device with a small lamp on it is
    not.
    Light that belongs to the omitted texture has the hue of both, and on average its own brightness.
    """
    look, none = material.look, np.ones(3)
    if not material.emissive:
        if look.colour is None or not textured:
            return Shown(material.reflectance, None, none, none)
        # More than 1 after an edit that made the reflectance of a dark texture bright.
        factor = _ratio(material.reflectance, look.colour.mean)
        if factor.max() > MOST_GAIN:
            return shown_as(material, False, irradiance)
        base = np.minimum(factor, 1.0)
        return Shown(base, look.colour, _ratio(factor, base), none)
    glows = photopic(np.pi * material.emission) >= photopic(material.reflectance * irradiance)
    if look.colour is not None and look.glow is not None:
        glows &= photopic(look.glow.mean) >= photopic(look.colour.mean)
    texture = (look.glow if glows else look.colour) if textured else None
    mean = none if texture is None else texture.mean
    grey = np.full(3, photopic(mean))
    return Shown(
        none,
        texture,
        _ratio(material.reflectance, grey if glows else mean),
        _ratio(none, mean if glows else grey),
    )


def _ratio(above: np.ndarray, below: np.ndarray) -> np.ndarray:
    """Quotients; 1 for a channel that divides by zero, because its product is black anyway."""
    return np.divide(above, below, out=np.ones(3), where=below > 0)
