# SPDX-License-Identifier: Apache-2.0
"""Results: what bakes and updates did, and irradiance as a picklable record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .units import photopic


@dataclass(frozen=True)
class Frame:
    """What a bake, a recompute or an update did.

    Attributes
    ----------
    affected_paths : paths that were traced again (of a bake: all)
    retraced_segments : segments traced
    removed_segments : segments taken away
    scanned_segments, candidates : what the search for affected paths looked at
    milliseconds : wall-clock time by stage
    done : share of the pending work that is finished, 0 to 1
    """

    affected_paths: int = 0
    retraced_segments: int = 0
    removed_segments: int = 0
    scanned_segments: int = 0
    gathered_rays: int = 0
    candidates: int = 0
    milliseconds: Mapping[str, float] = field(default_factory=dict)
    done: float = 1.0


@dataclass(frozen=True, eq=False)
class Result:
    """Irradiance at samples, independent of the session that made it.

    Attributes
    ----------
    points, normals : (n, 3) float64, world, in the present pose
    irradiance, standard_error : (n, 3) float64, in `unit`
    radius : (n,) float64, metres
    unit : "lux" or "W/m2"
    about : how it was made; JSON values
    """

    points: np.ndarray
    normals: np.ndarray
    irradiance: np.ndarray
    standard_error: np.ndarray
    radius: np.ndarray
    unit: str
    about: Mapping[str, Any] = field(default_factory=dict)

    def _repr_html_(self) -> str:
        value = photopic(self.irradiance)
        cells = {
            "samples": f"{len(value):,}",
            "min": f"{value.min():.4g}" if len(value) else "–",
            "mean": f"{value.mean():.4g}" if len(value) else "–",
            "max": f"{value.max():.4g}" if len(value) else "–",
        }
        head = "".join(f"<th>{key}</th>" for key in cells)
        body = "".join(f"<td>{text}</td>" for text in cells.values())
        return f"<table><caption>Irradiance ({self.unit})</caption><tr>{head}</tr><tr>{body}</tr></table>"


@dataclass(frozen=True, eq=False)
class Estimate:
    """What an estimator returns.

    Attributes
    ----------
    irradiance : (n, 3) float64
    sums : (n, 3) int64 or None
        Exact sums in quanta (disc methods); irradiance = sums * quantum / area.
    quantum : float or None
    stats : counts of tests, hits and what else the method does
    """

    irradiance: np.ndarray
    sums: np.ndarray | None = None
    quantum: float | None = None
    stats: Mapping[str, Any] = field(default_factory=dict)
