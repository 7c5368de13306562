# SPDX-License-Identifier: Apache-2.0
"""Radius of discs that segments cross as often as a benchmark wants."""

from __future__ import annotations

import deltalux as dl
import numpy as np


def radius_for_hits(scene: dl.Scene, count: int, hits: float) -> float:
    """Disc radius for which a segment's end crosses `hits` of `count` uniform discs on average."""
    area = sum(float(m.triangle_areas().sum()) for m in scene.meshes)
    return float(np.sqrt(hits * area / (np.pi * count)))
