# SPDX-License-Identifier: Apache-2.0
"""Exact values of a session as one binary message: a JSON header and float64 arrays."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from deltalux.errors import FormatError
from deltalux.session import Session

MAGIC = b"DLTA"
_START = 8  # bytes of the magic and the header's length

READABLE: dict[str, Callable[[Session], np.ndarray]] = {
    "irradiance": lambda session: session.irradiance,
    "standard_error": lambda session: session.standard_error,
    "points": lambda session: session.world()[0],
    "normals": lambda session: session.world()[1],
}


def arrays_of(session: Session, names: Iterable[str]) -> dict[str, np.ndarray]:
    """The arrays of `READABLE` with these names."""
    return {name: READABLE[name](session) for name in names}


def arrays_bytes(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> bytes:
    """A binary message; adds `arrays` to `header`: the shape of each, and its offset after the header."""
    blocks = [np.ascontiguousarray(array, "<f8").tobytes() for array in arrays.values()]
    offsets = np.cumsum([0, *map(len, blocks)]).tolist()
    layout = {
        name: {"offset": offset, "shape": list(array.shape)}
        for (name, array), offset in zip(arrays.items(), offsets[:-1], strict=True)
    }
    text = json.dumps({**header, "arrays": layout}, allow_nan=False).encode()
    text += b" " * (-len(text) % 8)  # padding aligns the numbers to 8 bytes
    return b"".join([MAGIC, len(text).to_bytes(4, "little"), text, *blocks])


def read_arrays(data: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Header and arrays of a binary message.

    Raises
    ------
    FormatError
    """
    if data[:4] != MAGIC or len(data) < _START:
        raise FormatError(f"values: found {len(data)} bytes without the mark of arrays, expected it")
    start = _START + int.from_bytes(data[4:_START], "little")
    try:
        header = json.loads(data[_START:start])
        arrays = {
            name: np.frombuffer(data, "<f8", int(np.prod(layout["shape"])), start + layout["offset"])
            .reshape(layout["shape"])
            .astype(np.float64)
            for name, layout in header["arrays"].items()
        }
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise FormatError(f"values: found {len(data)} bytes that are no arrays ({error})") from None
    return header, arrays
