# SPDX-License-Identifier: Apache-2.0
"""The ray map: a kd-tree over segments that is refined where queries reach it (Havran et al. 2005)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from deltalux import _core
from deltalux.errors import OptionError
from deltalux.results import Estimate
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, check_threads

from .inputs import (
    FARTHEST,
    SEGMENT_ENDS,
    check_choice,
    check_discs,
    check_world_points,
    core_discs,
    core_segments,
    disc_estimate,
    select_segments,
)

METRICS = ("hit", "crossing", "line")
LEAF_SIZE = 32
MOST_QUANTA = 2**32 - 1


def ray_map(
    segments: Segments,
    samples: Samples,
    metric: str = "disc",
    k: int | None = None,
    *,
    unbiased: bool = True,
    leaf_size: int = LEAF_SIZE,
    memory_limit: int | None = None,
    segment_end: str = "bounded",
    first_bounce: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Estimate:
    """Irradiance by a kd-tree over the segments; a leaf is split when a sample's query visits it.

    Parameters
    ----------
    segments : Segments
    samples : Samples in world space; for "disc" with radii
    metric : "disc", "hit", "crossing" or "line"
        "disc" sums over discs, as `brute_force` does. The others use the k segments that arrive at the
        sample's front and are nearest by the distance to their first hit, to their crossing of the
        tangent plane, or to their part in front of the tangent plane. For "crossing" and "line" a
        segment must cross the plane before its end; with "bounded", its distance is at least the radius
        of the smallest disc that would count it.
    k : number of segments, at least 2 if `unbiased`; required by all metrics except "disc", which has none
    unbiased : sum the k - 1 inner segments, not all k, which overestimates by k / (k - 1)
        (García et al. 2012)
    leaf_size : leaves with at most this many segments are not split
    memory_limit : bytes of the map, or None; beyond it leaves are not split, and results are the same
    segment_end : "first", "second" or "bounded" (second, at most 3 radii beyond the first)
    first_bounce : count segments from this bounce on; 1 excludes direct light

    Returns
    -------
    Estimate
        With "disc": `sums`, equal (==) to those of every disc method. Else irradiance is
        Σ weight power / (pi r_k²), r_k the k-th distance; with fewer than k segments the formula
        holds for as many as there are; 0 where r_k is 0. The weight is 1, for "line"
        2 cos / (1 + cos) of the angle of incidence. `stats`: hits, disc_tests, node_tests (segments
        sorted into halves of a cell), box_tests (discs that came to a node), splits, refused_splits
        (those beyond the memory limit).

    Raises
    ------
    OptionError
        For unknown names, an invalid k or size, or samples without radii ("disc").
    """
    check_choice("metric", metric, ("disc", *METRICS))
    options = (_check_leaf_size(leaf_size), _check_limit(memory_limit), threads or 0)
    check_choice("segment_end", segment_end, SEGMENT_ENDS)
    segments = select_segments(segments, first_bounce, threads)
    if metric == "disc":
        if k is not None:
            raise OptionError(f'k: found {k!r}, expected None with metric "disc", which counts by area')
        check_discs(samples)
        found = _core.ray_map_sums(
            core_segments(segments), core_discs(samples, segments), segment_end, *options, progress
        )
        return disc_estimate(segments, samples, *found)
    k = _check_integer("k", k, 2 if unbiased else 1)
    check_world_points(samples)
    points = np.ascontiguousarray(samples.points - segments.frame, np.float32)
    normals = np.ascontiguousarray(samples.normals, np.float32)
    arrays = core_segments(segments), points, normals
    quanta, stats = _core.ray_map_nearest(*arrays, segment_end, metric, k, bool(unbiased), *options, progress)
    return Estimate(quanta * segments.quantum, None, segments.quantum, stats)


class RayMap:
    """A ray map that can be queried and changed.

    Queries split leaves as they go, so the first ones are slow. Concurrent calls from several threads are
    executed one after the other.

    Parameters
    ----------
    segments : Segments
        They get the ids 0 to n - 1. The powers of all segments are stored in their quantum.
    segment_end : "first", "second" or "bounded"
    leaf_size : leaves with at most this many segments are not split
    memory_limit : bytes of the map without powers, or None; beyond it leaves are not split

    Raises
    ------
    OptionError
        For an unknown name, or an invalid size.
    """

    def __init__(
        self,
        segments: Segments,
        *,
        segment_end: str = "bounded",
        leaf_size: int = LEAF_SIZE,
        memory_limit: int | None = None,
    ) -> None:
        check_choice("segment_end", segment_end, SEGMENT_ENDS)
        self._core: Any = _core.RayMap(segment_end, _check_leaf_size(leaf_size), _check_limit(memory_limit))
        self._samples: Samples | None = None
        self._quantum: float | None = None
        self.push(segments)

    def __len__(self) -> int:
        return self._core.size()

    def __repr__(self) -> str:
        return f"RayMap({len(self)} segments)"

    def push(self, segments: Segments) -> np.ndarray:
        """Add segments.

        Returns
        -------
        (n,) uint32
            Their ids; ids of removed segments may be reused.

        Raises
        ------
        OptionError
            For powers more than four times the largest power of the first segments.
        """
        if self._quantum is None and len(segments):
            self._quantum = segments.quantum
        if self._quantum in (None, segments.quantum):
            return self._core.push(core_segments(segments))
        quanta = np.rint(segments.power / self._quantum)
        if (quanta > MOST_QUANTA).any():
            raise OptionError(
                f"segments: power: found {segments.power.max():g}, expected at most "
                f"{MOST_QUANTA * self._quantum:g}, four times the greatest of the map's first segments"
            )
        part = segments.select(slice(None))
        part.quanta = quanta.astype(np.uint32)
        return self._core.push(core_segments(part))

    def remove(self, ids: Any) -> None:
        """Remove segments.

        Raises
        ------
        OptionError
            For an id that no segment of the map has; the map is then unchanged.
        """
        given = np.asarray(ids)
        if given.ndim != 1 or (given.size and given.dtype.kind not in "iu"):
            raise OptionError(f"ids: found {given.dtype} of shape {given.shape}, expected (n,) integers")
        if given.size and not (given.min() >= 0 and given.max() <= MOST_QUANTA):
            raise OptionError(f"ids: found {given.min()} to {given.max()}, expected ids of the map")
        self._core.remove(np.ascontiguousarray(given, np.uint32))

    def disc(
        self, samples: Samples, *, threads: int | None = None, progress: Progress | None = None
    ) -> Estimate:
        """Sums over discs: those of `brute_force` with the segments now in the map.

        Querying the same object again takes time for the changes since the last query only.

        Parameters
        ----------
        samples : Samples with radii, in world space
        """
        check_threads(threads)
        if samples is not self._samples:
            check_discs(samples)
            self._core.follow(core_discs(samples))
            self._samples = samples
        sums = self._core.sums(threads or 0, progress)
        quantum = self._quantum or 1.0
        area = np.pi * samples.radius.astype(np.float32).astype(np.float64) ** 2
        return Estimate(sums * (quantum / area[:, None]), sums, quantum, self.stats)

    def sphere(self, centre: Sequence[float], radius: float) -> np.ndarray:
        """Ids, ascending, of the segments that come within `radius` of `centre` before their first hit."""
        if not (np.isfinite(radius) and radius >= 0):
            raise OptionError(f"radius: found {radius}, expected metres")
        return self._core.sphere(_point("centre", centre), float(radius))

    def box(self, low: Sequence[float], high: Sequence[float]) -> np.ndarray:
        """Ids, ascending, of the segments that intersect the box before their first hit."""
        corners = _point("low", low), _point("high", high)
        if (np.asarray(corners[0]) > np.asarray(corners[1])).any():
            raise OptionError(f"box: found low {corners[0]} above high {corners[1]}, expected low <= high")
        return self._core.box(*corners)

    def nearest(
        self, point: Sequence[float], normal: Sequence[float], k: int, metric: str = "crossing"
    ) -> tuple[np.ndarray, np.ndarray]:
        """Ids and distances of the k segments nearest to a point by one of the metrics of `ray_map`.

        Returns
        -------
        (n,) uint32, (n,) float64
            Nearest first; fewer than k if fewer segments arrive at the front.
        """
        check_choice("metric", metric, METRICS)
        _check_integer("k", k, 1)
        one = Samples([point], [normal])
        check_world_points(one)
        return self._core.nearest(one.points[0].tolist(), one.normals[0].tolist(), k, metric)

    @property
    def stats(self) -> dict[str, int]:
        """Counts over all queries so far, named as in `ray_map`; sphere_tests include box queries."""
        return self._core.stats()

    @property
    def bytes(self) -> int:
        """Memory of the map, the powers, and the state that the last disc query keeps for the next one."""
        return self._core.bytes()


def _point(what: str, values: Sequence[float]) -> list[float]:
    array = np.asarray(values, np.float64)
    if array.shape != (3,) or not (np.abs(array) <= FARTHEST).all():
        raise OptionError(f"{what}: found {values!r}, expected three numbers of at most {FARTHEST:g} metres")
    return array.tolist()


def _check_integer(what: str, value: Any, least: int, most: int = 2**31 - 1) -> int:
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or not least <= value <= most:
        raise OptionError(f"{what}: found {value!r}, expected an integer from {least} to {most}")
    return int(value)


def _check_leaf_size(value: Any) -> int:
    return _check_integer("leaf_size", value, 1)


def _check_limit(value: Any) -> int:
    """Bytes; 0 = no limit."""
    return 0 if value is None else _check_integer("memory_limit", value, 1, 2**62)
