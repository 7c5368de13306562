# SPDX-License-Identifier: Apache-2.0
"""A photon map that is updated after edits: samples keep their valid photons."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux.errors import OptionError
from deltalux.results import Estimate
from deltalux.samples import Samples
from deltalux.segments import Progress, Segments, check_threads

from .lit_surfaces import core_hits
from .photon_map import core_map

_NONE = np.uint32(0xFFFFFFFF)  # no photon


@dataclass(frozen=True)
class PhotonUpdate:
    """Report on an update of a photon map.

    Attributes
    ----------
    removed, added : numbers of photons
    requeried : samples whose nearest photons were searched again
    changed : samples that kept their radius and lost photons or got new ones within it
    kept : samples without any change
    """

    removed: int
    added: int
    requeried: int
    changed: int
    kept: int


class PhotonMap:
    """A photon map that keeps each sample's photons across edits (García et al. 2004; paper 1.1).

    Valid photons are never discarded: a sample keeps its photons and its radius, and new photons within
    that radius join them, so that their number may differ from k; a sample that lost a photon is optionally
    queried again. No bias was observed, but the random error differs from a recompute's; `requery` makes
    both equal.

    Parameters
    ----------
    segments, samples, k, kernel, unbiased, compression, cone, threads : see `photon_map`
        Regions are discs (area="disc"): changes of the real surface area by edits are not considered.

    Attributes
    ----------
    segments : Segments, those present

    Raises
    ------
    OptionError
        As `photon_map` does.
    """

    def __init__(
        self,
        segments: Segments,
        samples: Samples,
        *,
        k: int = 50,
        kernel: str = "constant",
        unbiased: bool = True,
        compression: float = 1.0,
        cone: float = 1.1,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        check_threads(threads)
        self._samples, self._threads = samples, threads or 0
        self._options = (k, kernel, unbiased, "disc", None, compression, cone)
        self._core = core_map(samples, *self._options)
        self.segments = segments
        self.requery(progress=progress)

    def requery(self, *, progress: Progress | None = None) -> None:
        """Query all samples again: then `estimate` equals `photon_map` with the present segments."""
        self._lists = _Lists(*self._core.neighbours(core_hits(self.segments), None, self._threads, progress))

    @property
    def estimate(self) -> Estimate:
        """Irradiance from the photons that the samples have at present."""
        lists = self._lists
        values, stats = self._core.weigh(
            core_hits(self.segments),
            lists.start,
            lists.photon,
            lists.distance2,
            lists.radius2,
            self._threads,
            None,
        )
        quantum = self.segments.quantum
        return Estimate(values * quantum, None, quantum, {"hits": stats["hits"]})

    def update(
        self,
        removed: Any,
        new_segments: Segments,
        *,
        requery: bool = True,
        progress: Progress | None = None,
    ) -> PhotonUpdate:
        """Remove segments and add others.

        Parameters
        ----------
        removed : (n,) bool mask or integer array, into `segments`
        new_segments : Segments with the same quantum; they follow the kept ones in `segments`
        requery : bool
            Query samples that lost a photon again; otherwise they keep their radius, which is the paper's
            mode and needs no search among the kept photons. Samples without a radius are always queried.

        Raises
        ------
        OptionError
            If `removed` does not fit, or quanta differ.
        Cancelled
            If cancelled; everything is then as before.
        """
        gone = _mask(removed, len(self.segments))
        if len(new_segments) and new_segments.quantum != self.segments.quantum:
            raise OptionError(
                f"new_segments: found a quantum of {new_segments.quantum:g}, expected "
                f"{self.segments.quantum:g}; add only segments of the same lights"
            )
        segments = _joined(self.segments.select(~gone), new_segments)
        first_new = len(segments) - len(new_segments)
        old = self._lists
        lost = old.with_any(gone)
        asked = (old.radius2 == 0) | (lost & requery)
        fresh = _Lists(*self._core.neighbours(core_hits(new_segments), old.radius2, self._threads, progress))
        joined = old.without(gone).joined(fresh, first_new)
        rows = np.flatnonzero(asked)
        if len(rows):
            some = core_map(self._samples, *self._options, rows=rows)
            found = _Lists(*some.neighbours(core_hits(segments), None, self._threads, progress))
            joined = joined.replaced(rows, found)
        self.segments, self._lists = segments, joined
        changed = int(((lost | (fresh.counts > 0)) & ~asked).sum())
        return PhotonUpdate(
            int(gone.sum()), len(new_segments), len(rows), changed, len(asked) - len(rows) - changed
        )


@dataclass(frozen=True)
class _Lists:
    """Photons of samples: those of sample i are photon[start[i]:start[i + 1]]."""

    start: np.ndarray
    photon: np.ndarray
    distance2: np.ndarray
    radius2: np.ndarray
    rim: np.ndarray

    @property
    def counts(self) -> np.ndarray:
        return np.diff(self.start.astype(np.int64))

    @property
    def rows(self) -> np.ndarray:
        """The sample that each photon belongs to."""
        return np.repeat(np.arange(len(self.radius2)), self.counts)

    def with_any(self, gone: np.ndarray) -> np.ndarray:
        """(n,) bool: whether one of a sample's photons, or the one that defines its radius, is gone."""
        some = np.zeros(len(self.radius2), dtype=bool)
        some[self.rows[gone[self.photon]]] = True
        has_rim = self.rim != _NONE
        some[has_rim] |= gone[self.rim[has_rim]]
        return some

    def without(self, gone: np.ndarray) -> _Lists:
        """The lists without the photons that are gone, the others renumbered."""
        number = np.where(gone, _NONE, np.cumsum(~gone) - 1).astype(np.uint32)
        stays = ~gone[self.photon]
        rim = self.rim.copy()
        has_rim = rim != _NONE
        rim[has_rim] = number[rim[has_rim]]
        return self._from(
            self.rows[stays], number[self.photon[stays]], self.distance2[stays], self.radius2, rim
        )

    def joined(self, other: _Lists, first: int) -> _Lists:
        """Each sample's photons followed by those of `other`, numbered from `first`; radii stay."""
        return self._from(
            np.concatenate([self.rows, other.rows]),
            np.concatenate([self.photon, other.photon + np.uint32(first)]),
            np.concatenate([self.distance2, other.distance2]),
            self.radius2,
            self.rim,
        )

    def replaced(self, which: np.ndarray, other: _Lists) -> _Lists:
        """The lists with those of the samples `which` replaced by the lists of `other`."""
        stays = ~np.isin(self.rows, which)
        radius2, rim = self.radius2.copy(), self.rim.copy()
        radius2[which], rim[which] = other.radius2, other.rim
        return self._from(
            np.concatenate([self.rows[stays], which[other.rows]]),
            np.concatenate([self.photon[stays], other.photon]),
            np.concatenate([self.distance2[stays], other.distance2]),
            radius2,
            rim,
        )

    @staticmethod
    def _from(
        rows: np.ndarray, photon: np.ndarray, distance2: np.ndarray, radius2: np.ndarray, rim: np.ndarray
    ) -> _Lists:
        order = np.argsort(rows, kind="stable")
        start = np.zeros(len(radius2) + 1, dtype=np.uint64)
        np.cumsum(np.bincount(rows, minlength=len(radius2)), out=start[1:].view(np.int64))
        return _Lists(start, photon[order], distance2[order], radius2, rim)


def _mask(removed: Any, count: int) -> np.ndarray:
    """(n,) bool from a mask or from indices."""
    array = np.asarray(removed)
    if array.dtype == bool and array.shape == (count,):
        return array
    mask = np.zeros(count, dtype=bool)
    whole = array.ndim == 1 and (array.size == 0 or np.issubdtype(array.dtype, np.integer))
    if not whole or (array.size and not (array.min() >= 0 and array.max() < count)):
        raise OptionError(
            f"removed: found {array.dtype} of shape {array.shape}, expected a mask of {count} segments "
            "or their numbers"
        )
    mask[array.astype(np.int64)] = True
    return mask


def _joined(one: Segments, two: Segments) -> Segments:
    """All segments, with unchanged quanta."""
    whole = object.__new__(Segments)
    for name, value in vars(one).items():
        other = getattr(two, name)
        if name == "quantum":
            setattr(whole, name, value)
        elif value is None or other is None:
            setattr(whole, name, None)
        else:
            setattr(whole, name, np.concatenate([value, other]))
    return whole
