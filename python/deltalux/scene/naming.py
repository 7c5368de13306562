# SPDX-License-Identifier: Apache-2.0
"""Names that users type: wildcards, and suggestions for names that do not match."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from fnmatch import fnmatchcase

_NEAREST, _SHOWN = 8, 16


def matches(pattern: str, name: str) -> bool:
    """Whether `pattern` equals that name or, with ``*``, ``?`` or ``[...]``, matches it."""
    return pattern == name or fnmatchcase(name, pattern)


def chosen(pattern: str, names: Sequence[str]) -> list[str]:
    """The `names` that `pattern` selects: the one equal to it, else all that match it."""
    return [pattern] if pattern in names else [name for name in names if matches(pattern, name)]


def meant_by(word: str, names: Sequence[str]) -> list[str]:
    """The `names`, numbered if they repeat ("lamp", "lamp#2", …), that a word selects.

    "lamp" selects all of that name, "lamp#1" only the first; wildcards select several. A word that selects
    none is returned as it is, so that the caller can refuse it.
    """
    first = word.removesuffix("#1")
    if word in names:
        start = f"{word}#"
        return [n for n in names if n == word or (n.startswith(start) and n[len(start) :].isdecimal())]
    return [first] if first in names else chosen(word, names) or [word]


def candidates(word: str, names: Sequence[str]) -> str:
    """Suggestions for `word`: names that contain it, then others, and how many more; "" if there are none."""
    plain = word.strip("*?")
    near = difflib.get_close_matches(plain, names, n=_NEAREST, cutoff=0.5)
    holding = [name for name in names if plain.casefold() in name.casefold()]
    ordered = list(dict.fromkeys([*near, *holding, *names]))
    more = len(ordered) - _SHOWN
    return ", ".join(ordered[:_SHOWN]) + (f" and {more} more" if more > 0 else "")
