# SPDX-License-Identifier: Apache-2.0
"""Whether a source file defines what a document says it does: C++, Python, TypeScript, shaders."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from docs.pages import ROOT

_SUFFIXES = {".h", ".cpp", ".py", ".ts", ".glsl"}
SOURCES = ("core", "bindings", "python", "viewer/src")
AROUND = (
    "tests/contract",
    "tests/core",
    "tests/fuzz",
    "tests/oracles",
    "tests/python",
    "tests/viewer",
    "tools",
)
_NO_TYPE = r"(?!\s|(?:return|else|throw|new|delete|case)\b)"


def defines(path: Path, name: str) -> bool:
    """Whether the file at `path` defines `name`, written as its language does: A::b, A.b, or b."""
    text = path.read_text(encoding="utf-8")
    if path.suffix in {".h", ".cpp", ".glsl"}:
        return _defines_cpp(text, name)
    owner, _, own = name.rpartition(".")
    member = _python_member if path.suffix == ".py" else _typescript_member
    return member(text, owner.rpartition(".")[2], own)


def _defines_cpp(text: str, name: str) -> bool:
    type_before = rf"{_NO_TYPE}(?:[\w:<>,&*\[\] ]+[ &*])?"
    if _found(rf"^(?:  )?(?:struct|class|enum class) (?:\w+::)*{name.rpartition('::')[2]}\b[^;]*\{{", text):
        return True
    if _found(rf"^{type_before}{name}\(", text):
        return True
    owner, _, own = name.rpartition("::")
    of_class = owner and _found(rf"^(?:  )?(?:struct|class) (?:\w+::)*{owner.rpartition('::')[2]}\b", text)
    return bool(of_class) and _found(rf"^  {type_before}{own}\(", text)


def _python_member(text: str, owner: str, own: str) -> bool:
    if not owner:
        return _found(rf"^(?:async )?(?:def|class) {own}\b", text)
    body = re.search(rf"^class {owner}\b.*?(?=^\S|\Z)", text, re.MULTILINE | re.DOTALL)
    return body is not None and _found(rf"^    (?:async )?def {own}\(", body[0])


def _typescript_member(text: str, owner: str, own: str) -> bool:
    if not owner:
        return _found(rf"^(?:export )?(?:async )?(?:function|class|const) {own}\b", text)
    body = re.search(rf"^export class {owner}\b.*?^\}}", text, re.MULTILINE | re.DOTALL)
    modifiers = "(?:private |readonly |static |async |get )*"
    return body is not None and _found(rf"^  {modifiers}{own}(?:\(| = \(|: )", body[0])


def _found(pattern: str, text: str) -> bool:
    return re.search(pattern, text, re.MULTILINE) is not None


@cache
def words(folders: tuple[str, ...] = SOURCES) -> frozenset[str]:
    """Every word of the sources in these folders, comments included."""
    files = (path for folder in folders for path in (ROOT / folder).rglob("*") if path.suffix in _SUFFIXES)
    return frozenset(word for path in files for word in re.findall(r"\w+", path.read_text(encoding="utf-8")))
