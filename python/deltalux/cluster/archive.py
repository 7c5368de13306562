# SPDX-License-Identifier: Apache-2.0
"""Session files of shared paths: arrays of all shards joined, and arrays of a file without its paths."""

from __future__ import annotations

import builtins
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from deltalux import _core

_SEGMENT = np.dtype(
    {
        "names": ["length", "path", "next"],
        "formats": ["f4", "u4", "u4"],
        "offsets": [_core.SEGMENT_LENGTH, _core.SEGMENT_PATH, _core.SEGMENT_NEXT],
        "itemsize": _core.SEGMENT_BYTES,
    }
)
_WIDTHS = {"segments": _core.SEGMENT_BYTES, "hits": 8, "extended": 4, "landing": 4}  # bytes of a slot
_LEVEL = re.compile(r"level(\d+)\.(\w+)")
_OF_PATHS = ("cut", "pending", "sums")

BounceArrays = dict[str, np.ndarray]  # arrays of the segments of one bounce, (slots, bytes of a slot) uint8


class WithoutPaths:
    """The core's arrays in a file, of which a session restores itself without paths.

    The arrays of paths are read, so that their checksums are verified, and forgotten.

    Parameters
    ----------
    arrays : `deltalux.stored.snapshot.CoreArrays`
    """

    def __init__(self, arrays: Any) -> None:
        self._arrays = arrays
        sizes = np.zeros((arrays.bytes("level_sizes") or 0) // 8, np.uint64)
        if not len(sizes):
            return
        for name in _OF_PATHS:
            self._pass_over(name)
        for bounce in range(len(sizes)):
            for kind in _WIDTHS:
                self._pass_over(f"level{bounce}.{kind}")

    def _pass_over(self, name: str) -> None:
        left = self._arrays.bytes(name)
        while left:
            piece = min(left, 1 << 20)
            self._arrays.read_into(name, memoryview(bytearray(piece)))
            left -= piece

    def bytes(self, name: str) -> int | None:
        """Size of an array, None where there is none of that name."""
        return None if name in _OF_PATHS else self._arrays.bytes(name)

    def read_into(self, name: str, buffer: memoryview) -> None:
        """Fill `buffer` with the next bytes of an array."""
        self._arrays.read_into(name, buffer)


def paths_of(view: Any) -> list[BounceArrays]:
    """The stored segments of one session, by bounce; those of later bounces without free slots.

    Parameters
    ----------
    view : what the core's session saves
    """
    levels: list[BounceArrays] = []
    sizes = np.frombuffer(view["level_sizes"], np.uint64).astype(int)
    names = set(view.names())
    for bounce, size in enumerate(sizes):
        level = {}
        for kind, width in _WIDTHS.items():
            if (name := f"level{bounce}.{kind}") in names and view.bytes(name) == size * width:
                level[kind] = np.frombuffer(view[name], np.uint8).reshape(size, width)
        levels.append(level)
    return _without_free_slots(levels)


def _fields(level: BounceArrays) -> np.ndarray:
    return level["segments"].view(_SEGMENT)[:, 0]


def _writable(level: BounceArrays) -> BounceArrays:
    return {kind: np.require(rows, requirements=["C", "W"]) for kind, rows in level.items()}


def _without_free_slots(levels: list[BounceArrays]) -> list[BounceArrays]:
    levels = [_writable(level) for level in levels]
    for before, level in pairwise(levels):
        used = _fields(level)["length"] >= 0
        place = np.cumsum(used) - 1
        _follow(before, place.astype(np.uint32))
        for kind, rows in level.items():
            level[kind] = rows[used]
    return levels


def _follow(level: BounceArrays, place: np.ndarray) -> None:
    """Renumber the slots that the segments of a bounce lead to: slot i is now `place[i]`."""
    following = _fields(level)["next"]
    led = (following != _core.NO_SLOT) & (_fields(level)["length"] >= 0)
    following[led] = place[following[led]]


class WholeArchive:
    """The arrays of a session with all paths, made of those of shards.

    Parameters
    ----------
    view : what the core's session without paths saves, with the sums of all
    shards : for each shard, its `paths_of`
    """

    def __init__(self, view: Any, shards: Sequence[list[BounceArrays]]) -> None:
        self._view = view
        self._levels = _joined(shards)
        paths = len(self._levels[0]["segments"]) if self._levels else 0
        sizes = [len(level["segments"]) for level in self._levels]
        self._own: dict[str, np.ndarray] = {
            "level_sizes": np.array(sizes, np.uint64),
            "cut": np.full(paths, _core.NOT_CUT, np.uint16),
            "pending": np.zeros(0, np.uint32),
        }
        for bounce, level in enumerate(self._levels):
            empty = np.zeros((0, _WIDTHS["extended"]), np.uint8)
            for kind, rows in {"hits": empty, "extended": empty, **level}.items():
                self._own[f"level{bounce}.{kind}"] = rows

    def names(self) -> list[str]:
        """Names of all arrays."""
        others = {name for name in self._view.names() if not _LEVEL.fullmatch(name)}
        return sorted(others | self._own.keys())

    def bytes(self, name: str) -> int:
        """Size of an array."""
        return self._own[name].nbytes if name in self._own else self._view.bytes(name)

    def read(self, name: str, offset: int, count: int) -> builtins.bytes:
        """Bytes of an array."""
        if name not in self._own:
            return self._view.read(name, offset, count)
        return self._own[name].reshape(-1).view(np.uint8)[offset : offset + count].tobytes()


def _joined(shards: Sequence[list[BounceArrays]]) -> list[BounceArrays]:
    """One store of all segments: first ones in the order of path numbers, later ones shard by shard."""
    shards = [[_writable(level) for level in shard] for shard in shards]
    depth = max(map(len, shards), default=0)
    begin = [0] * len(shards)
    for bounce in range(depth - 1, -1, -1):
        own = [len(shard[bounce]["segments"]) if bounce < len(shard) else 0 for shard in shards]
        for shard, after in zip(shards, begin, strict=True):
            if bounce < len(shard):
                size = len(shard[bounce + 1]["segments"]) if bounce + 1 < len(shard) else 0
                _follow(shard[bounce], np.arange(after, after + size, dtype=np.uint32))
        begin = [0, *np.cumsum(own)[:-1].tolist()]
    levels = []
    for bounce in range(depth):
        there = [shard[bounce] for shard in shards if bounce < len(shard)]
        levels.append({kind: np.concatenate([level[kind] for level in there]) for kind in there[0]})
    if levels:
        order = np.argsort(_fields(levels[0])["path"], kind="stable")
        levels[0] = {kind: rows[order] for kind, rows in levels[0].items()}
    return levels
