# SPDX-License-Identifier: Apache-2.0
"""Writes light per pixel to an OpenEXR file: data for compositing and evaluation, not display colours."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Mapping

import numpy as np
import OpenEXR

from deltalux.files import written_aside

from .render import Rendering

NOTHING = 0  # value of channel "object" at pixels without a surface


def exr_channels(rendering: Rendering) -> dict[str, np.ndarray]:
    """Channels by name, each (height, width).

    `R`, `G`, `B` are radiance towards the camera, emission included, and `A` is the share of a pixel that
    surfaces cover; these and the layers `irradiance`, `direct`, `indirect` and `albedo` are means over a
    pixel's places, where places without a surface count as 0 (so colours are premultiplied by `A`).
    `normal.X`, `.Y`, `.Z` (world space, facing the camera), `depth` (metres along the camera's axis,
    infinite without a surface) and `object` (0 = no surface, else 1 + the mesh's index in the scene) belong
    to the pixel's centre. Values are single precision, those of `object` 32-bit unsigned integers.
    """
    seen = rendering.seen
    hit = seen.hit[:, None]
    layers = {
        "": rendering.radiance,
        "irradiance.": rendering.irradiance,
        "direct.": rendering.direct,
        "indirect.": rendering.indirect,
        "albedo.": rendering.albedo,
    }
    channels = {"A": rendering.pixels(hit.astype(np.float64))[..., 0]}
    for layer, values in layers.items():
        means = rendering.pixels(np.where(hit, values, 0.0))
        channels |= {f"{layer}{name}": means[..., i] for i, name in enumerate("RGB")}
    normal = rendering.middles(np.where(hit, seen.normal, 0.0))
    channels |= {f"normal.{name}": normal[..., i] for i, name in enumerate("XYZ")}
    pose = np.asarray(rendering.camera.pose, dtype=np.float64)
    along = (pose[:3, 3] - seen.point) @ pose[:3, 2]
    channels["depth"] = rendering.middles(np.where(seen.hit, along, np.inf))
    single = {name: np.ascontiguousarray(values, dtype=np.float32) for name, values in channels.items()}
    number = np.where(seen.hit, seen.mesh + 1, NOTHING).astype(np.uint32)
    return single | {"object": np.ascontiguousarray(rendering.middles(number))}


def write_exr(
    path: str | os.PathLike[str], rendering: Rendering, about: Mapping[str, object] | None = None
) -> None:
    """Write the channels of a rendering, see `exr_channels`.

    Attributes: `objects`, names of the scene's meshes in index order, a JSON list; `unit`, of irradiance;
    `comments`, `about` as JSON.

    Parameters
    ----------
    path : file to write
    rendering : Rendering
    about : origin of the picture

    Raises
    ------
    OSError
        If the file can't be written; an older file of that name is as before.
    """
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "objects": json.dumps([mesh.name for mesh in rendering.scene.meshes]),
        "unit": rendering.scene.unit,
        "comments": json.dumps(dict(about or {})),
    }
    with written_aside(path) as file:
        try:
            # OpenEXR writes to the descriptor, because the file has no name until it is complete.
            OpenEXR.File(header, exr_channels(rendering)).write(f"/proc/self/fd/{file.fileno()}")
        except RuntimeError as error:
            raise OSError(errno.EIO, f"could not be written ({error})") from error
