# SPDX-License-Identifier: Apache-2.0
"""Textures on which light depends, as the core has them: each image decoded once, for all that use it."""

from __future__ import annotations

import hashlib
import weakref
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from deltalux import _core
from deltalux.errors import FormatError, SceneError
from deltalux.texels import halving, image_size, srgb_texels

from .look import NEAREST, WRAPS, Texture, images_of
from .scene import Material

MOST_TEXELS = 2048  # along a side, for light; a larger image is halved
MOST_BYTES = 2**30  # of all textures of a scene
BYTES_PER_TEXEL = 4
MOST_RADIANCE = 1e30  # of a texel, in the scene's unit
_WRAP_NAMES = dict(zip(WRAPS, ("repeat", "clamp", "mirror"), strict=True))


@dataclass(frozen=True)
class _Decoded:
    """The core's texture while somebody has it, and the hash of its texels."""

    image: bytes  # kept, so that no other object gets its identity
    texture: weakref.ref[_core.Texture]
    texels: str


# By the image's identity, the most texels along a side, and what counts of each alpha.
_decoded: dict[tuple[int, int, bytes], _Decoded] = {}


class CoreTextures:
    """Gives the materials of a core's scene their textures.

    Parameters
    ----------
    materials : all those of the scene; how finely images are kept depends on how many there are
    """

    def __init__(self, materials: Iterable[Material]) -> None:
        used = {m.name: _textures_of(m) for m in materials}
        self._used = {name: textures for name, textures in used.items() if textures}
        most = self._most = _most_texels(images_of(t for own in self._used.values() for t in own))
        self._size = f"{most} "  # of the images, in their hashes

    def have(self, material: Material) -> bool:
        """Whether light depends on a texture of the material."""
        return material.name in self._used

    def set_last(self, core: _core.Scene, material: Material) -> None:
        """Give the last material of `core`, which is `material`, its textures, if it has any.

        Raises
        ------
        SceneError
            If an image cannot be decoded, or decodes otherwise than where the session was saved.
        """
        if not self.have(material):
            return
        decoded = self._decode_all(material)
        kept, texels = material.look.texels, self._hash(decoded)
        # Of images that were kept otherwise, as parts of another scene, it says nothing.
        if kept is not None and kept != texels and kept.startswith(self._size):
            raise SceneError(
                f'material "{material.name}": its image decodes to other texels here than where the '
                "session was baked; open it with the version of Pillow of then, or bake it again"
            )
        look = material.look
        if look.colour is not None:
            mean = tuple(look.colour.mean.tolist())
            found, _ = decoded[0]
            core.set_texture(found, *_mapping(look.colour), mean, look.alpha_mode == "MASK")
        if look.glow is not None and material.emissive:
            mean = look.glow.mean
            full = np.divide(material.emission, mean, out=np.full(3, np.inf), where=mean > 0)
            full[material.emission == 0] = 0
            if not (full <= MOST_RADIANCE).all():
                raise SceneError(
                    f'material "{material.name}": emission: found {material.emission.tolist()} where its '
                    f"texture's mean is {mean.tolist()}, expected texels that can shine as much"
                )
            found, _ = decoded[-1]
            core.set_glow(found, *_mapping(look.glow), tuple(full.tolist()))

    def hash_of(self, material: Material) -> str | None:
        """Hash of the texels that the material has in the core; None if it has none."""
        return self._hash(self._decode_all(material)) if self.have(material) else None

    def _hash(self, decoded: list[tuple[_core.Texture, str]]) -> str:
        return self._size + " ".join(texels for _, texels in decoded)

    def _decode_all(self, material: Material) -> list[tuple[_core.Texture, str]]:
        """Each texture on which light depends, and the hash of its texels."""
        textures, look = self._used[material.name], material.look
        # Only the colour's texels weigh by their alpha; it comes first.
        weights = ([look.opacity] if look.colour is not None else []) + [None]
        return [self._decode(material, *each) for each in zip(textures, weights, strict=False)]

    def _decode(
        self, material: Material, texture: Texture, opacity: np.ndarray | None
    ) -> tuple[_core.Texture, str]:
        image = texture.image
        key = (id(image), self._most, b"" if opacity is None else opacity.tobytes())
        known = _decoded.get(key)
        found = None if known is None else known.texture()
        if known is not None and found is not None:
            return found, known.texels
        try:
            texels = srgb_texels(image, f'material "{material.name}": texture', self._most, opacity)
        except FormatError as error:
            raise SceneError(str(error)) from None
        found = _core.Texture(texels)
        known = _Decoded(
            image,
            weakref.ref(found, lambda _: _decoded.pop(key, None)),
            hashlib.blake2b(texels.tobytes(), digest_size=8).hexdigest(),
        )
        _decoded[key] = known
        return found, known.texels


def _mapping(texture: Texture) -> tuple[tuple[str, str], bool, list[list[float]]]:
    """How a texture lies on surfaces, as the core takes it."""
    along, across = texture.wrap
    wraps = (_WRAP_NAMES[along], _WRAP_NAMES[across])
    return wraps, texture.mag_filter == NEAREST, texture.matrix.tolist()


def _textures_of(material: Material) -> list[Texture]:
    """Those on which light depends."""
    glow = material.look.glow if material.emissive else None
    return [texture for texture in (material.look.colour, glow) if texture is not None]


def _most_texels(images: list[bytes]) -> int:
    """Texels along a side so that all images fit into `MOST_BYTES`; depends on nothing but the scene."""
    sizes = [image_size(image) for image in images]
    most = MOST_TEXELS
    while most > 1 and sum(_texels(size, most) for size in sizes) * BYTES_PER_TEXEL > MOST_BYTES:
        most //= 2
    return most


def _texels(size: tuple[int, int], most: int) -> int:
    factor = halving(size, most)
    return -(-size[0] // factor) * -(-size[1] // factor)
