# SPDX-License-Identifier: Apache-2.0
"""Sessions that share the paths of one bake: their integer sums add up to those of a session with all paths.

Each part is a `Session` with a `path_range`; one more, of `path_range=(0, 0)`, holds no paths and evaluates
the sums of all parts, with the bits of a session with all paths::

    for s in (*parts, whole):
        s.bake()
    for part in parts:
        add_path_changes(whole, path_changes(part))
    gather(whole)
    whole.irradiance

All take the same edits. After an update of all of them, add the `path_changes` of each part, once; before,
`whole` refuses to be read. `deltalux.ClusterSession` does all that with parts in several processes.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from operator import add
from typing import Any, Protocol, TypeVar

import numpy as np

from deltalux.errors import OptionError

from .session import Session

__all__ = [
    "GradientSums",
    "PathChanges",
    "PathSums",
    "SparseRow",
    "add_path_changes",
    "add_up",
    "cast_direct",
    "cast_gather_rays",
    "digest",
    "gather",
    "gradient",
    "gradient_sums",
    "number_rays",
    "path_changes",
    "path_sums",
    "place_samples",
    "queue_edit",
    "ranges_of",
    "restore_choices",
    "saved_arrays",
    "segments_hash",
]


class _Addable(Protocol):
    def __add__(self, other: Any) -> Any: ...


_T = TypeVar("_T", bound=_Addable)


@dataclass(frozen=True, eq=False)
class PathSums:
    """Sums of a session's paths in quanta, exact; those of ranges add up.

    Parameters
    ----------
    paths : how many paths they are of
    discs : (groups, batches, samples, 3) int64, on the discs of the samples; with a gather and shadow
        rays for all lights, no samples
    cells : (cells, groups, batches, 3) int64, on the cells that gather rays read; without a gather, no cells
    """

    paths: int
    discs: np.ndarray
    cells: np.ndarray

    def __add__(self, other: PathSums) -> PathSums:
        if self.discs.shape != other.discs.shape or self.cells.shape != other.cells.shape:
            raise OptionError(
                f"path sums: found {other.discs.shape} and {other.cells.shape} numbers beside "
                f"{self.discs.shape} and {self.cells.shape}, expected those of one scene, one state, and the "
                "same samples and options"
            )
        return PathSums(self.paths + other.paths, self.discs + other.discs, self.cells + other.cells)


@dataclass(frozen=True, eq=False)
class SparseRow:
    """The numbers of a long row that are not zero.

    Parameters
    ----------
    size : length of the row
    at : (k,) uint64, ascending places
    values : (k,) or (k, 3) int64
    """

    size: int
    at: np.ndarray
    values: np.ndarray

    def __add__(self, other: SparseRow) -> SparseRow:
        if self.size != other.size:
            raise OptionError(
                f"sums: found a row of {other.size} numbers beside one of {self.size}, expected those of one "
                "scene, one state, and the same samples and options"
            )
        at, where = np.unique(np.concatenate((self.at, other.at)), return_inverse=True)
        values = np.zeros((len(at), *self.values.shape[1:]), np.int64)
        np.add.at(values, where.reshape(-1), np.concatenate((self.values, other.values)))
        return SparseRow(self.size, at, values)

    def __reduce__(self) -> Any:
        steps = np.diff(self.at, prepend=np.uint64(0))
        columns = self.values.shape[1] if self.values.ndim == 2 else 0
        return _unpacked, (self.size, _packed(steps), _packed(self.values.reshape(-1)), columns)


def _packed(numbers: np.ndarray) -> tuple[str, bytes]:
    """Whole numbers in the narrowest type that holds them, compressed."""
    least, most = (int(numbers.min()), int(numbers.max())) if len(numbers) else (0, 0)
    fits = (t for t in ("i1", "i2", "i4", "i8") if np.iinfo(t).min <= least and most <= np.iinfo(t).max)
    narrow = next(fits)
    return narrow, zlib.compress(numbers.astype(narrow).tobytes(), 1)


def _unpacked(size: int, steps: tuple[str, bytes], values: tuple[str, bytes], columns: int) -> SparseRow:
    at, own = (np.frombuffer(zlib.decompress(data), kind).astype(np.int64) for kind, data in (steps, values))
    return SparseRow(size, np.cumsum(at).astype(np.uint64), own.reshape(-1, columns) if columns else own)


@dataclass(frozen=True, eq=False)
class PathChanges:
    """What sums of paths in quanta changed from one state to a later one; those of ranges add up.

    Pickled, they are compressed.

    Parameters
    ----------
    ranges : (first, last) of the paths whose sums they bring into the later state; none if both have the
        same edits, as between two parts of an update with a time budget
    edits : number of edits since the bake, of the later state
    since : the same of the earlier state; None: there was none, and these are the sums themselves
    discs, cells : SparseRow, of the numbers of `PathSums`, whose places are the core's
    openness : SparseRow, bits of the openness of the samples for which the part computed it, where it counts
    """

    ranges: tuple[tuple[int, int], ...]
    edits: int
    since: int | None
    discs: SparseRow
    cells: SparseRow
    openness: SparseRow

    def __add__(self, other: PathChanges) -> PathChanges:
        if (self.since, self.edits) != (other.since, other.edits):
            raise OptionError(
                f"path changes: found those from edit {other.since} to edit {other.edits} beside those from "
                f"{self.since} to {self.edits}, expected those between two states"
            )
        return PathChanges(
            (*self.ranges, *other.ranges),
            self.edits,
            self.since,
            self.discs + other.discs,
            self.cells + other.cells,
            self.openness + other.openness,
        )


@dataclass(frozen=True, eq=False)
class GradientSums:
    """What gradients are made of; those of ranges add up.

    Parameters
    ----------
    discs : (groups, batches, samples, 3) int64, sums on the samples' discs
    moments : (groups, batches, samples, 6) int64, their first moments
    """

    discs: np.ndarray
    moments: np.ndarray

    def __add__(self, other: GradientSums) -> GradientSums:
        return GradientSums(self.discs + other.discs, self.moments + other.moments)


def ranges_of(paths: int, count: int) -> list[tuple[int, int]]:
    """Divide `paths` into `count` ranges of equal size."""
    cuts = [paths * i // count for i in range(count + 1)]
    return list(pairwise(cuts))


def add_up(parts: Sequence[_T]) -> _T:
    """The sum of what all ranges have: of PathSums, PathChanges, GradientSums or hashes."""
    return reduce(add, parts)


def path_sums(session: Session) -> PathSums:
    """Sums of the paths that the session holds; queued edits are applied first."""
    with session._calls.one(long=True):
        session._finish()
        return PathSums(*session._session().path_sums())


def segments_hash(session: Session) -> np.ndarray:
    """(3,) uint64: number and hash of the segments that the session stores; sums wrap around."""
    with session._calls.one(long=True):
        session._finish()
        return session._session().segments_hash()


def gradient_sums(session: Session) -> GradientSums:
    """Sums of the session's stored segments for gradients, which takes a pass over all of them."""
    with session._calls.one(long=True):
        session._finish()
        return GradientSums(*session._session().gradient_sums(session.progress))


def path_changes(part: Session) -> PathChanges:
    """What the sums of a part changed since the last call; the first one after a bake or a recompute: all.

    Queued edits are not applied first.

    Raises
    ------
    OptionError
        For a session that does not hold a part of the paths.
    """
    with part._calls.one(long=True):
        ranges, edits, since, *rows = part._baked_session().path_changes()
        return PathChanges(ranges, edits, since, *(SparseRow(*row) for row in rows))


def add_path_changes(whole: Session, changes: PathChanges) -> None:
    """Add what the sums of a part, or of several, changed to a session without paths.

    Raises
    ------
    OptionError
        For a session that holds paths; for changes of another scene, samples, options or edits, and for paths
        that were added already.
    """
    with whole._calls.one(long=True):
        whole._forget_results()
        add_to(whole._baked_session(), changes)


def add_to(core: Any, changes: PathChanges) -> None:
    """Add them to the core's session without paths."""
    rows = (changes.discs, changes.cells, changes.openness)
    numbers = ((row.size, row.at, row.values) for row in rows)
    core.add_path_changes(changes.ranges, changes.edits, changes.since, *numbers)


def gather(whole: Session) -> None:
    """Complete the bake of a session without paths, to which the sums of all paths were added.

    It casts gather rays.

    Raises
    ------
    OptionError
        For a session that holds paths, or lacks sums.
    Cancelled
    """
    with whole._calls.one(long=True):
        whole._forget_results()
        whole._baked_session().gather(whole.progress)


def queue_edit(part: Session, kind: str, values: Sequence[Any]) -> None:
    """Queue an edit as the core takes it, which another session of the same scene has queued."""
    with part._calls.one(long=False):
        part._queue(kind, *values)


def restore_choices(part: Session, choices: Any) -> None:
    """Bring a fresh part into the state of another session; its paths wait for `Session.recompute`.

    Parameters
    ----------
    choices : archive of the arrays that the core's `save_choices` returned
    """
    with part._calls.one(long=True):
        part._prepare_choice()
        part._session().restore(choices, part.progress)


def saved_arrays(part: Session) -> Any:
    """Archive of the arrays that the core saves of a part."""
    with part._calls.one(long=True):
        part._finish()
        return part._session().save()


def place_samples(part: Session) -> None:
    """Prepare a part, after its bake, for casting rays."""
    with part._calls.one(long=True):
        part._baked_session().place_samples()


def cast_direct(part: Session, first: int, last: int) -> dict[str, np.ndarray]:
    """Compute direct light by shadow rays for samples `first` to `last`, in a part.

    Returns
    -------
    arrays by name, of what the session without paths takes over
    """
    with part._calls.one(long=True):
        return part._baked_session().cast_direct(first, last, part.progress)


def number_rays(part: Session, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Choose numbers of gather rays for samples `first` to `last`, in a part.

    Returns
    -------
    (n, bytes) uint8 guides that they see, (n,) int8 doublings of the standard number
    """
    with part._calls.one(long=True):
        return part._baked_session().number_rays(first, last, part.progress)


def cast_gather_rays(part: Session, first: int, last: int, aims: Any) -> dict[str, np.ndarray]:
    """Cast the gather rays of samples `first` to `last`, in a part.

    Parameters
    ----------
    aims : archive of the arrays that the core's `save_aims` returned

    Returns
    -------
    arrays by name, of what the rays met
    """
    with part._calls.one(long=True):
        return part._baked_session().cast_gather_rays(first, last, aims, part.progress)


def digest(whole: Session, segments: np.ndarray) -> str:
    """The digest of a session with all paths; `segments`: the sum of `segments_hash` of all ranges."""
    with whole._calls.one(long=True):
        whole._finish()
        return whole._session().digest_with(segments)


def gradient(whole: Session, sums: GradientSums) -> np.ndarray:
    """`Session.gradient` of a session without paths; `sums`: those of all ranges, added up."""
    with whole._calls.one(long=True):
        whole._finish()
        return whole._session().gradient_with(sums.discs, sums.moments, whole.progress)
