# SPDX-License-Identifier: Apache-2.0
"""Predicted cost of each disc method on given segments and samples, from a hundredth of the segments."""

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
DRAWN = 10  # segments that the core gets for each that it takes; it spreads these evenly in space


@dataclass(frozen=True)
class MethodCost:
    """What one method will cost, in processor seconds.

    Attributes
    ----------
    method : "brute_force", "disc_index", "ray_map" or "sphere_cache"
    build_seconds : to make the index, or the order of visits
    search_seconds : to find all crossings
    counts : predicted counts, by name; those that the method does not have are 0
    bytes : memory beside samples and segments
    """

    method: str
    build_seconds: float
    search_seconds: float
    counts: Mapping[str, float]
    bytes: int

    @property
    def seconds(self) -> float:
        """Build and search."""
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
    """Predict what each function of `dl.estimate` would cost with its default options.

    A pilot runs each method to its full depth on every hundredth segment (more where that would be
    fewer than 4096), with the least lengths of lists scaled alike; its counts, scaled up, are
    multiplied by the machine's constants.

    Parameters
    ----------
    segments, samples : as of `dl.estimate.disc_index`
    methods : which ones
    segment_end : "first", "second" or "bounded"
    threads : of the pilot; neither counts nor processor seconds depend on it

    Returns
    -------
    dict of MethodCost, by method

    Raises
    ------
    OptionError
        For unknown names, or samples that are no discs of the world.
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
    if "sphere_cache" in methods:  # of all segments: a single one that goes far can set it
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
