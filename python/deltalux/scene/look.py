# SPDX-License-Identifier: Apache-2.0
"""Textures and transparency of materials."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux.errors import SceneError

SIGNATURES = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
WRAPS = (10497, 33071, 33648)  # glTF's numbers, which are OpenGL's: repeat, clamp, mirror
MAG_FILTERS = (None, 9728, 9729)
NEAREST = MAG_FILTERS[1]
MIN_FILTERS = (*MAG_FILTERS, 9984, 9985, 9986, 9987)
ALPHA_MODES = ("OPAQUE", "MASK", "BLEND")
BYTES = np.arange(256) / 255  # alpha of an image
MOST = 1e30  # bound of the numbers of a transform


def media_type(image: bytes) -> str | None:
    """MIME type of an encoded image by its first bytes; None if it is neither PNG, JPEG nor WebP."""
    for signature, name in SIGNATURES.items():
        if image.startswith(signature):
            return name
    return "image/webp" if image[:4] == b"RIFF" and image[8:12] == b"WEBP" else None


@dataclass(frozen=True, eq=False)
class Texture:
    """An image on a surface, as in glTF: (0, 0) is the image's upper left corner, v points down.

    Parameters
    ----------
    image : bytes
        Encoded as PNG, JPEG or WebP, sRGB; textures of one image share one object.
    mean : 3 floats in [0, 1], mean of the linear texels
    wrap : (along u, along v), glTF's numbers
    mag_filter, min_filter : glTF's numbers; None = the viewer's choice
    offset, rotation, scale : KHR_texture_transform, rotation in radians
    by_alpha : texels count by their alpha even where the material is opaque
    """

    image: bytes
    mean: Any
    wrap: tuple[int, int] = (WRAPS[0], WRAPS[0])
    mag_filter: int | None = None
    min_filter: int | None = None
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    scale: tuple[float, float] = (1.0, 1.0)
    by_alpha: bool = False

    def __post_init__(self) -> None:
        if media_type(self.image) is None:
            raise SceneError("texture: found an image of another format, expected PNG, JPEG or WebP")
        mean = np.array(self.mean, np.float64)
        if mean.shape != (3,) or not ((mean >= 0) & (mean <= 1)).all():
            raise SceneError(f"texture: mean: found {self.mean!r:.60}, expected three numbers 0 to 1")
        sampler = (*self.wrap, self.mag_filter, self.min_filter)
        known = (WRAPS, WRAPS, MAG_FILTERS, MIN_FILTERS)
        if len(sampler) != 4 or not all(n in each for n, each in zip(sampler, known, strict=True)):
            raise SceneError(f"texture: sampler: found {sampler!r:.80}, expected glTF's numbers")
        transform = np.array([*self.offset, self.rotation, *self.scale], np.float64)
        if transform.shape != (5,) or not (np.abs(transform) <= MOST).all():
            raise SceneError(f"texture: transform: found {transform}, expected five numbers up to {MOST:g}")
        mean.setflags(write=False)
        object.__setattr__(self, "mean", mean)

    @property
    def matrix(self) -> np.ndarray:
        """(2, 3): takes a surface's coordinates (u, v, 1) to those in the image."""
        (across, down), cosine, sine = self.scale, np.cos(self.rotation), np.sin(self.rotation)
        return np.array(
            [[cosine * across, sine * down, self.offset[0]], [-sine * across, cosine * down, self.offset[1]]]
        )

    def transformed(self, coordinates: np.ndarray) -> np.ndarray:
        """Coordinates (k, 2) in the image of those of a surface (KHR_texture_transform)."""
        matrix = self.matrix
        return coordinates @ matrix[:, :2].T + matrix[:, 2]

    def wrapped(self, place: np.ndarray) -> np.ndarray:
        """Coordinates (k, 2) in the image, brought to 0 to 1 as its edges are wrapped."""
        repeat, clamp, _ = WRAPS
        columns = []
        for axis, wrap in enumerate(self.wrap):
            if wrap == clamp:
                columns.append(np.clip(place[:, axis], 0.0, 1.0))
            elif wrap == repeat:
                columns.append(place[:, axis] % 1.0)
            else:
                columns.append(1.0 - np.abs(place[:, axis] % 2.0 - 1.0))
        return np.stack(columns, axis=1)


@dataclass(frozen=True, eq=False)
class Look:
    """Textures of a material, and its transparency as a file has it.

    Light passes where "MASK" shows nothing; what else it passes, the material's surface says.

    Parameters
    ----------
    colour : Texture or None
        Texture of the reflectance: where a texel has the texture's mean, the surface has the material's
        reflectance. Triangles without texture coordinates have it everywhere, and so have places that alpha
        hides.
    glow : Texture or None
        Texture of the emission, likewise: the material's emission is that of the texture's mean.
    alpha_mode : "OPAQUE", "MASK" or "BLEND"
    alpha : float in [0, 1], multiplies the alpha of `colour`
    alpha_cutoff : float; "MASK" shows texels with at least this alpha
    texels : hash of the texels as they were decoded where a session was saved; None = not known
    """

    colour: Texture | None = None
    glow: Texture | None = None
    alpha_mode: str = "OPAQUE"
    alpha: float = 1.0
    alpha_cutoff: float = 0.5
    texels: str | None = None

    def __post_init__(self) -> None:
        if self.alpha_mode not in ALPHA_MODES:
            raise SceneError(f"alpha_mode: found {self.alpha_mode!r:.40}, expected one of {ALPHA_MODES}")
        if not (0 <= self.alpha <= 1 and 0 <= self.alpha_cutoff <= MOST):
            raise SceneError(
                f"alpha: found {self.alpha}, cutoff {self.alpha_cutoff}; expected 0 to 1, and 0 or more"
            )

    @property
    def textures(self) -> list[Texture]:
        """Those that there are."""
        return [texture for texture in (self.colour, self.glow) if texture is not None]

    @property
    def opacity(self) -> np.ndarray | None:
        """(256,) weights of the colour's texels by their alpha, as glTF shows them; None = all alike."""
        if self.alpha_mode == "MASK":
            return (BYTES * self.alpha >= self.alpha_cutoff).astype(np.float64)
        by_alpha = self.colour is not None and self.colour.by_alpha
        return BYTES if by_alpha or self.alpha_mode == "BLEND" else None


PLAIN = Look()


def images_of(textures: Iterable[Texture]) -> list[bytes]:
    """The images of textures, every image once."""
    return list({id(texture.image): texture.image for texture in textures}.values())


def checked_coordinates(values: Any, triangles: int, what: str) -> np.ndarray:
    """Read-only float32 (triangles, 3, 2) of corners, NaN = none; copied unless already read-only."""
    frozen = isinstance(values, np.ndarray) and values.dtype == np.float32 and not values.flags.writeable
    array = values if frozen else np.array(values, np.float32)
    if array.shape != (triangles, 3, 2) or np.isinf(array).any():
        raise SceneError(
            f"{what}: coordinates: found shape {array.shape}, expected ({triangles}, 3, 2), finite or NaN"
        )
    array.setflags(write=False)
    return array
