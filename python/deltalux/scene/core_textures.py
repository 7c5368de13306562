# SPDX-License-Identifier: Apache-2.0
"""Textures on which light depends, as the core has them: each image decoded once, for all that use it."""

from __future__ import annotations

import hashlib
import weakref
from collections.abc import Iterable
from dataclasses import dataclass

from deltalux import _core
from deltalux.errors import FormatError, SceneError
from deltalux.texels import halving, image_size, srgb_texels

from .look import NEAREST, WRAPS, images_of
from .scene import Material

MOST_TEXELS = 2048  # along a side, for light; a larger image is halved
MOST_BYTES = 2**30  # of all textures of a scene
BYTES_PER_TEXEL = 4
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
        self._looks = {m.name: m.look for m in materials if m.look.colour is not None}
        most = self._most = _most_texels(
            images_of(t for look in self._looks.values() for t in look.textures[:1])
        )
        self._size = f"{most} "  # of the images, in their hashes

    def have(self, material: Material) -> bool:
        """Whether light depends on a texture of the material."""
        return material.name in self._looks

    def set_last(self, core: _core.Scene, material: Material) -> None:
        """Give the last material of `core`, which is `material`, its texture, if it has one.

        Raises
        ------
        SceneError
            If the image cannot be decoded, or decodes otherwise than where the session was saved.
        """
        if not self.have(material):
            return
        texture = material.look.textures[0]
        found, texels = self._decode(material)
        kept = material.look.texels
        # Of images that were kept otherwise, as parts of another scene, it says nothing.
        if kept is not None and kept != texels and kept.startswith(self._size):
            raise SceneError(
                f'material "{material.name}": its image decodes to other texels here than where the '
                "session was baked; open it with the version of Pillow of then, or bake it again"
            )
        core.set_texture(
            found,
            tuple(_WRAP_NAMES[wrap] for wrap in texture.wrap),
            texture.mag_filter == NEAREST,
            texture.matrix.tolist(),
            tuple(texture.mean.tolist()),
            material.look.alpha_mode == "MASK",
        )

    def hash_of(self, material: Material) -> str | None:
        """Hash of the texels that the material has in the core; None if it has none."""
        return self._decode(material)[1] if self.have(material) else None

    def _decode(self, material: Material) -> tuple[_core.Texture, str]:
        image, opacity = material.look.textures[0].image, material.look.opacity
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
            self._size + hashlib.blake2b(texels.tobytes(), digest_size=8).hexdigest(),
        )
        _decoded[key] = known
        return found, known.texels


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
