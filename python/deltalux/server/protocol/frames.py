# SPDX-License-Identifier: Apache-2.0
"""Binary frames of the viewer's protocol: the change from the values that a page has to the newest."""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np

from deltalux.errors import FormatError
from deltalux.server.drawn.values import Values

ALL, PREVIEW, REST = 1, 2, 4  # flags
GAP = 64  # vertices; runs with a smaller gap are joined, which costs fewer bytes than another run
MAX_RUNS = 2048
_MAGIC = 0x58544C44  # "DLTX"
_HEADER = struct.Struct("<IIIfII")  # magic, seq, revision, scale, flags, runs


def frame_bytes(seq: int, values: Values, before: Values | None) -> bytes:
    """A binary frame that takes a page from `before` (None: from nothing) to `values`."""
    whole = before is None or before.scale != values.scale or before.preview != values.preview
    if before is None or whole:
        first, count = np.array([0]), np.array([len(values.rows)])
        chosen = values.rows
    else:
        first, count = _runs(np.flatnonzero(values.rows != before.rows))
        pieces = [values.rows[a : a + n] for a, n in zip(first, count, strict=True)]
        chosen = np.concatenate(pieces) if pieces else values.rows[:0]
    flags = ALL * whole | PREVIEW * values.preview | REST * values.rest
    header = _HEADER.pack(_MAGIC, seq, values.revision, values.scale, flags, len(first))
    return header + np.stack([first, count], axis=1).astype("<u4").tobytes() + chosen.tobytes()


class FrameHeader(NamedTuple):
    """Header of a frame; `runs` are pairs of first vertex and count."""

    seq: int
    revision: int
    scale: float
    flags: int
    runs: list[list[int]]


def apply_frame(frame: bytes, rows: np.ndarray | None) -> tuple[FrameHeader, np.ndarray]:
    """Write a frame's values into `rows`, (n,) uint64 from earlier frames; None = this is the first one.

    For Python clients: tests and benchmarks.

    Returns
    -------
    header : FrameHeader
    rows : the given array, changed, or a new one if the frame holds all values

    Raises
    ------
    FormatError
        If `frame` is not a frame, or does not continue `rows`.
    """
    header, values = _decoded(frame)
    if header.flags & ALL:
        rows = np.zeros(len(values), np.uint64)
    if rows is None:
        raise FormatError("frame: found a part of the values, expected all of them in the first frame")
    at = 0
    for first, count in header.runs:
        if first + count > len(rows):
            raise FormatError(f"frame: found a run to vertex {first + count} of {len(rows)}")
        rows[first : first + count] = values[at : at + count]
        at += count
    return header, rows


def _decoded(frame: bytes) -> tuple[FrameHeader, np.ndarray]:
    """The header, and the values of all runs, concatenated."""
    if len(frame) < _HEADER.size or int.from_bytes(frame[:4], "little") != _MAGIC:
        raise FormatError(f"frame: found {len(frame)} bytes without the mark of one, expected a frame")
    _, seq, revision, scale, flags, runs = _HEADER.unpack_from(frame)
    start = _HEADER.size + 8 * runs
    table = np.frombuffer(frame[_HEADER.size : start], "<u4")
    size = start + 8 * int(table[1::2].sum())
    if len(frame) != size:
        raise FormatError(f"frame: found {len(frame)} bytes, expected {size}")
    header = FrameHeader(seq, revision, scale, flags, table.reshape(-1, 2).tolist())
    return header, np.frombuffer(frame, "<u8", offset=start)


def _runs(changed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First vertex and count of runs that cover all of `changed` (ascending)."""
    if not len(changed):
        return changed, changed
    gaps = np.diff(changed)
    breaks = np.flatnonzero(gaps > GAP)
    if len(breaks) >= MAX_RUNS:  # keep the widest gaps
        breaks = np.sort(breaks[np.argpartition(gaps[breaks], -(MAX_RUNS - 1))[-(MAX_RUNS - 1) :]])
    first = changed[np.r_[0, breaks + 1]]
    last = changed[np.r_[breaks, len(changed) - 1]]
    return first, last - first + 1
