# SPDX-License-Identifier: Apache-2.0
"""Light segments as arrays: traced in a scene, given by a user, or uniform lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from . import _core
from .errors import OptionError
from .scene import Scene
from .scene.flatten import flatten

Progress = Callable[[str, float], Any]
POWER_BITS = 30  # bits of the strongest segment's quanta
BATCHES = 8  # independent batches, from which a session computes standard errors
MAX_BOUNCES = 1000


class Places(Protocol):
    """What `trace` reads of a `Samples`."""

    points: np.ndarray
    normals: np.ndarray
    attached: np.ndarray


class Segments:
    """Straight segments of light paths.

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
        For arrays of different lengths, NaN, or negative power.

    Notes
    -----
    In a scene far from zero, traced segments have `origin` in float64. Disc methods then compute in
    coordinates near the scene, as sessions do; the other methods in single precision relative to zero.
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
        # Unit vectors are not normalised again: that would change their last bits.
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
        self.power = _column(_per_channel(power, count), "power", 3, np.float64, count)
        if (self.power < 0).any():
            raise OptionError("segments: power: found a negative value, expected none")
        self.path = _numbers(np.arange(count) if path is None else path, "path", np.uint32, count)
        self.bounce = _numbers(np.zeros(count) if bounce is None else bounce, "bounce", np.uint16, count)
        self.group = _numbers(np.zeros(count) if group is None else group, "group", np.uint32, count)
        self.primitive: np.ndarray | None = None  # triangle hit; traced segments only
        self.frame = np.zeros(3)  # origin of the core's coordinates
        most = self.power.max(initial=0.0)
        self.quantum = most / 2.0**POWER_BITS if most > 0 else 1.0
        self.quanta = np.rint(self.power / self.quantum).astype(np.uint32)

    def __len__(self) -> int:
        return len(self.origin)

    def select(self, which: Any) -> Segments:
        """The segments that a mask or an index array selects, with the same quanta."""
        part = object.__new__(Segments)
        for name, value in vars(self).items():
            single = name in ("quantum", "frame") or value is None
            setattr(part, name, value if single else np.ascontiguousarray(value[which]))
        return part

    def __repr__(self) -> str:
        return f"Segments({len(self)}, {len(np.unique(self.path))} paths)"


def _per_channel(power: Any, count: int) -> Any:
    """One number, or one per segment, repeated for all three channels."""
    power = np.asarray(power)
    if power.ndim == 0:
        power = np.full(count, power)
    return np.repeat(power[:, None], 3, axis=1) if power.ndim == 1 else power


def _numbers(values: Any, what: str, dtype: Any, count: int) -> np.ndarray:
    """Whole numbers that fit `dtype`."""
    exact = _column(values, what, 1, np.float64, count)
    bad = (exact != np.floor(exact)) | (exact < 0) | (exact > np.iinfo(dtype).max)
    if bad.any():
        raise OptionError(
            f"segments: {what}: found {exact[bad][0]:g}, expected integers from 0 to {np.iinfo(dtype).max}"
        )
    return exact.astype(dtype)


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
    samples: Places | None = None,
    threads: int | None = None,
    max_bounces: int = MAX_BOUNCES,
    progress: Progress | None = None,
) -> Segments:
    """Trace light paths: the segments that a session with the same arguments stores.

    Parameters
    ----------
    scene : Scene
    paths : number of light paths, shared among the lights by importance
    seed : every random number is a function of (seed, path, bounce, dimension)
    samples : Samples or None
        Where light is wanted: lights get paths, and suns are aimed, by what they bring to samples of
        nothing movable. None: to surfaces everywhere.

    Returns
    -------
    Segments
        With `path`, `bounce`, `group`; `extended` reaches to the second hit or the scene's bounds.
    """
    check_paths(paths)
    check_seed(seed)
    check_threads(threads)
    check_bounces(max_bounces)
    flat = flatten(scene)
    columns = _core.trace_paths(
        flat.core,
        *_wanted(samples, flat.origin),
        paths,
        seed,
        max_bounces,
        BATCHES,
        True,
        threads or 0,
        progress,
    )
    segments = object.__new__(Segments)
    quantum = columns.pop("quantum")
    segments.quanta = columns.pop("power")
    for name, value in columns.items():
        setattr(segments, name, value)
    segments.quantum = quantum
    segments.power = segments.quanta * quantum
    segments.frame = flat.origin
    # far from zero, single precision cannot represent the coordinates
    if flat.origin.any():
        segments.origin = segments.origin + flat.origin
    return segments


def _wanted(samples: Places | None, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of the samples that nothing movable carries, as the core sees them."""
    if samples is None:
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    still = np.array([name is None for name in samples.attached], bool)
    return (
        np.ascontiguousarray(samples.points[still] - origin, np.float32),
        np.ascontiguousarray(samples.normals[still], np.float32),
    )


def landings(scene: Scene, paths: int, seed: int, max_bounces: int) -> tuple[np.ndarray, np.ndarray]:
    """Where the segments that `trace` would return end.

    Returns
    -------
    triangle : (n,) uint32, index among all static triangles, NOTHING = no hit
    direction : (n, 3) float32
    """
    nowhere = _wanted(None, np.zeros(3))
    columns = _core.trace_paths(
        flatten(scene).core, *nowhere, paths, seed, max_bounces, BATCHES, False, 0, None
    )
    return columns["primitive"], columns["direction"]


def uniform_lines(count: int, seed: int = 1) -> Segments:
    """Chords of the unit sphere through two uniform points of its surface (paper 4.2, Figure 8)."""
    check_integer("uniform_lines", count, 1, 2**32 - 1)
    check_seed(seed)
    ends: Any = _core.uniform_lines(count, seed)
    chord = ends[:, 1].astype(np.float64) - ends[:, 0]
    length = np.linalg.norm(chord, axis=1)
    length[length == 0] = np.finfo(np.float32).tiny
    direction = np.where(length[:, None] > 1e-30, chord / length[:, None], (0.0, 0.0, 1.0))
    return Segments(ends[:, 0], direction, length, np.full(count, 1.0 / count))


def check_paths(paths: Any) -> None:
    """Raise OptionError unless `paths` is a number of light paths."""
    check_integer("paths", paths, 1, 2**32 - 16)


def check_seed(seed: Any) -> None:
    """Raise OptionError unless `seed` fits 64 bits."""
    check_integer("seed", seed, 0, 2**64 - 1)


def check_threads(threads: Any) -> None:
    """Raise OptionError unless `threads` is a number of threads or None."""
    if threads is not None:
        check_integer("threads", threads, 1, 1024, "; None = all")


def check_bounces(max_bounces: Any) -> None:
    """Raise OptionError unless `max_bounces` is a valid largest number of segments of a path."""
    check_integer("max_bounces", max_bounces, 1, 10_000)


def check_integer(what: str, value: Any, least: int, most: int, remedy: str = "") -> None:
    """Raise OptionError unless `value` is an integer from `least` to `most`."""
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or not least <= value <= most:
        raise OptionError(f"{what}: found {value!r}, expected an integer from {least} to {most}{remedy}")
