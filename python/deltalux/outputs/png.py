# SPDX-License-Identifier: Apache-2.0
"""Writes results as .png files, depending on where the samples are."""

from __future__ import annotations

import os
from dataclasses import replace

from deltalux.units import photopic

from .baked import Baked, about_text, display_of, keep_inputs
from .images import render
from .plans import grid_picture, plan_axes


def write_png(path: str | os.PathLike[str], baked: Baked) -> None:
    """Write the picture that suits the samples: the scene, or the plan of a grid."""
    keep_inputs(path, baked)
    result = baked.result
    if baked.display is None and baked.grid is not None:
        values = baked.grid.in_grid(photopic(result.irradiance))
        picture = grid_picture(values, result.unit, axes=plan_axes(baked.grid))
    else:
        picture = render(
            baked.scene, display_of(baked, ".png"), result.irradiance, poses=baked.poses, camera=baked.camera,
            size=baked.size, exposure=baked.exposure, stops=baked.stops, false_colour=baked.false_colour,
            threads=baked.threads, beyond=baked.beyond,
        )  # fmt: skip
    replace(picture, about=about_text(result)).save(path)
