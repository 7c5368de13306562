# SPDX-License-Identifier: Apache-2.0
"""Values of an untrusted JSON object, checked when they are read."""

from __future__ import annotations

import sys
from collections.abc import Collection
from typing import Any

import numpy as np

from deltalux.errors import FormatError

_FAR = sys.float_info.max


class Fields:
    """One JSON object that must have exactly the fields `names`.

    Every method raises FormatError, which names the place in the index and the value found.
    """

    def __init__(self, value: Any, where: str, names: Collection[str]) -> None:
        if not isinstance(value, dict):
            raise _refused(where, value, "an object")
        if set(value) != set(names):
            odd = sorted(set(value) ^ set(names))[0]
            found = "it" if odd in value else "nothing"
            raise _refused(f"{where}.{odd}", found, f"the fields {sorted(names)}")
        self._values, self._where = value, where

    def _take(self, name: str, good: bool, expected: str) -> Any:
        if not good:
            raise _refused(f"{self._where}.{name}", self._values[name], expected)
        return self._values[name]

    def integer(self, name: str, least: int, most: int) -> int:
        """An integer from `least` to `most`."""
        return self._take(name, _is_integer(self._values[name], least, most), f"an integer {least} to {most}")

    def integers(self, name: str, least: int, most: int, count: int | None = None) -> list[int]:
        """A list of integers from `least` to `most`, of `count` if given."""
        value = self._values[name]
        good = (
            isinstance(value, list)
            and count in (None, len(value))
            and all(_is_integer(number, least, most) for number in value)
        )
        amount = "" if count is None else f"{count} "
        return self._take(name, good, f"{amount}integers {least} to {most}")

    def optional_number(self, name: str, least: float = -_FAR, most: float = _FAR) -> float | None:
        """A number from `least` to `most`, or None."""
        return None if self._values[name] is None else self.number(name, least, most)

    def number(self, name: str, least: float = -_FAR, most: float = _FAR) -> float:
        """A number from `least` to `most`."""
        good = _is_number(self._values[name], least, most)
        return self._take(name, good, f"a number {least:g} to {most:g}")

    def boolean(self, name: str) -> bool:
        """True or False."""
        return self._take(name, isinstance(self._values[name], bool), "true or false")

    def text(self, name: str) -> str:
        """A string."""
        return self._take(name, isinstance(self._values[name], str), "a text")

    def optional_text(self, name: str) -> str | None:
        """A string, or None."""
        return None if self._values[name] is None else self.text(name)

    def texts(self, name: str) -> list[str]:
        """A list of strings."""
        value = self._values[name]
        good = isinstance(value, list) and all(isinstance(text, str) for text in value)
        return self._take(name, good, "a list of texts")

    def numbers(self, name: str, *shape: int, least: float = -_FAR, most: float = _FAR) -> np.ndarray:
        """Float64 numbers of this shape, at most two dimensions, from `least` to `most`."""
        value = self._values[name]
        rows = value if len(shape) == 2 else [value]
        good = (
            isinstance(rows, list)
            and (len(shape) == 1 or len(rows) == shape[0])
            and all(isinstance(row, list) and len(row) == shape[-1] for row in rows)
            and all(_is_number(number, least, most) for row in rows for number in row)
        )
        expected = f"numbers of shape {shape}, {least:g} to {most:g}"
        return np.array(self._take(name, good, expected), np.float64).reshape(shape)

    def objects(self, name: str, names: Collection[str]) -> list[Fields]:
        """A list of objects with exactly the fields `names`."""
        values = self._take(name, isinstance(self._values[name], list), "a list")
        return [Fields(value, f"{self._where}.{name}[{i}]", names) for i, value in enumerate(values)]

    def child(self, name: str, names: Collection[str]) -> Fields:
        """An object with exactly the fields `names`."""
        return Fields(self._values[name], f"{self._where}.{name}", names)

    def any(self, name: str) -> Any:
        """The value, unchecked; the caller checks it."""
        return self._values[name]


def _is_integer(value: Any, least: int, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and least <= value <= most


def _is_number(value: Any, least: float, most: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and least <= value <= most


def _refused(where: str, found: Any, expected: str) -> FormatError:
    shown = found if isinstance(found, str) and found in ("it", "nothing") else f"{found!r:.60}"
    return FormatError(f"{where}: found {shown}, expected {expected}")
