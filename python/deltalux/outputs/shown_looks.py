# SPDX-License-Identifier: Apache-2.0
"""What unlit viewers multiply: a base colour, perhaps a texture, and light in vertex colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux.look import Texture
from deltalux.scene import Material
from deltalux.units import photopic


@dataclass(frozen=True, eq=False)
class Shown:
    """A material's surface as texture x `base` x vertex colour.

    Parameters
    ----------
    base : (3,) in [0, 1], glTF's baseColorFactor
    texture : Texture or None
    gain : (3,) what vertex colours are multiplied by, so that the texture's mean x `base` x `gain` is the
        reflectance; of a luminous material, whose vertex colours hold all of its light, it is 1
    """

    base: np.ndarray
    texture: Texture | None
    gain: np.ndarray

    def colours(
        self, material: Material, exposure: float, irradiance: np.ndarray, emits: np.ndarray
    ) -> np.ndarray:
        """(n, 3) vertex colours in [0, 1] for `irradiance` (n, 3); `emits` (n,) on a luminous side."""
        light = exposure * irradiance
        if material.emissive:
            light = material.reflectance * light
            light += np.pi * exposure * material.emission * (emits | material.two_sided)[:, None]
        return np.clip(self.gain * light, 0, 1)


def shown_as(material: Material, textured: bool, irradiance: np.ndarray) -> Shown:
    """How a material is shown where it has texture coordinates (`textured`), or where it has none.

    A luminous material shows the texture of what is brighter, what it emits or what it reflects of its mean
    `irradiance` (3,): a lamp that of its emission, a device with a small light that of its surface.
    """
    look = material.look
    if not material.emissive:
        if look.colour is None or not textured:
            return Shown(material.reflectance, None, np.ones(3))
        # Not 1 where the reflectance was changed, and more than 1 where a dark texture was made bright.
        factor = _ratio(material.reflectance, look.colour.mean)
        base = np.minimum(factor, 1.0)
        return Shown(base, look.colour, _ratio(factor, base))
    glows = photopic(np.pi * material.emission) >= photopic(material.reflectance * irradiance)
    texture = (look.glow if glows else look.colour) if textured else None
    mean = np.ones(3) if texture is None else texture.mean
    return Shown(np.ones(3), texture, _ratio(np.ones(3), mean))


def _ratio(above: np.ndarray, below: np.ndarray) -> np.ndarray:
    """Quotients, 1 where a channel divides by nothing: what is multiplied by it is black anyway."""
    return np.divide(above, below, out=np.ones(3), where=below > 0)
