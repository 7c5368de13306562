# SPDX-License-Identifier: Apache-2.0
"""Mutations of files of words in lines: OBJ and MTL."""

from __future__ import annotations

from collections.abc import Callable

from fuzz.mutate_bytes import change_bytes
from fuzz.mutate_json import Rng, pick

_WORDS = """0 1 -1 2 3 -3 999999 4294967296 -2147483649 1e30 -1e30 1e999 nan inf 1e-320 0x10 1_0 ½ ٣
1/2/3 1//2 /// -"""
WORDS = [
    *_WORDS.split(),
    "",
    "\\",
    "#",
    '"',
    "\x00",
    "\ufeff",
    "9" * 400,
    "1" * 5000,
    "../x.mtl",
    "/dev/zero",
    ".",
]
_KEYS = """v f o g s vt vn usemtl mtllib l p curv newmtl
Kd Ke map_Kd map_Ke d Tr illum Ns Pr call sh"""
KEYS = _KEYS.split()
MAX_LINES = 4000


def _words_of(rng: Rng, lines: list[str]) -> tuple[int, list[str]]:
    at = int(rng.integers(len(lines)))
    return at, lines[at].split(" ")


def replace_word(rng: Rng, lines: list[str]) -> None:
    """Any word at any place."""
    at, words = _words_of(rng, lines)
    words[rng.integers(len(words))] = str(pick(rng, [*WORDS, *KEYS]))
    lines[at] = " ".join(words)


def replace_value(rng: Rng, lines: list[str]) -> None:
    """A hostile number in place of a value, not of a key."""
    at, words = _words_of(rng, lines)
    if len(words) > 1:
        words[rng.integers(1, len(words))] = str(pick(rng, WORDS))
    lines[at] = " ".join(words)


def insert_word(rng: Rng, lines: list[str]) -> None:
    """A word too many, or many."""
    at, words = _words_of(rng, lines)
    place = int(rng.integers(len(words) + 1))
    words[place:place] = [str(pick(rng, [*WORDS, *words]))] * int(pick(rng, [1, 1, 1, 2, 500]))
    lines[at] = " ".join(words)


def drop_word(rng: Rng, lines: list[str]) -> None:
    """A word too few."""
    at, words = _words_of(rng, lines)
    del words[rng.integers(len(words))]
    lines[at] = " ".join(words)


def move_line(rng: Rng, lines: list[str]) -> None:
    """Another order: faces before their vertices, say."""
    line = lines.pop(int(rng.integers(len(lines))))
    lines.insert(int(rng.integers(len(lines) + 1)), line)


def drop_lines(rng: Rng, lines: list[str]) -> None:
    """Some lines less."""
    at = int(rng.integers(len(lines)))
    del lines[at : at + int(pick(rng, [1, 1, 3, 20]))]


def repeat_lines(rng: Rng, lines: list[str]) -> None:
    """The same again, a few times or many."""
    at = int(rng.integers(len(lines)))
    piece = lines[at : at + int(pick(rng, [1, 1, 5, 30]))]
    count = min(int(pick(rng, [1, 2, 100, 1000])), max(MAX_LINES // max(len(piece), 1), 1))
    lines[at:at] = piece * count


def add_statement(rng: Rng, lines: list[str]) -> None:
    """A statement from nowhere."""
    words = [str(pick(rng, KEYS)), *(str(pick(rng, WORDS)) for _ in range(rng.integers(6)))]
    lines.insert(int(rng.integers(len(lines) + 1)), " ".join(words))


def continue_lines(rng: Rng, lines: list[str]) -> None:
    """Backslashes at the ends of lines."""
    at = int(rng.integers(len(lines)))
    for i in range(at, min(at + int(pick(rng, [1, 2, 50])), len(lines))):
        lines[i] += "\\"


CHANGES: list[Callable[[Rng, list[str]], None]] = [
    *[replace_value] * 5,
    *[replace_word] * 2,
    *[drop_word] * 2,
    *[insert_word] * 2,
    move_line,
    drop_lines,
    repeat_lines,
    add_statement,
    continue_lines,
]


def mutated_text(rng: Rng, text: str) -> bytes:
    """Change words and lines, sometimes bytes too."""
    lines = text.split("\n")
    kind = rng.random()
    if kind < 0.9:
        for _ in range(rng.geometric(0.4)):
            if lines:
                pick(rng, CHANGES)(rng, lines)
    data = str(pick(rng, ["\n"] * 18 + ["\r\n", "\r"])).join(lines).encode("utf-8", "replace")
    return change_bytes(rng, data) if kind > 0.8 else data
