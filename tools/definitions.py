# SPDX-License-Identifier: Apache-2.0
"""Finds where a source file defines what a document names: C++, Python, TypeScript, shaders."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

CPP, PYTHON, TYPESCRIPT = (".h", ".cpp", ".glsl"), (".py",), (".ts",)
SUFFIXES = (*CPP, *PYTHON, *TYPESCRIPT)
_TYPE = r"(?!\s|(?:return|else|throw|new|delete|case)\b)(?:[\w:<>,&*\[\] ]+[ &*])?"  # before a function
_MODIFIERS = r"(?:private |readonly |static |async |get )*"


class _Body(NamedTuple):
    """Of a class: where it begins and ends, and the white space before its members."""

    first: int
    last: int
    indent: str


def line_of(path: Path, name: str) -> int | None:
    """Number of the line on which the file at `path` defines `name`; None where it does not.

    Parameters
    ----------
    path : a file with one of SUFFIXES, in the house format
    name : as its language writes it: A::b, A.b, or b
    """
    text = path.read_text(encoding="utf-8")
    if path.suffix in CPP:
        place = _place_in_cpp(text, name)
    else:
        owner, _, own = name.rpartition(".")
        place = (_place_in_python if path.suffix in PYTHON else _place_in_typescript)(text, owner, own)
    return None if place is None else text.count("\n", 0, place) + 1


def _place_in_cpp(text: str, name: str) -> int | None:
    """Of a function outside of its class, of a class, or of a member."""
    owner, _, own = name.rpartition("::")
    place = _place(rf"^{_TYPE}{name}\(", text)
    if place is None:
        place = _place(rf"^(?:  )?(?:struct|class|enum class) (?:\w+::)*{own}\b[^;]*\{{", text)
    if place is None and owner:
        begin = rf"^ *(?:struct|class) (?:\w+::)*{owner.rpartition('::')[2]}\b[^;]*\{{"
        place = _member(rf"{_TYPE}{own}\(", text, _body(begin, text, 2))
    return place


def _place_in_python(text: str, owner: str, own: str) -> int | None:
    if not owner:
        return _place(rf"^(?:async )?(?:def|class) {own}\b", text)
    return _member(rf"(?:async )?def {own}\(", text, _body(rf"^class {owner}\b", text, 4, end=r"[^\s)]"))


def _place_in_typescript(text: str, owner: str, own: str) -> int | None:
    if not owner:
        return _place(rf"^(?:export )?(?:async )?(?:function|class|const) {own}\b", text)
    return _member(rf"{_MODIFIERS}{own}(?:\(| = \(|: )", text, _body(rf"^export class {owner}\b", text, 2))


def _body(begin: str, text: str, step: int, end: str = r"\}") -> _Body | None:
    """From what matches `begin` to the next line with its indent that goes on with `end`, or to the last."""
    first = re.search(begin, text, re.MULTILINE)
    if first is None:
        return None
    indent = " " * (len(first[0]) - len(first[0].lstrip(" ")))
    last = re.compile(rf"^{indent}{end}", re.MULTILINE).search(text, first.end())
    return _Body(first.end(), last.start() if last else len(text), indent + " " * step)


def _member(pattern: str, text: str, body: _Body | None) -> int | None:
    if body is None:
        return None
    match = re.compile(f"^{body.indent}{pattern}", re.MULTILINE).search(text, body.first, body.last)
    return match and match.start()


def _place(pattern: str, text: str) -> int | None:
    match = re.search(pattern, text, re.MULTILINE)
    return match and match.start()
