# SPDX-License-Identifier: Apache-2.0
"""Names that users type: wildcards, and lists that help to find what was meant."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from fnmatch import fnmatchcase

_NEAREST, _SHOWN = 8, 16


def matches(pattern: str, name: str) -> bool:
    """Whether `pattern` is that name or, with ``*``, ``?`` or ``[...]``, describes it."""
    return pattern == name or fnmatchcase(name, pattern)


def chosen(pattern: str, names: Sequence[str]) -> list[str]:
    """Those of `names` that `pattern` means: the one of just that name, else all that it describes."""
    return [pattern] if pattern in names else [name for name in names if matches(pattern, name)]


def meant_by(word: str, names: Sequence[str]) -> list[str]:
    """Which of `names`, numbered where they repeat ("lamp", "lamp#2", …), a word means.

    "lamp" means all of that name, "lamp#1" the first alone; wildcards describe several. What means none stays
    as it is, so that whoever takes it can refuse it.
    """
    first = word.removesuffix("#1")
    if word in names:
        start = f"{word}#"
        return [n for n in names if n == word or (n.startswith(start) and n[len(start) :].isdecimal())]
    return [first] if first in names else chosen(word, names) or [word]


def candidates(word: str, names: Sequence[str]) -> str:
    """Names like `word`, those that contain it, then others, and how many more; "" where there are none."""
    plain = word.strip("*?")
    near = difflib.get_close_matches(plain, names, n=_NEAREST, cutoff=0.5)
    holding = [name for name in names if plain.casefold() in name.casefold()]
    ordered = list(dict.fromkeys([*near, *holding, *names]))
    more = len(ordered) - _SHOWN
    return ", ".join(ordered[:_SHOWN]) + (f" and {more} more" if more > 0 else "")
