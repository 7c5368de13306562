# SPDX-License-Identifier: Apache-2.0
"""Textures of a glTF document: encoded images, their colours, samplers and transforms."""

from __future__ import annotations

from typing import Any

from deltalux.io.diagnostics import element, malformed
from deltalux.scene.look import MAG_FILTERS, MIN_FILTERS, WRAPS, Texture
from deltalux.texels import FORMATS, MAX_FILE_BYTES, Texels, read_texels

from .buffers import Buffers, read_uri
from .document import Document

TRANSFORM = "KHR_texture_transform"


class Textures:
    """Reads and decodes each image once."""

    def __init__(self, document: Document, buffers: Buffers) -> None:
        self._document = document
        self._buffers = buffers
        self._images: dict[int, tuple[bytes, Texels]] = {}
        self._texels: dict[int, Texels] = {}  # by the identity of the encoded image

    def texture(self, reference: Any, where: str) -> Texture:
        """The texture that a material's record `reference` refers to, with the mean of its whole image.

        Raises FormatError if there is no image that can be decoded.
        """
        index = reference.index
        texture = element(self._document.gltf.textures, index, f"{where}.index")
        image, texels = self._image(texture, index)
        sampler = None
        if texture.sampler is not None:
            sampler = element(self._document.gltf.samplers, texture.sampler, f"textures[{index}].sampler")
        transform = reference.extensions.get(TRANSFORM, {})
        return Texture(
            image,
            texels.mean,
            (_known(sampler, "wrapS", WRAPS), _known(sampler, "wrapT", WRAPS)),
            _known(sampler, "magFilter", MAG_FILTERS),
            _known(sampler, "minFilter", MIN_FILTERS),
            tuple(transform.get("offset", (0.0, 0.0))),
            transform.get("rotation", 0.0),
            tuple(transform.get("scale", (1.0, 1.0))),
        )

    def texels(self, texture: Texture) -> Texels:
        """The colours of a texture that was read here."""
        return self._texels[id(texture.image)]

    def _image(self, texture: Any, index: int) -> tuple[bytes, Texels]:
        """The encoded bytes, and their colours."""
        webp = texture.extensions.get("EXT_texture_webp", {}).get("source")
        source = webp if webp is not None else texture.source
        if source is None:
            others = ", ".join(sorted(texture.extensions)) or "no image"
            raise malformed(
                f"textures[{index}]", others, f"an image of {' or '.join(FORMATS)}", "convert the texture"
            )
        if source not in self._images:
            image = element(self._document.gltf.images, source, f"textures[{index}].source")
            place = f"images[{source}]"
            if image.uri is not None:
                data = read_uri(self._document.path.parent, image.uri, place, MAX_FILE_BYTES)
            elif image.bufferView is not None:
                data = bytes(self._buffers.view(image.bufferView, place))
            else:
                raise malformed(place, "no data", "a uri or a bufferView")
            self._images[source] = data, read_texels(data, place)
            self._texels[id(data)] = self._images[source][1]
        return self._images[source]


def _known(sampler: Any, name: str, values: tuple[Any, ...]) -> Any:
    """A sampler's number; the first of `values` (the default) if it is none of them."""
    number = getattr(sampler, name, None)
    return number if number in values else values[0]
