# SPDX-License-Identifier: Apache-2.0
"""Sessions that share the paths of one bake: their integer sums add up to those of a session with all paths.

Each part is a `Session` with a `path_range`; one more, of `path_range=(0, 0)`, holds no paths and evaluates
the sums of all parts, with the bits of a session with all paths::

    for s in (*parts, whole):
        s.bake()
    for part in parts:
        add_path_sums(whole, path_sums(part))
    look(whole, add_up([first_flights(part) for part in parts]))
    for part in parts:
        ask_for(part, asked_lights(whole))
    whole.irradiance

All take the same edits. After each update of all of them, add the differences to the sums before, once for
each part, before anything is read: the session that evaluates cannot tell that they are missing, and would
show the new scene with the light of the old paths.
"""

from __future__ import annotations

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
    "FirstFlights",
    "GradientSums",
    "PathSums",
    "add_path_sums",
    "add_up",
    "ask_for",
    "asked_lights",
    "digest",
    "first_flights",
    "gradient",
    "gradient_sums",
    "look",
    "path_sums",
    "ranges_of",
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
    discs : (groups, batches, samples, 3) int64, on the discs of the samples
    cells : (cells, groups, batches, 3) int64, on the cells that gather rays read; without a gather, no cells
    """

    paths: int
    discs: np.ndarray
    cells: np.ndarray

    def __add__(self, other: PathSums) -> PathSums:
        return self._with(other, 1)

    def __sub__(self, earlier: PathSums) -> PathSums:
        """What edits changed; cells of meshes that were added since come last."""
        return self._with(earlier, -1)

    def _with(self, other: PathSums, sign: int) -> PathSums:
        missing = len(self.cells) - len(other.cells)
        if self.discs.shape != other.discs.shape or missing < 0 or (missing and sign > 0):
            raise OptionError(
                f"path sums: found {other.discs.shape} and {other.cells.shape} numbers beside "
                f"{self.discs.shape} and {self.cells.shape}, expected those of one scene, one state, and the "
                "same samples and options"
            )
        cells = self.cells.copy()
        cells[: len(other.cells)] += sign * other.cells
        return PathSums(self.paths + sign * other.paths, self.discs + sign * other.discs, cells)


@dataclass(frozen=True, eq=False)
class FirstFlights:
    """What the first flights from narrow spots and suns bring to cells; those of ranges add up.

    Parameters
    ----------
    lights : (k,) uint32, numbers of lights
    quanta : (k, cells, batches, 3) int64
    """

    lights: np.ndarray
    quanta: np.ndarray

    def __add__(self, other: FirstFlights) -> FirstFlights:
        if not np.array_equal(self.lights, other.lights) or self.quanta.shape != other.quanta.shape:
            raise OptionError(
                f"first flights: found lights {other.lights.tolist()} beside {self.lights.tolist()}, "
                "expected those of one scene and state"
            )
        return FirstFlights(self.lights, self.quanta + other.quanta)


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
    """The sum of what all ranges have: of PathSums, FirstFlights, GradientSums or hashes."""
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


def first_flights(session: Session) -> FirstFlights:
    """First flights of the session's paths, directly after its bake."""
    with session._calls.one(long=True):
        return FirstFlights(*session._baked_session().first_flights())


def ask_for(part: Session, lights: np.ndarray) -> None:
    """Leave first flights from these lights out of the cells, after the bake: gather rays ask for them.

    Raises
    ------
    OptionError
        For a session that does not hold a part of the paths, or that does not gather.
    """
    with part._calls.one(long=True):
        part._baked_session().ask_for(lights)


def asked_lights(whole: Session) -> np.ndarray:
    """(k,) uint32: lights that gather rays ask for, of a session that looked."""
    with whole._calls.one(long=True):
        return whole._baked_session().asked_lights()


def add_path_sums(whole: Session, sums: PathSums) -> None:
    """Add sums of a range to a session without paths, or what an edit changed of them.

    Raises
    ------
    OptionError
        For a session that holds paths, for sums of another scene, samples, options or state, and for more
        paths than there are.
    """
    with whole._calls.one(long=True):
        whole._forget_results()
        whole._baked_session().add_path_sums(sums.paths, sums.discs, sums.cells)


def look(whole: Session, first: FirstFlights) -> None:
    """Complete the bake of a session without paths, to which the sums of all paths were added.

    It chooses where gather rays go, and casts them.

    Raises
    ------
    OptionError
        For a session that holds paths, or lacks sums.
    Cancelled
    """
    with whole._calls.one(long=True):
        whole._forget_results()
        whole._baked_session().look(first.lights, first.quanta, whole.progress)


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
