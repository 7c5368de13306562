# SPDX-License-Identifier: Apache-2.0
"""Textures of a glTF document, each as its mean linear colour."""

from __future__ import annotations

import numpy as np

from .diagnostics import element, malformed
from .gltf_buffers import Buffers, read_uri
from .gltf_document import Document
from .texels import FORMATS, MAX_FILE_BYTES, mean_linear_texel


class Textures:
    """Averages each image once."""

    def __init__(self, document: Document, buffers: Buffers) -> None:
        self._document = document
        self._buffers = buffers
        self._means: dict[int, np.ndarray] = {}

    def mean(self, index: int, where: str) -> np.ndarray:
        """(3,) mean of the linear texels; alpha is not regarded."""
        texture = element(self._document.gltf.textures, index, f"{where}.index")
        webp = texture.extensions.get("EXT_texture_webp", {}).get("source")
        source = webp if webp is not None else texture.source
        if source is None:
            others = ", ".join(sorted(texture.extensions)) or "no image"
            raise malformed(
                f"textures[{index}]", others, f"an image of {' or '.join(FORMATS)}", "convert the texture"
            )
        if source not in self._means:
            image = element(self._document.gltf.images, source, f"textures[{index}].source")
            place = f"images[{source}]"
            if image.uri is not None:
                data = read_uri(self._document.path.parent, image.uri, place, MAX_FILE_BYTES)
            elif image.bufferView is not None:
                data = bytes(self._buffers.view(image.bufferView, place))
            else:
                raise malformed(place, "no data", "a uri or a bufferView")
            self._means[source] = mean_linear_texel(data, place)
        return self._means[source]
