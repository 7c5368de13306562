# SPDX-License-Identifier: Apache-2.0
"""Results: reports on bakes and updates, and irradiance as a picklable record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .units import photopic


@dataclass(frozen=True)
class Frame:
    """Report on a bake, a recompute or an update.

    Attributes
    ----------
    affected_paths : number of paths that were traced again (in a bake: all)
    retraced_segments : number of segments traced
    removed_segments : number of segments removed
    scanned_segments, candidates : stored segments searched for affected paths, and those tested exactly
    gathered_rays : number of gather rays that were cast, wholly or in part (a shadow ray of their chain)
    changed_rays : of an update, how many of these brought something else than before
    milliseconds : wall-clock time by stage
    done : share of the pending work that is finished, 0 to 1; the least of paths, direct light and gather
    rebake_gain : `Session.rebake_gain` after a recompute; 1 after a bake with lamps and reflectances as they
        were loaded, None after one of others, and after an update, which does
        not take the time to compute it, and in sessions of a `path_range`
    """

    affected_paths: int = 0
    retraced_segments: int = 0
    removed_segments: int = 0
    scanned_segments: int = 0
    gathered_rays: int = 0
    changed_rays: int = 0
    candidates: int = 0
    milliseconds: Mapping[str, float] = field(default_factory=dict)
    done: float = 1.0
    rebake_gain: float | None = None


@dataclass(frozen=True, eq=False)
class Result:
    """Irradiance at samples; does not depend on the session that computed it.

    Attributes
    ----------
    points, normals : (n, 3) float64, world, in the present pose
    irradiance, standard_error : (n, 3) float64, in `unit`
    radius : (n,) float64, metres
    unit : "lux" or "W/m2"
    about : the session's options; JSON values
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
    """Result of an estimator.

    Attributes
    ----------
    irradiance : (n, 3) float64
    sums : (n, 3) int64 or None
        Exact sums in quanta (disc methods); irradiance = sums * quantum / area.
    quantum : float or None
    stats : counts of tests and hits, and further statistics of the method
    """

    irradiance: np.ndarray
    sums: np.ndarray | None = None
    quantum: float | None = None
    stats: Mapping[str, Any] = field(default_factory=dict)
