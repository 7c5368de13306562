# SPDX-License-Identifier: Apache-2.0
"""Messages of readers: errors with place, found and expected; warnings grouped by kind."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from typing import Any, TypeVar

from deltalux.errors import FormatError

SHOWN_ITEMS = 4
ALL_NAMES = "`deltalux info FILE --nodes` shows all, * stands for any letters"
MAX_NAME = 120
MISSING_REFLECTANCE = 0.8  # of surfaces without a material: plaster, light paint
UNREADABLE = "textures that cannot be read: the plain colour counts"
MEAN_GLOW = "textures of emission with coordinates of their own count with their mean colour"
MISSING = (
    "surfaces without a material reflect {:g}, as light paint does; another reflectance: --reflectance R "
    "(reflectance=R)"
)

T = TypeVar("T")


class Notes:
    """Warnings of one load; warnings of the same kind share one line."""

    def __init__(self) -> None:
        self._items: dict[str, dict[str, None]] = {}

    def add(self, text: str, item: str = "") -> None:
        """Record a warning; `item` names the object that it is about."""
        items = self._items.setdefault(text, {})
        if item:
            items.setdefault(item)

    def lines(self) -> tuple[str, ...]:
        """One line per kind: the text, then the first few names."""
        return tuple(
            f"{text} ({listed(list(items))})" if items else text for text, items in self._items.items()
        )


def listed(names: Sequence[str], limit: int = SHOWN_ITEMS) -> str:
    """The first names, and the number of the others."""
    more = len(names) - limit
    return ", ".join(names[:limit]) + (f" and {more} more" if more > 0 else "")


def malformed(
    where: str, found: Any, expected: str, remedy: str = "repair or re-export the file"
) -> FormatError:
    """The error for a malformed file; a string in `found` is a description, not a value."""
    shown = found if isinstance(found, str) else reprlib.repr(found)
    return FormatError(f"{where}: found {shown}, expected {expected}; {remedy}")


def element(items: Sequence[T], index: int, where: str) -> T:
    """`items[index]`; FormatError if the file's index is out of range."""
    if not 0 <= index < len(items):
        raise malformed(where, index, f"an index below {len(items)}")
    return items[index]


def clean_name(text: str) -> str:
    """A name that can be printed and encoded: control characters and lone surrogates are replaced."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text[:MAX_NAME])


class UniqueNames:
    """Makes names unique; a repeated name gets "#2", "#3", … appended."""

    def __init__(self) -> None:
        self._next: dict[str, int] = {}

    def take(self, name: str) -> str:
        """`name`, with a number appended if it is taken already."""
        candidate = name
        while candidate in self._next:
            self._next[name] += 1
            candidate = f"{name}#{self._next[name]}"
        self._next[candidate] = 1
        return candidate
