# SPDX-License-Identifier: Apache-2.0
"""Light segments as arrays: traced from a scene, from a user, or uniform lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from . import _core
from .errors import OptionError
from .flatten import flatten
from .scene import Scene

Progress = Callable[[str, float], Any]
POWER_BITS = 30  # of the strongest segment's quanta
BATCHES = 8  # independent estimates behind a session's standard error
MAX_BOUNCES = 64


class Segments:
    """Straight flights of light.

    Parameters
    ----------
    origin, direction : (n, 3) arrays; directions are scaled to unit length
    length : (n,) array, metres to the first hit
    power : (n,) or (n, 3) array, not negative
    extended : (n,) array or None
        Metres to the second hit; None = `length`.
    path, bounce, group : (n,) arrays or None
        None: every segment is a path of its own, bounce 0, group 0.

    Raises
    ------
    OptionError
        For arrays that differ in length, NaN, or negative power.
    """

    def __init__(
        self,
        origin: Any,
        direction: Any,
        length: Any,
        power: Any,
        extended: Any = None,
        *,
        path: Any = None,
        bounce: Any = None,
        group: Any = None,
    ) -> None:
        self.origin = _column(origin, "origin", 3, np.float32)
        count = len(self.origin)
        directions = _column(direction, "direction", 3, np.float64, count)
        norms = np.linalg.norm(directions, axis=1, keepdims=True)
        if (norms == 0).any():
            raise OptionError(
                f"segments: direction: found zero at row {np.argmin(norms)}, expected a direction"
            )
        # Unit vectors pass unchanged: dividing again would alter their last bits.
        unit = np.abs(norms - 1) < 1e-6
        self.direction = np.where(unit, directions, directions / norms).astype(np.float32)
        self.length = _column(length, "length", 1, np.float32, count, infinite=True)
        self.extended = (
            self.length.copy()
            if extended is None
            else np.maximum(self.length, _column(extended, "extended", 1, np.float32, count, infinite=True))
        )
        if (self.length < 0).any():
            raise OptionError("segments: length: found a negative value, expected metres")
        power = np.asarray(power, np.float64)
        if power.ndim == 0:
            power = np.full(count, power)
        if power.ndim == 1:
            power = np.repeat(power[:, None], 3, axis=1)
        self.power = _column(power, "power", 3, np.float64, count)
        if (self.power < 0).any():
            raise OptionError("segments: power: found a negative value, expected none")
        self.path = np.arange(count, dtype=np.uint32) if path is None else np.asarray(path, np.uint32)
        self.bounce = np.zeros(count, np.uint8) if bounce is None else np.asarray(bounce, np.uint8)
        self.group = np.zeros(count, np.uint32) if group is None else np.asarray(group, np.uint32)
        most = self.power.max(initial=0.0)
        self.quantum = most / 2.0**POWER_BITS if most > 0 else 1.0
        self.quanta = np.rint(self.power / self.quantum).astype(np.uint32)

    def __len__(self) -> int:
        return len(self.origin)

    def select(self, which: Any) -> Segments:
        """The segments of a mask or an index array, with the same quanta."""
        part = object.__new__(Segments)
        for name, value in vars(self).items():
            setattr(part, name, value if name == "quantum" else np.ascontiguousarray(value[which]))
        return part

    def __repr__(self) -> str:
        return f"Segments({len(self)}, {len(np.unique(self.path))} paths)"


def _column(
    values: Any, what: str, width: int, dtype: Any, count: int | None = None, infinite: bool = False
) -> np.ndarray:
    try:
        array = np.array(values, dtype=dtype, order="C")
    except (TypeError, ValueError) as error:
        raise OptionError(f"segments: {what}: expected numbers ({error})") from None
    shape_ok = array.ndim == 2 and array.shape[1] == 3 if width == 3 else array.ndim == 1
    if not shape_ok or (count is not None and len(array) != count):
        rows = "n" if count is None else str(count)
        wanted = f"({rows}, 3)" if width == 3 else f"({rows},)"
        raise OptionError(f"segments: {what}: found shape {array.shape}, expected {wanted}")
    bad = np.isnan(array) if infinite else ~np.isfinite(array)
    if bad.any():
        raise OptionError(f"segments: {what}: found {array[bad][0]}, expected finite numbers")
    return array


def trace(
    scene: Scene,
    paths: int = 100_000,
    seed: int = 1,
    *,
    threads: int | None = None,
    max_bounces: int = MAX_BOUNCES,
    progress: Progress | None = None,
) -> Segments:
    """Trace light paths: the segments that a session with the same arguments stores.

    Parameters
    ----------
    scene : Scene
    paths : number of light particles, shared among the lights by power
    seed : every random number is a function of (seed, path, bounce, dimension)

    Returns
    -------
    Segments
        With `path`, `bounce`, `group`; `extended` reaches to the second hit or the scene's border.
    """
    _check_count(paths, "paths")
    flat = flatten(scene)
    columns = _core.trace_paths(flat.core, paths, seed, max_bounces, BATCHES, True, threads or 0, progress)
    segments = object.__new__(Segments)
    quantum = columns.pop("quantum")
    segments.quanta = columns.pop("power")
    for name, value in columns.items():
        setattr(segments, name, value)
    segments.quantum = quantum
    segments.power = segments.quanta * quantum
    return segments


def uniform_lines(count: int, seed: int = 1) -> Segments:
    """Chords of the unit sphere through two uniform points of its surface (paper 4.2, Figure 8)."""
    _check_count(count, "uniform_lines")
    ends = _core.uniform_lines(count, seed)
    chord = ends[:, 1].astype(np.float64) - ends[:, 0]
    length = np.linalg.norm(chord, axis=1)
    length[length == 0] = np.finfo(np.float32).tiny
    direction = np.where(length[:, None] > 1e-30, chord / length[:, None], (0.0, 0.0, 1.0))
    return Segments(ends[:, 0], direction, length, np.full(count, 1.0 / count))


def _check_count(count: int, what: str) -> None:
    if not 1 <= count < 2**32:
        raise OptionError(f"{what}: found {count}, expected 1 to 4e9")
