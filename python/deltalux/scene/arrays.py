# SPDX-License-Identifier: Apache-2.0
"""Arrays in scenes: checked, copied, read-only."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux.errors import SceneError

NUMBER, VECTOR = (), (3,)  # shapes of the fields of lights and surfaces


def frozen_array(values: Any, dtype: Any, shape: tuple[int, ...], what: str) -> np.ndarray:
    """Copy `values` to a read-only array of `dtype`; -1 in `shape` matches any length."""
    try:
        array = np.array(values, dtype=dtype)
    except (TypeError, ValueError) as error:
        raise SceneError(f"{what}: found {values!r:.60}, expected numbers ({error})") from None
    matches = array.ndim == len(shape) and all(n in (-1, m) for n, m in zip(shape, array.shape, strict=True))
    if not matches:
        raise SceneError(f"{what}: found shape {array.shape}, expected {shape} (-1 = any)")
    if np.issubdtype(array.dtype, np.floating) and not np.isfinite(array).all():
        bad = np.argwhere(~np.isfinite(array))[0]
        raise SceneError(
            f"{what}: found {array[tuple(bad)]} at index {tuple(int(i) for i in bad)}, "
            "expected finite numbers; repair the input"
        )
    array.setflags(write=False)
    return array
