# SPDX-License-Identifier: Apache-2.0
"""Unlit materials of a .glb with their textures, samplers and images, each once."""

from __future__ import annotations

from typing import Any

import pygltflib as gl

from deltalux.scene import Material, PaneSurface
from deltalux.scene.look import Texture, media_type

from .gltf_binary import Binary
from .shown_looks import Shown

# Keys of a material's extras: what it reflects, where the base colour alone does not say it; parameters of a
# `PaneSurface`.
REFLECTANCE, PANE = "deltalux_reflectance", "deltalux_pane"
UNLIT, TRANSFORM, WEBP = "KHR_materials_unlit", "KHR_texture_transform", "EXT_texture_webp"


class GltfMaterials:
    """Adds materials to `document`, and their images to `binary`."""

    def __init__(self, document: gl.GLTF2, binary: Binary) -> None:
        self._document, self._binary = document, binary
        self._images: dict[int, int] = {}
        self._samplers: dict[tuple[Any, ...], int] = {}
        self._textures: dict[tuple[int, int], int] = {}
        document.extensionsUsed.append(UNLIT)

    def add(self, material: Material, shown: Shown) -> int:
        """Add a material and return its index."""
        look = material.look
        told = not material.emissive and bool((shown.reflected == 1).all())
        pane = material.surface if isinstance(material.surface, PaneSurface) else None
        mode, alpha, base = look.alpha_mode, look.alpha, shown.base
        if pane is not None:
            base = shown.base * pane.scattered
            if mode != "MASK":
                mode, alpha = "BLEND", 1 - pane.passes
        covers = mode == "OPAQUE"
        extras: dict[str, Any] = {} if told and pane is None else {REFLECTANCE: material.reflectance.tolist()}
        if pane is not None:
            extras[PANE] = list(pane.parameters())
        self._document.materials.append(
            gl.Material(
                name=material.name,
                pbrMetallicRoughness=gl.PbrMetallicRoughness(
                    baseColorFactor=[*base.tolist(), 1.0 if covers else alpha],
                    baseColorTexture=None if shown.texture is None else self._texture(shown.texture),
                    metallicFactor=0.0,
                    roughnessFactor=1.0,
                ),
                extensions={UNLIT: {}},
                extras=extras,
                alphaMode=None if covers else mode,
                alphaCutoff=look.alpha_cutoff if mode == "MASK" else None,
            )
        )
        return len(self._document.materials) - 1

    def _texture(self, texture: Texture) -> gl.TextureInfo:
        image, sampler = self._image(texture.image), self._sampler(texture)
        key = (image, sampler)
        if key not in self._textures:
            added = gl.Texture(sampler=sampler, source=image)
            if media_type(texture.image) == "image/webp":
                self._use(WEBP, required=True)
                added = gl.Texture(sampler=sampler, extensions={WEBP: {"source": image}})
            self._textures[key] = len(self._document.textures)
            self._document.textures.append(added)
        info = gl.TextureInfo(index=self._textures[key], texCoord=None)
        transform = (texture.offset, texture.rotation, texture.scale)
        if transform != ((0, 0), 0, (1, 1)):
            self._use(TRANSFORM)
            info.extensions = {
                TRANSFORM: {
                    "offset": list(texture.offset),
                    "rotation": texture.rotation,
                    "scale": list(texture.scale),
                }
            }
        return info

    def _image(self, image: bytes) -> int:
        if id(image) not in self._images:
            self._images[id(image)] = len(self._document.images)
            self._document.images.append(
                gl.Image(bufferView=self._binary.view(image), mimeType=media_type(image))
            )
        return self._images[id(image)]

    def _sampler(self, texture: Texture) -> int:
        numbers = (texture.mag_filter, texture.min_filter, *texture.wrap)
        if numbers not in self._samplers:
            self._samplers[numbers] = len(self._document.samplers)
            names = ("magFilter", "minFilter", "wrapS", "wrapT")
            self._document.samplers.append(gl.Sampler(**dict(zip(names, numbers, strict=True))))
        return self._samplers[numbers]

    def _use(self, name: str, required: bool = False) -> None:
        lists = [self._document.extensionsUsed, *([self._document.extensionsRequired] if required else [])]
        for names in lists:
            if name not in names:
                names.append(name)
