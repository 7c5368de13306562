# SPDX-License-Identifier: Apache-2.0
"""Mean linear colour of an encoded image, which may be broken or hostile; the only reader with Pillow."""

from __future__ import annotations

import io
import warnings

import numpy as np
from PIL import Image

from .diagnostics import malformed

FORMATS = ("PNG", "JPEG", "WEBP")
MAX_PIXELS = 8192 * 8192  # a few kilobytes of PNG can expand to gigabytes
MAX_FILE_BYTES = 1 << 30


def srgb_to_linear(value: np.ndarray) -> np.ndarray:
    """sRGB values in [0, 1] to linear ones (IEC 61966-2-1)."""
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


LINEAR_OF_BYTE = srgb_to_linear(np.arange(256) / 255)


def mean_linear_texel(data: bytes, where: str) -> np.ndarray:
    """(3,) mean of an encoded image's texels after sRGB decoding, in [0, 1]; ignores alpha."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the size is checked below
            image: Image.Image = Image.open(io.BytesIO(data), formats=FORMATS)
        if image.width * image.height <= MAX_PIXELS:
            if image.mode.startswith("I"):  # 16-bit grey, which Pillow would clip to 255
                image = Image.fromarray((np.asarray(image) >> 8).astype(np.uint8))
            if image.mode not in ("L", "LA", "RGB", "RGBA"):
                image = image.convert("RGB")
            # Counts per band, alpha last; a converted copy would take twice the memory of a large image.
            histogram = np.array(image.histogram(), np.float64).reshape(-1, 256)
            means = histogram @ LINEAR_OF_BYTE / histogram.sum(axis=1)
            return means[:3] if len(means) >= 3 else np.repeat(means[0], 3)
    except MemoryError:
        raise
    except Exception as error:  # Pillow's decoders raise arbitrary exceptions for broken files
        found = f"an image that cannot be decoded ({error!r:.120})"
        raise malformed(where, found, " or ".join(FORMATS)) from None
    raise malformed(where, f"{image.width} x {image.height} pixels", f"at most {MAX_PIXELS}", "scale it down")
