# SPDX-License-Identifier: Apache-2.0
"""Checks of the arguments and the results of every equation."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

import numpy as np
from numpy.typing import ArrayLike

from deltalux.errors import OptionError

FORMS = ("corrected", "printed", "spacing")
P = ParamSpec("P")


def equation(function: Callable[P, np.ndarray]) -> Callable[P, np.ndarray]:
    """Decorate a function: OptionError if arguments do not broadcast or a result is not finite."""

    @wraps(function)
    def checked(*arguments: P.args, **options: P.kwargs) -> np.ndarray:
        name = function.__name__
        try:
            with np.errstate(all="ignore"):
                result = function(*arguments, **options)
        except OptionError:
            raise
        except ValueError as error:  # raised by NumPy for arrays that do not broadcast
            raise OptionError(
                f"{name}: found arrays of unequal shapes, expected ones that broadcast: {error}"
            ) from None
        if not np.isfinite(result).all():
            raise OptionError(
                f"{name}: found a result beyond 1.8e308, expected arguments of a scene; check their units"
            )
        return np.asarray(result)[()]  # a number if all arguments are numbers

    return checked


def numbers(name: str, value: ArrayLike) -> np.ndarray:
    """`value` as float64, of any shape; OptionError unless all are finite numbers."""
    try:
        array = np.asarray(value)
        good = array.dtype.kind in "iuf" and bool(np.isfinite(array).all())
    except (TypeError, ValueError):
        good = False
    if not good:
        raise OptionError(f"{name}: found {value!r}, expected finite numbers")
    return array.astype(np.float64)


def positive(name: str, value: ArrayLike) -> np.ndarray:
    """`value` (times, lengths, areas) as float64; OptionError unless all are above 0."""
    array = numbers(name, value)
    _require(name, array, array > 0, "a number above 0")
    return array


def at_least(least: float, name: str, value: ArrayLike) -> np.ndarray:
    """`value` (counts, whole or mean) as float64; OptionError unless all are at least `least`."""
    array = numbers(name, value)
    _require(name, array, array >= least, f"at least {least:g}")
    return array


def fraction(name: str, value: ArrayLike) -> np.ndarray:
    """`value` (Q) as float64; OptionError unless all lie between 0 and 1, both excluded."""
    array = numbers(name, value)
    _require(name, array, (array > 0) & (array < 1), "a number between 0 and 1, without them")
    return array


def whole(name: str, value: ArrayLike, least: int) -> np.ndarray:
    """`value` as float64; OptionError unless all are integers of at least `least`."""
    array = numbers(name, value)
    _require(name, array, (array >= least) & (array % 1 == 0), f"an integer of at least {least}")
    return array


def within(name: str, inner: np.ndarray, outer_name: str, outer: np.ndarray) -> None:
    """Raise OptionError if a body is larger than the body that encloses it."""
    if not np.all(inner <= outer):
        raise OptionError(
            f"{name}: found {inner}, expected at most {outer_name}, {outer}: it lies within the latter"
        )


def choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    """Raise OptionError if `value` is not one of the choices."""
    if not isinstance(value, str) or value not in choices:
        raise OptionError(f"{name}: found {value!r}, expected one of {choices}")


def _require(name: str, array: np.ndarray, good: np.ndarray, expected: str) -> None:
    if not np.all(good):
        raise OptionError(f"{name}: found {array[~good].flat[0]:g}, expected {expected}")
