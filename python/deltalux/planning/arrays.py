# SPDX-License-Identifier: Apache-2.0
"""Predicted cost of each disc method for given segments and samples, from a hundredth of the segments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from deltalux import _core
from deltalux.errors import OptionError
from deltalux.estimate.inputs import SEGMENT_ENDS, check_choice, check_discs, core_discs, core_segments
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, check_threads

from .machine import machine_constants

METHODS: tuple[str, ...] = _core.METHODS
DRAWN = 10  # candidate segments per segment that the core selects, evenly in space


@dataclass(frozen=True)
class MethodCost:
    """Predicted cost of one method, in processor seconds.

    Attributes
    ----------
    method : "brute_force", "disc_index", "ray_map" or "sphere_cache"
    build_seconds : to build the index, or to sort the samples into visiting order
    search_seconds : to find all crossings
    counts : predicted counts, by name; 0 for those that the method does not have
    bytes : memory in addition to samples and segments
    """

    method: str
    build_seconds: float
    search_seconds: float
    counts: Mapping[str, float]
    bytes: int

    @property
    def seconds(self) -> float:
        """Build and search together."""
        return self.build_seconds + self.search_seconds


def predict(
    segments: Segments,
    samples: Samples,
    methods: Sequence[str] = METHODS,
    *,
    segment_end: str = "bounded",
    threads: int | None = None,
    progress: Progress | None = None,
) -> dict[str, MethodCost]:
    """Predict the cost of each function of `dl.estimate` with its default options.

    A pilot runs each method at full depth on every hundredth segment (more segments if that were fewer
    than 4096), with minimum list lengths scaled likewise; its counts, scaled up, are multiplied by the
    machine's constants.

    Parameters
    ----------
    segments, samples : as in `dl.estimate.disc_index`
    methods : methods to predict
    segment_end : "first", "second" or "bounded"
    threads : of the pilot; they influence neither counts nor processor seconds

    Returns
    -------
    dict of MethodCost, by method

    Raises
    ------
    OptionError
        For unknown names, or samples that are not discs in world space.
    """
    check_choice("segment_end", segment_end, SEGMENT_ENDS)
    for method in methods:
        check_choice("methods", method, METHODS)
    check_discs(samples)
    check_threads(threads)
    if not len(segments) or not len(samples):
        raise OptionError("predict: found no segments or no samples, expected at least one of each")
    machine = machine_constants(progress)
    wanted = DRAWN * int(max(_core.LEAST_PILOT, -(-len(segments) // _core.PILOT_DIVISOR)))
    step = max(1, len(segments) // wanted)
    drawn = core_segments(segments.select(slice(step // 2, None, step)))
    outer = 0.0
    if "sphere_cache" in methods:  # of all segments: a single long one can determine it
        outer = _core.enclosing_radius(core_segments(segments), segment_end, samples.radius.max())
    pilot = _core.Pilot(core_discs(samples, segments), segment_end, threads or 0)
    total, discs = float(len(segments)), float(len(samples))
    costs = {}
    for method in methods:
        counts = pilot.count(method, drawn, total, total, outer, progress)
        build, search = _core.predicted_seconds(method, counts, discs, total, machine)
        size = int(_core.method_bytes(method, discs, total))
        costs[method] = MethodCost(method, build, search, counts, size)
    return costs
