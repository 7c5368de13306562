# SPDX-License-Identifier: Apache-2.0
"""Pictures whose light is computed for every pixel."""

from .exr import exr_channels, write_exr
from .pictures import false_colour_picture, lit_picture
from .render import LARGEST, MOST_RAYS, PATHS, SIZE, Rendering, check_size, fits, render_session

__all__ = [
    "LARGEST",
    "MOST_RAYS",
    "PATHS",
    "SIZE",
    "Rendering",
    "check_size",
    "exr_channels",
    "false_colour_picture",
    "fits",
    "lit_picture",
    "render_session",
    "write_exr",
]
