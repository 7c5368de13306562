# SPDX-License-Identifier: Apache-2.0
"""Linear colours of encoded images, which may be broken or hostile; the only reader with Pillow."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable

import numpy as np
from PIL import Image, UnidentifiedImageError

from deltalux.errors import FormatError

FORMATS = ("PNG", "JPEG", "WEBP")
MAX_PIXELS = 8192 * 8192  # a few kilobytes of PNG can expand to gigabytes
MAX_FILE_BYTES = 1 << 30


def srgb_to_linear(value: np.ndarray) -> np.ndarray:
    """sRGB values in [0, 1] to linear ones (IEC 61966-2-1)."""
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(value: np.ndarray) -> np.ndarray:
    """The inverse of `srgb_to_linear`."""
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)


LINEAR_OF_BYTE = srgb_to_linear(np.arange(256) / 255)


def mean_linear_texel(data: bytes, where: str) -> np.ndarray:
    """(3,) mean of an encoded image's texels after sRGB decoding, in [0, 1]; ignores alpha."""
    # Counts per band, alpha last; a converted copy would take twice the memory of a large image.
    histogram = _decoded(data, where, lambda image: np.array(image.histogram(), np.float64))
    bands = histogram.reshape(-1, 256)
    means = bands @ LINEAR_OF_BYTE / bands.sum(axis=1)
    return means[:3] if len(means) >= 3 else np.repeat(means[0], 3)


def linear_texels(data: bytes, where: str, most: int) -> np.ndarray:
    """(height, width, 3) float32 texels of an encoded image after sRGB decoding, in [0, 1]; ignores alpha.

    An image of more than `most` texels along a side is halved until it has no more.
    """

    def read(image: Image.Image) -> np.ndarray:
        factor = 1
        while max(image.size) > most * factor:
            factor *= 2
        return np.asarray(image.convert("RGB").reduce(factor))

    return LINEAR_OF_BYTE.astype(np.float32)[_decoded(data, where, read)]


def _decoded(data: bytes, where: str, read: Callable[[Image.Image], np.ndarray]) -> np.ndarray:
    """What `read` makes of an encoded image of 8 bits per channel."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the size is checked below
            image: Image.Image = Image.open(io.BytesIO(data), formats=FORMATS)
        if image.width * image.height <= MAX_PIXELS:
            if image.mode.startswith("I"):  # 16-bit grey, which Pillow would clip to 255
                image = Image.fromarray((np.asarray(image) >> 8).astype(np.uint8))
            if image.mode not in ("L", "LA", "RGB", "RGBA"):
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
