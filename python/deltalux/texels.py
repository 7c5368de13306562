# SPDX-License-Identifier: Apache-2.0
"""Linear colours of encoded images, which may be broken or hostile; the only reader with Pillow."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from PIL import Image, UnidentifiedImageError

from deltalux.errors import FormatError

FORMATS = ("PNG", "JPEG", "WEBP")
MAX_PIXELS = 8192 * 8192  # a few kilobytes of PNG can expand to gigabytes
MAX_FILE_BYTES = 1 << 30
MOST_SAMPLED = 1024  # blocks along a side of `Texels.sampled`
SEED = 0x7E8E15  # of the texels that are drawn from large images

T = TypeVar("T")


def srgb_to_linear(value: np.ndarray) -> np.ndarray:
    """sRGB values in [0, 1] to linear ones (IEC 61966-2-1)."""
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(value: np.ndarray) -> np.ndarray:
    """The inverse of `srgb_to_linear`."""
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)


LINEAR_OF_BYTE = srgb_to_linear(np.arange(256) / 255)


@dataclass(frozen=True, eq=False)
class Texels:
    """The colours of an image, as far as light depends on them.

    Parameters
    ----------
    mean : (3,) mean of all texels after sRGB decoding, in [0, 1]; ignores alpha
    sampled : (h, w, 1 to 4) uint8, grey or sRGB, with alpha if 2 or 4; of a large image one texel of each
        square block, drawn at random, because means of blocks would mix what lies side by side in an atlas
    """

    mean: np.ndarray
    sampled: np.ndarray

    @property
    def has_gaps(self) -> bool:
        """Whether alpha is below 1 somewhere."""
        return self.sampled.shape[-1] in (2, 4) and bool((self.sampled[..., -1] < 255).any())


def read_texels(data: bytes, where: str) -> Texels:
    """Decode an image once; FormatError if that is impossible."""

    def read(image: Image.Image) -> Texels:
        # Counts per band, alpha last; a converted copy would take twice the memory of a large image.
        bands = np.array(image.histogram(), np.float64).reshape(-1, 256)
        means = bands @ LINEAR_OF_BYTE / bands.sum(axis=1)
        mean = means[:3] if len(means) >= 3 else np.repeat(means[0], 3)
        return Texels(mean, _sampled(image))

    return _decoded(data, where, read)


def _sampled(image: Image.Image) -> np.ndarray:
    """One texel of each block, see `Texels`; read by strips, of which a copy takes little memory."""
    block = -(-max(image.size) // MOST_SAMPLED)
    width, height = (-(-side // block) for side in image.size)
    rng = np.random.default_rng(SEED)
    down, right = rng.integers(0, block, (2, height, width))
    right = np.minimum(np.arange(width) * block + right, image.width - 1)
    strips = []
    for row in range(height):
        top = row * block
        strip = np.asarray(image.crop((0, top, image.width, min(top + block, image.height))))
        strips.append(strip[np.minimum(down[row], len(strip) - 1), right[row]])
    sampled = np.stack(strips).reshape(height, width, -1)
    sampled.setflags(write=False)
    return sampled


def srgb_texels(data: bytes, where: str, most: int, opacity: np.ndarray | None = None) -> np.ndarray:
    """(height, width, 4) uint8 texels of an encoded image: sRGB, and how much each counts, 255 = as a whole.

    An image of more than `most` texels along a side is halved until it has no more, by means in linear light.

    Parameters
    ----------
    opacity : (256,) in [0, 1], by alpha; None = all texels count
    """

    def read(image: Image.Image) -> np.ndarray:
        factor = halving(image.size, most)
        return _weighted(image, opacity) if factor == 1 else _halved(image, factor, opacity)

    return _decoded(data, where, read)


def halving(size: tuple[int, int], most: int) -> int:
    """The power of two that divides an image of this size to at most so many texels along a side."""
    factor = 1
    while max(size) > most * factor:
        factor *= 2
    return factor


def _weighted(image: Image.Image, opacity: np.ndarray | None) -> np.ndarray:
    """The texels of an image, as `srgb_texels` has them."""
    if opacity is None:
        image = image.convert("RGB")
    texels = np.array(image.convert("RGBA"))
    if opacity is not None:
        texels[..., 3] = np.round(255 * opacity)[texels[..., 3]]
    return texels


def linear_texels(data: bytes, where: str, most: int) -> np.ndarray:
    """(height, width, 3) float32: `srgb_texels` after sRGB decoding, in [0, 1]; ignores alpha."""
    return LINEAR_OF_BYTE.astype(np.float32)[srgb_texels(data, where, most)[..., :3]]


def image_size(data: bytes) -> tuple[int, int]:
    """Width and height by the head of an encoded image; 0 if it is broken, of which decoding will tell."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            return Image.open(io.BytesIO(data), formats=FORMATS).size
    except Exception:  # as in _decoded
        return 0, 0


def _halved(image: Image.Image, factor: int, opacity: np.ndarray | None) -> np.ndarray:
    """Means in linear light of blocks of `factor` by `factor` texels; read by strips, as in `_sampled`."""
    linear = LINEAR_OF_BYTE.astype(np.float32)
    beyond = -image.width % factor
    strips = []
    for top in range(0, image.height, factor):
        box = (0, top, image.width, min(top + factor, image.height))
        texels = _weighted(image.crop(box), opacity)
        weight = texels[..., 3:] / np.float32(255)
        strip = np.concatenate([linear[texels[..., :3]] * weight, weight], axis=2).mean(axis=0)
        mean = np.pad(strip, ((0, beyond), (0, 0)), mode="edge")
        strips.append(mean.reshape(-1, factor, 4).mean(axis=1))
    found = np.stack(strips)
    colour = np.divide(
        found[..., :3], found[..., 3:], out=np.zeros_like(found[..., :3]), where=found[..., 3:] > 0
    )
    encoded = np.concatenate([linear_to_srgb(np.clip(colour, 0, 1)), found[..., 3:]], axis=2)
    return np.round(255 * encoded).astype(np.uint8)


def _decoded(data: bytes, where: str, read: Callable[[Image.Image], T]) -> T:
    """What `read` makes of an encoded image of 8 bits per channel."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the size is checked below
            image: Image.Image = Image.open(io.BytesIO(data), formats=FORMATS)
        if image.width * image.height <= MAX_PIXELS:
            if image.mode.startswith("I"):  # 16-bit grey, which Pillow would clip to 255
                image = Image.fromarray((np.asarray(image) >> 8).astype(np.uint8))
            if "transparency" in image.info:  # a palette's or a colour's, without a band of its own
                image = image.convert("RGBA")
            elif image.mode not in ("L", "LA", "RGB", "RGBA"):
                image = image.convert("RGB")
            return read(image)
    except MemoryError:
        raise
    except Exception as error:  # Pillow's decoders raise arbitrary exceptions for broken files
        raise FormatError(
            f"{where}: found an image that cannot be decoded ({_reason(error)}), expected "
            f"{' or '.join(FORMATS)}; export it again"
        ) from None
    raise FormatError(
        f"{where}: found {image.width} x {image.height} pixels, expected at most {MAX_PIXELS}; scale it down"
    )


def _reason(error: Exception) -> str:
    """What a decoder says, without the places of objects in memory."""
    if isinstance(error, UnidentifiedImageError):
        return "of no known format, or cut off"
    return f"{type(error).__name__}: {error}"[:120]
