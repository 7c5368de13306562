# SPDX-License-Identifier: Apache-2.0
"""Textures in pictures: how the colour where a ray hits compares with the mean that light depends on."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from deltalux.mesh.surfaces import Surfaces
from deltalux.scene.look import NEAREST, WRAPS, Texture
from deltalux.texels import linear_texels, srgb_texels

from .texture_coordinates import TextureCoordinates, by_mesh

REPEAT, CLAMP, _ = WRAPS
MOST_TEXELS = 4096  # along a side; a larger image is halved
MOST_FACTOR = 1e3  # of a texel on the mean: black textures with a few bright texels


class Mipmap:
    """An image at its own size, and halved until it is one texel, so that a pixel reads few of them.

    Parameters
    ----------
    texels : (height, width, 3) linear
    """

    def __init__(self, texels: np.ndarray) -> None:
        self.levels = [texels.astype(np.float32)]
        while max(self.levels[-1].shape[:2]) > 1:
            self.levels.append(_halved(self.levels[-1]))

    def __call__(self, texture: Texture, place: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Colours (k, 3) at texture coordinates (k, 2), each averaged over 2**level texels along a side."""
        level = np.clip(level, 0, len(self.levels) - 1)
        below = level.astype(int)
        share = (level - below)[:, None]
        found = np.zeros((len(place), 3))
        for number, texels in enumerate(self.levels):
            for first, weight in ((number, 1 - share), (number - 1, share)):
                rows = np.flatnonzero((below == first) & (weight[:, 0] > 0))
                if len(rows):
                    found[rows] += weight[rows] * _sampled(texels, texture, place[rows], number)
        return found


def _halved(texels: np.ndarray) -> np.ndarray:
    """Means of two by two texels; an odd row or column at the end counts twice."""
    height, width = texels.shape[:2]
    even = np.pad(texels, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    return even.reshape((height + 1) // 2, 2, (width + 1) // 2, 2, 3).mean(axis=(1, 3))


def _sampled(texels: np.ndarray, texture: Texture, place: np.ndarray, level: int) -> np.ndarray:
    """Bilinear between texels, or the nearest one if the texture asks for that and none is averaged."""
    sizes = np.array(texels.shape[1::-1])
    at = place * sizes
    if texture.mag_filter == NEAREST and level == 0:
        column, row = (_wrapped(np.floor(at[:, i]), sizes[i], texture.wrap[i]) for i in (0, 1))
        return texels[row, column]
    first = np.floor(at - 0.5)
    share = at - 0.5 - first
    found = np.zeros((len(place), 3))
    for right in (0, 1):
        for down in (0, 1):
            column = _wrapped(first[:, 0] + right, sizes[0], texture.wrap[0])
            row = _wrapped(first[:, 1] + down, sizes[1], texture.wrap[1])
            weight = np.abs(1 - right - share[:, 0]) * np.abs(1 - down - share[:, 1])
            found += weight[:, None] * texels[row, column]
    return found


def _wrapped(number: np.ndarray, size: int, wrap: int) -> np.ndarray:
    if wrap == CLAMP:
        return np.clip(number, 0, size - 1).astype(int)
    if wrap == REPEAT:
        return np.mod(number, size).astype(int)
    mirrored = np.mod(number, 2 * size)
    return np.where(mirrored < size, mirrored, 2 * size - 1 - mirrored).astype(int)


class ShownTextures:
    """Factors of the textures of a scene's materials, where rays hit its display mesh."""

    def __init__(self, surfaces: Surfaces) -> None:
        self._surfaces = surfaces
        self._images: dict[int, Mipmap] = {}
        self._opacities: dict[int, np.ndarray] = {}  # (h, w, 3), all alike, by material

    @cached_property
    def _coordinates(self) -> TextureCoordinates:
        return TextureCoordinates(self._surfaces.scene, self._surfaces.display)

    def factors(
        self, triangle: np.ndarray, weights: np.ndarray, width: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Factors (k, 3) on the reflectance and on the emission of the materials there; 1 without a texture.

        Parameters
        ----------
        triangle : (k,) of the display mesh; -1 = nothing was hit
        weights : (k, 3) of its corners
        width : (k,) metres that a pixel spans there
        """
        colour, glow = np.ones((len(triangle), 3)), np.ones((len(triangle), 3))
        display, scene = self._surfaces.display, self._surfaces.scene
        material = np.where(triangle >= 0, display.triangle_material[triangle], -1)
        mesh = display.triangle_mesh[triangle]
        for number, own in enumerate(scene.materials):
            if not own.look.textures:
                continue
            seen = np.flatnonzero(material == number)
            for rows in by_mesh(seen, mesh[seen]):
                corners = self._coordinates.of(triangle[rows]).astype(np.float64)
                for texture, found in ((own.look.colour, colour), (own.look.glow, glow)):
                    if texture is not None:
                        found[rows] = self._factor(
                            texture, corners, triangle[rows], weights[rows], width[rows]
                        )
                if own.look.colour is not None:
                    contrast = self._contrast(own.look.colour, own.reflectance)
                    colour[rows] = 1 + contrast * (colour[rows] - 1)
        return colour, glow

    def opacity(self, material: int, triangle: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """How much of a surface there is at places of triangles of a material, by its texture's alpha: (k,).

        0 or 1 where it is cut out; 1 without texture coordinates. Parameters: see `factors`.
        """
        look = self._surfaces.scene.materials[material].look
        found = np.ones(len(triangle))
        if look.colour is None or look.opacity is None:
            return found
        if material not in self._opacities:
            texels = srgb_texels(look.colour.image, "texture", MOST_TEXELS, look.opacity)
            self._opacities[material] = np.repeat(texels[..., 3:] / np.float32(255), 3, axis=2)
        mesh = self._surfaces.display.triangle_mesh[triangle]
        for rows in by_mesh(np.arange(len(triangle)), mesh):
            corners = self._coordinates.of(triangle[rows]).astype(np.float64)
            place = look.colour.transformed(np.einsum("kc,kcx->kx", weights[rows], corners))
            known = np.isfinite(place).all(axis=1)
            found[rows[known]] = _sampled(self._opacities[material], look.colour, place[known], 0)[:, 0]
        return (found >= 0.5).astype(float) if look.alpha_mode == "MASK" else found

    def _contrast(self, texture: Texture, reflectance: np.ndarray) -> np.ndarray:
        """(3,) share of the differences between texels that a reflectance leaves, as in light.

        Less than 1 where the brightest texel would reflect more than it receives.
        """
        brightest = self._image(texture).levels[0].max(axis=(0, 1))
        most = np.divide(brightest, texture.mean, out=np.ones(3), where=texture.mean > 0)
        bright = reflectance * most > 1
        share = np.divide(1 / np.maximum(reflectance, 1e-30) - 1, most - 1, out=np.ones(3), where=bright)
        return np.clip(share, 0, 1)

    def _factor(
        self,
        texture: Texture,
        corners: np.ndarray,
        triangle: np.ndarray,
        weights: np.ndarray,
        width: np.ndarray,
    ) -> np.ndarray:
        image = self._image(texture)
        place = texture.transformed(corners.reshape(-1, 2)).reshape(-1, 3, 2)
        ab, ac = place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]
        texels = np.prod(image.levels[0].shape[:2]) * np.abs(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
        points = self._surfaces.points[self._surfaces.display.triangles[triangle]]
        sides = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
        area = np.maximum(np.linalg.norm(sides, axis=1), 1e-30)
        spanned = width * np.sqrt(texels / area)  # texels along a pixel
        at = np.einsum("kc,kcx->kx", weights, place)
        known = np.isfinite(at).all(axis=1) & np.isfinite(spanned)
        found = np.ones((len(at), 3))
        level = np.log2(np.maximum(spanned[known], 1.0))
        mean = texture.mean
        shown = np.divide(
            image(texture, at[known], level), mean, out=np.ones((known.sum(), 3)), where=mean > 0
        )
        found[known] = np.minimum(shown, MOST_FACTOR)
        return found

    def _image(self, texture: Texture) -> Mipmap:
        if id(texture.image) not in self._images:
            self._images[id(texture.image)] = Mipmap(linear_texels(texture.image, "texture", MOST_TEXELS))
        return self._images[id(texture.image)]
