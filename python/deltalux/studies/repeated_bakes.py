# SPDX-License-Identifier: Apache-2.0
"""Bakes with different seeds: their spread, and predictions of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux.estimate import disc_index
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import Segments, trace
from deltalux.session import Session

from .measuring import measured
from .progress_parts import Steps
from .scene_samples import uniform_on_surfaces
from .seeds import Done, by_seed
from .timing import Timing, median

CHANNEL = 1  # of the irradiance: green
LEAST_SEEDS = 3
LIFT = 1e-3  # height of discs above their surface, as a share of their radius


@dataclass(frozen=True)
class RepeatedBakes:
    """Bakes with different seeds; arrays are (seeds, samples).

    Attributes
    ----------
    irradiance, reported : irradiance of the sessions, and its standard error as they report it
    poisson : standard error predicted from the sum of squared powers
    time : processor time of a full frame
    """

    irradiance: np.ndarray
    reported: np.ndarray
    poisson: np.ndarray
    time: Timing

    def error(self) -> float:
        """RMS over samples of the standard deviation over seeds, relative to the mean irradiance."""
        return float(np.sqrt(self.irradiance.var(axis=0, ddof=1).mean()) / self.irradiance.mean())

    def expected(self, what: str) -> float:
        """The same error, as `reported` or `poisson` predicts it."""
        return float(np.sqrt((getattr(self, what) ** 2).mean()) / self.irradiance.mean())

    def ratio(self, what: str) -> tuple[float, float]:
        """Predicted over observed variance, and its standard error by the jackknife over seeds."""
        predicted = getattr(self, what) ** 2

        def value(keep: np.ndarray) -> float:
            return float(predicted[keep].mean() / self.irradiance[keep].var(axis=0, ddof=1).mean())

        count = len(self.irradiance)
        left_out = [value(np.arange(count) != seed) for seed in range(count)]
        return value(np.full(count, True)), float(np.sqrt((count - 1) * np.var(left_out)))

    def error_of_error(self) -> float:
        """Standard error of `error` by the jackknife over seeds."""
        count = len(self.irradiance)
        parts = [
            np.sqrt(np.delete(self.irradiance, seed, axis=0).var(axis=0, ddof=1).mean())
            for seed in range(count)
        ]
        return float(np.sqrt((count - 1) * np.var(parts)) / self.irradiance.mean())


def enough_seeds(seeds: Sequence[int]) -> list[int]:
    """The seeds, with those after the greatest appended until there are enough for a spread."""
    more = range(max(seeds) + 1, max(seeds) + 1 + LEAST_SEEDS - len(seeds))
    return [*seeds, *more]


def repeated_bakes(
    scene: Scene, paths: int, radius: float, settings: Mapping[str, Any], steps: Steps
) -> RepeatedBakes:
    """Bake once with each of the seeds of `settings`, with whole discs and all light from paths.

    Parameters
    ----------
    scene : Scene
    paths : light paths per bake
    radius : radius of all discs, metres
    settings : with "seeds", and "samples", the number of samples on the static surfaces
    steps : of which each seed is one
    """
    samples = uniform_on_surfaces(scene, settings["samples"], 1, radius, movables=False)

    def baked(seed: int, done: Done) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        options: dict[str, Any] = {"paths": paths, "seed": seed, "direct": "paths", "disc_area": "whole"}
        with Session(scene, samples, **options, threads=1) as session:
            session.bake()
            light = session.irradiance[:, CHANNEL], session.standard_error[:, CHANNEL]
            seconds = measured(session.recompute).cpu_seconds
        poisson = _poisson(trace(scene, paths, seed, threads=settings.get("threads")), samples)
        done()
        return *light, poisson, seconds

    irradiance, reported, poisson, seconds = zip(*by_seed(baked, settings["seeds"], steps), strict=True)
    return RepeatedBakes(np.array(irradiance), np.array(reported), np.array(poisson), median(seconds))


def _poisson(segments: Segments, samples: Samples) -> np.ndarray:
    """Standard error of independent crossings: square root of the sum of squared powers, over the area."""
    squared = Segments(
        segments.origin, segments.direction, segments.length, segments.power**2, segments.extended
    )
    radius = samples.radius
    # For discs in the plane of a wall, rounding would decide which segments cross before they end.
    lifted = Samples(samples.points + LIFT * radius[:, None] * samples.normals, samples.normals, radius)
    squares = disc_index(squared, lifted, segment_end="first").irradiance[:, CHANNEL]
    return np.sqrt(squares / (np.pi * radius**2))
