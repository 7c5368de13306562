# SPDX-License-Identifier: Apache-2.0
"""Reference files that are made in stages: a run that was stopped goes on where it was."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray]


def fill(path: Path, arrays: Arrays, header: Arrays, stages: Mapping[str, Callable[[], Arrays]]) -> Arrays:
    """Add what is missing, writing the file after each stage; `stages` by an array that each makes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    for name, stage in stages.items():
        if name in arrays:
            continue
        start, cpu = time.perf_counter(), time.process_time()
        arrays |= stage() | header
        aside = path.with_suffix(".part.npz")
        np.savez_compressed(aside, **arrays)
        aside.rename(path)
        spent = time.perf_counter() - start, time.process_time() - cpu
        print(f"{name}: {spent[0]:.0f} s, {spent[1]:.0f} s of CPU", flush=True)
    return arrays


def compact(**arrays: NDArray) -> Arrays:
    """In single precision, errors in half."""
    return {
        name: np.asarray(array, np.float16 if name.endswith("_error") else np.float32)
        for name, array in arrays.items()
    }
