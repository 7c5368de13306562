# SPDX-License-Identifier: Apache-2.0
"""Mutations of bytes: special numbers, cuts, flips, insertions."""

from __future__ import annotations

import struct

import numpy as np

from fuzz.mutate_json import Rng, pick


def change_numbers(rng: Rng, data: bytearray) -> None:
    """Special floats, random bytes, extreme indices."""
    if len(data) < 8:
        return
    at = int(rng.integers(0, len(data) // 4)) * 4
    special = pick(rng, [np.nan, np.inf, -np.inf, 1e38, -1e-45, 0.0])
    patch = pick(rng, [np.float32(special).tobytes(), b"\xff" * 4, rng.bytes(4), rng.bytes(1), b"\xff\xff"])
    data[at : at + len(patch)] = patch


def change_bytes(rng: Rng, data: bytes) -> bytes:
    """Cut, flip, insert, or repeat bytes of the whole file."""
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 6))):
        if not changed:
            break
        at = int(rng.integers(len(changed)))
        # The first bytes hold the lengths that a reader trusts.
        at = int(rng.integers(min(28, len(changed)))) if rng.random() < 0.3 else at
        action = rng.integers(5)
        if action == 0:
            del changed[at:]
        elif action == 1:
            changed[at] ^= 1 << int(rng.integers(8))
        elif action == 2:
            changed[at:at] = rng.bytes(int(rng.integers(1, 16)))
        elif action == 3:
            del changed[at : at + int(rng.integers(1, 16))]
        else:
            changed[at : at + 4] = struct.pack("<I", int(pick(rng, [0, 1, 2**31, 2**32 - 1, len(data)])))
    return bytes(changed)
