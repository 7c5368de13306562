# SPDX-License-Identifier: Apache-2.0
"""Converts a file's unit and upward axis to metres and Y up, and warns of unusual sizes."""

from __future__ import annotations

import math

import numpy as np

from deltalux.errors import OptionError
from deltalux.scene import Scene

METRES = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254, "ft": 0.3048}
UP = ("y", "z")
# Usual range of a scene's longest side, metres. Outside it, the unit may be wrong, as for a ten-metre room in
# centimetres or inches.
USUAL_LENGTH = (1.0, 300.0)
_LEAST, _MOST = 1e-9, 1e9  # metres per unit


def space_matrix(unit: str | float | None, up: str) -> np.ndarray | None:
    """4x4 matrix from a file's space to metres with Y up; None if that is the file's space already.

    Parameters
    ----------
    unit : a name in `METRES`, or metres per unit; None = metres
    up : "y" or "z"

    Raises
    ------
    OptionError
    """
    scale = METRES.get(unit, math.nan) if isinstance(unit, str) else 1.0 if unit is None else float(unit)
    if not _LEAST <= scale <= _MOST:
        raise OptionError(f"unit: found {unit!r}, expected one of {', '.join(METRES)}, or metres per unit")
    if up not in UP:
        raise OptionError(f"up: found {up!r}, expected one of {', '.join(UP)}")
    if scale == 1 and up == "y":
        return None
    matrix = np.diag((scale, scale, scale, 1.0))
    if up == "z":
        matrix[1:3, 1:3] = ((0.0, scale), (-scale, 0.0))
    return matrix


def size_questions(scene: Scene) -> list[str]:
    """One sentence that asks for the unit of a scene of unusual size; none for others."""
    low, high = scene.bounds
    longest = float((high - low).max())
    least, most = USUAL_LENGTH
    if longest == 0 or least <= longest <= most:
        return []
    size = " × ".join(f"{length:.3g}" for length in high - low)
    return [
        f"the scene measures {size} m: are its numbers metres? If not, give their unit (--unit mm, cm, in, "
        "ft, or metres per unit)"
    ]
