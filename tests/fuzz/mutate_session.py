# SPDX-License-Identifier: Apache-2.0
"""Mutated session files: arrays and index with right checksums, the zip itself, plain bytes."""

from __future__ import annotations

import copy
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from session_files import INDEX, write_parts

from fuzz.mutate_bytes import change_bytes
from fuzz.mutate_json import Rng, change_json, pick

Parts = tuple[dict[str, Any], dict[str, np.ndarray]]
FLOATS = [np.nan, np.inf, -np.inf, 0.0, -0.0, -1.0, 1e-45, 1e-30, 1e16, 1e30, 3e38]
INTEGERS = [0, 1, 2, 255, 65535, 2**24, 2**31 - 1, 2**31, 2**32 - 2, 2**32 - 1]
LONG_INTEGERS = [-1, 2**40, 2**53, 2**62, 2**63 - 1]


def _number(rng: Rng, width: int) -> bytes:
    """One number of 1, 4 or 8 bytes that a reader may stumble over."""
    if width == 1:
        return bytes([int(pick(rng, [0, 1, 2, 127, 128, 255]))])
    if width == 4:
        kind = rng.random()
        if kind < 0.45:
            return np.float32(pick(rng, FLOATS)).tobytes()
        return np.uint32(pick(rng, INTEGERS)).tobytes() if kind < 0.9 else rng.bytes(4)
    if rng.random() < 0.4:
        return np.float64(pick(rng, FLOATS)).tobytes()
    return np.int64(pick(rng, [*INTEGERS, *LONG_INTEGERS])).tobytes()


def _patched(rng: Rng, array: np.ndarray) -> np.ndarray:
    """Some numbers changed; the array's bytes are taken for numbers of any width."""
    data = bytearray(array.tobytes())
    width = int(pick(rng, [1, 4, 4, 4, 8]))
    for _ in range(int(pick(rng, [1, 1, 2, 5]))):
        if len(data) >= width:
            place = int(rng.integers(len(data) // width)) * width
            if rng.random() < 0.3:  # near what it was
                old = int.from_bytes(data[place : place + width], "little")
                changed = (old + int(pick(rng, [-2, -1, 1, 2]))) % (1 << 8 * width)
                data[place : place + width] = changed.to_bytes(width, "little")
            else:
                data[place : place + width] = _number(rng, width)
    if rng.random() < 0.1 and width > 1:  # the same number everywhere
        count = len(data) // width
        data[: count * width] = _number(rng, width) * count
    return np.frombuffer(bytes(data), array.dtype).reshape(array.shape)


def _resized(rng: Rng, array: np.ndarray) -> np.ndarray:
    """Cut off, doubled, longer by a little, empty."""
    count = len(array) if array.ndim else 0
    rows = int(pick(rng, [0, 1, count - 1, count + 1, count // 2, 2 * count, count - 4, count + 4]))
    return np.resize(array, (max(rows, 0), *array.shape[1:]))


def _retyped(rng: Rng, array: np.ndarray) -> np.ndarray:
    """Of another type or shape."""
    kinds = [np.float64, np.float32, np.int8, np.uint32, np.int64, bool]
    with np.errstate(all="ignore"):
        return pick(rng, [array.ravel(), array.reshape(1, -1), array.astype(pick(rng, kinds))])


def change_arrays(rng: Rng, arrays: dict[str, np.ndarray]) -> None:
    """Change some arrays, exchange two, or lose one."""
    for _ in range(rng.geometric(0.6)):
        names = sorted(arrays)
        name = str(pick(rng, names))
        kind = rng.random()
        if kind < 0.75:
            arrays[name] = _patched(rng, arrays[name])
        elif kind < 0.87:
            arrays[name] = _resized(rng, arrays[name])
        elif kind < 0.92:
            arrays[name] = _retyped(rng, arrays[name])
        elif kind < 0.96:
            arrays[name] = arrays[str(pick(rng, names))]
        else:
            del arrays[name]


def _write_odd_zip(rng: Rng, path: Path, index: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
    """Compressed entries, names twice, the index last or missing, versions of the array format."""
    method = int(pick(rng, [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED]))
    entries = [(INDEX, json.dumps(index).encode())]
    for name, array in arrays.items():
        data = io.BytesIO()
        version = (2, 0) if rng.random() < 0.05 else (1, 0)
        np.lib.format.write_array(data, array, version=version)
        entries.append((f"{name}.npy", data.getvalue()))
    kind = rng.integers(4)
    if kind == 0:
        entries.reverse()
    elif kind == 1:
        entries.append(entries[rng.integers(1, len(entries))])
    elif kind == 2:
        entries.pop(int(rng.integers(len(entries))))
    else:
        entries.append(("more.npy", bytes(1 << 22)))
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, content in entries:
            if name not in archive.namelist():
                archive.writestr(name, content)


def write_mutated(rng: Rng, path: Path, seeds: list[Parts]) -> None:
    """One session file, changed."""
    index, arrays = seeds[rng.integers(len(seeds))]
    index, arrays = copy.deepcopy(index), dict(arrays)
    kind = rng.random()
    if kind < 0.6:
        change_arrays(rng, arrays)
    if 0.55 < kind < 0.85:
        change_json(rng, index)
    if 0.85 < kind < 0.88:
        _write_odd_zip(rng, path, index, arrays)
    else:
        write_parts(path, index, arrays)
    if kind > 0.88:
        data = path.read_bytes()
        path.write_bytes(data[: rng.integers(len(data))] if kind > 0.97 else change_bytes(rng, data))
