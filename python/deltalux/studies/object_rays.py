# SPDX-License-Identifier: Apache-2.0
"""Costs of both methods for the rays that meet an object in the unit sphere: its own and static samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from deltalux.estimate import disc_index, sphere_cache
from deltalux.estimate.inputs import core_segments
from deltalux.samples import Samples
from deltalux.segments import Segments, uniform_lines

from .moved_scene import joined
from .timing import Timing, interleaved
from .uniform_samples import in_cube

BOXES = 8  # boxes that a node of the disc index tests at once
CACHE = "sphere cache, object's rays"
INDEX, INDEX_REBUILT = "disc index built once, all rays", "disc index built each frame, all rays"
INDEX_OWN, INDEX_OWN_REBUILT = (f"disc index built {when}, object's rays" for when in ("once", "each frame"))
COUNTED = (CACHE, INDEX, INDEX_OWN)
TIMED = (CACHE, INDEX_REBUILT, INDEX, INDEX_OWN_REBUILT, INDEX_OWN)
STATIC_CACHE, STATIC_INDEX = "sphere cache, old and new rays", "disc index built once, old and new rays"
NEW_SEED = 1_000_003  # added to the seed for the rays that come after a move


def moving_counts(size: float, seed: int, settings: Mapping[str, Any]) -> dict[str, float]:
    """Number of tests by each method for the samples on an object of this size.

    Parameters
    ----------
    size : r_D / r_0
    seed : seed of lines, samples and the object's place
    settings : settings of `moving-object`
    """
    lines = uniform_lines(settings["lines"], seed)
    samples, centre = _object(size, seed, settings)
    own, threads = _own_rays(lines, centre, size), settings.get("threads")
    return {
        CACHE: _cache_tests(own, samples, size, settings, threads),
        INDEX: _index_tests(lines, samples, threads),
        INDEX_OWN: _index_tests(own, samples, threads),
    }


def moving_times(size: float, settings: Mapping[str, Any]) -> dict[str, Timing]:
    """Processor time of one frame by each method, without converting the rays for the core.

    Parameters as of `moving_counts`, with the first of its seeds.
    """
    seed = settings["seeds"][0]
    lines = uniform_lines(settings["lines"], seed)
    samples, centre = _object(size, seed, settings)
    own, one = _own_rays(lines, centre, size), lines.select(slice(0, 1))
    taken = interleaved(
        {
            "hand_all": lambda: core_segments(lines),
            "hand_own": lambda: core_segments(own),
            "build": lambda: _index(one, samples, 1),
            "cache": lambda: _cache(own, samples, size, settings, 1),
            "index": lambda: _index(lines, samples, 1),
            "index_own": lambda: _index(own, samples, 1),
        },
        settings["repetitions"],
    )
    rebuilt, own_rebuilt = taken["index"] - taken["hand_all"], taken["index_own"] - taken["hand_own"]
    return {
        CACHE: taken["cache"] - taken["hand_own"],
        INDEX_REBUILT: rebuilt,
        INDEX: rebuilt - taken["build"],
        INDEX_OWN_REBUILT: own_rebuilt,
        INDEX_OWN: own_rebuilt - taken["build"],
    }


def static_counts(size: float, seed: int, settings: Mapping[str, Any]) -> dict[str, float]:
    """Tests for static samples in the unit sphere when an object moves; parameters as of `moving_counts`."""
    rays, samples, threads = *_static(size, seed, settings), settings.get("threads")
    return {
        STATIC_CACHE: _cache_tests(rays, samples, 1.0, settings, threads),
        STATIC_INDEX: _index_tests(rays, samples, threads),
    }


def static_times(size: float, settings: Mapping[str, Any]) -> dict[str, Timing]:
    """Processor time of the same, without converting the rays and without building the index."""
    rays, samples = _static(size, settings["seeds"][0], settings)
    one = rays.select(slice(0, 1))
    taken = interleaved(
        {
            "hand": lambda: core_segments(rays),
            "build": lambda: _index(one, samples, 1),
            "cache": lambda: _cache(rays, samples, 1.0, settings, 1),
            "index": lambda: _index(rays, samples, 1),
        },
        settings["repetitions"],
    )
    return {
        STATIC_CACHE: taken["cache"] - taken["hand"],
        STATIC_INDEX: taken["index"] - taken["hand"] - taken["build"],
    }


def _static(size: float, seed: int, settings: Mapping[str, Any]) -> tuple[Segments, Samples]:
    """Rays that meet the object before and after a move, and static samples."""
    _, centre = _object(size, seed, settings)
    old, new = (
        _own_rays(uniform_lines(settings["lines"], number), centre, size)
        for number in (seed, seed + NEW_SEED)
    )
    return joined(old, new), in_cube(settings["samples"], "volume", seed)


def _object(size: float, seed: int, settings: Mapping[str, Any]) -> tuple[Samples, np.ndarray]:
    """Discs of an object at a random place in the unit sphere, and the centre of its bounding sphere."""
    rng = np.random.default_rng([seed, round(1e6 * size)])
    towards = rng.normal(size=3)
    centre = (1 - size) * rng.random() ** (1 / 3) * towards / np.linalg.norm(towards)
    unit = in_cube(settings["samples"], "volume", seed)
    return Samples(centre + size * unit.points, unit.normals, size * unit.radius), centre


def _own_rays(lines: Segments, centre: np.ndarray, radius: float) -> Segments:
    """The lines that meet the object's sphere; chords of S_0 never end inside it."""
    away = lines.origin - centre
    along = (away * lines.direction).sum(axis=1, keepdims=True)
    return lines.select(((away - along * lines.direction) ** 2).sum(axis=1) <= radius**2)


def _cache(
    rays: Segments, samples: Samples, size: float, settings: Mapping[str, Any], threads: int | None
) -> Mapping[str, Any]:
    return sphere_cache(
        rays,
        samples,
        ratio=settings["ratio"],
        min_rays=settings["min_rays"],
        outer_sphere=((0, 0, 0), size),
        threads=threads,
    ).stats


def _cache_tests(
    rays: Segments, samples: Samples, size: float, settings: Mapping[str, Any], threads: int | None
) -> float:
    found = _cache(rays, samples, size, settings, threads)
    return found["sphere_tests"] + found["disc_tests"]


def _index(rays: Segments, samples: Samples, threads: int | None) -> Mapping[str, Any]:
    return disc_index(rays, samples, threads=threads).stats


def _index_tests(rays: Segments, samples: Samples, threads: int | None) -> float:
    found = _index(rays, samples, threads)
    return BOXES * found["node_tests"] + found["disc_tests"]
