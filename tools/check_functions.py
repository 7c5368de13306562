# SPDX-License-Identifier: Apache-2.0
"""Checks that functions are short enough to hold in the head, or say why they are not.

A body of more than 60 lines needs a comment "long: " with the reason in the three lines before the function,
or in the first three of its body. Lines of a Python docstring do not count.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

MAX_LINES = 60
REASON = re.compile(r"(?://|#|\*) long: \w")
NEAR = 3  # lines between a reason and the function that it is for
BRACES = {".cpp", ".h", ".ts"}
HIDDEN = re.compile(  # directives, comments and strings, whose braces open nothing
    r"^ *#[^\n]*|//[^\n]*|/\*.*?\*/"
    r"|\"(?:\\.|[^\"\\\n])*\"|(?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])*'|`(?:\\.|[^`\\])*`",
    re.DOTALL | re.MULTILINE,
)
MEMBERS = re.compile(r"\)\s*(?:noexcept\s*)?:[^;]*\w$")  # of a constructor, before the brace of one
NO_FUNCTION = re.compile(
    r"^\s*(?:export\s+)?(?:if|for|while|switch|catch|namespace|struct|class|enum|union|extern|interface)\b"
)


class Function(NamedTuple):
    """Lines counted from 1; the body is between `first` and `last`, both without the braces."""

    name: str
    begin: int
    first: int
    last: int


def in_python(text: str) -> Iterator[Function]:
    """Yield every function of a Python source, nested ones too."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            told = ast.get_docstring(node, clean=False) is not None and len(node.body) > 1
            yield Function(node.name, node.lineno, node.body[told].lineno, node.end_lineno or node.lineno)


def in_braces(text: str) -> Iterator[Function]:
    """Yield the outermost functions of a C++ or TypeScript source: lambdas belong to those around them."""
    text = HIDDEN.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
    depth = statement = 0
    inside: tuple[int, int, str] | None = None  # depth, offset of the brace, header
    members = 0  # open braces of a constructor's list of members
    for place in re.finditer(r"[{};]", text):
        at, sign = place.start(), place[0]
        if sign == "{":
            header = text[statement:at]
            if members or (inside is None and MEMBERS.search(header)):
                members += 1
                continue
            if inside is None and "(" in header and not NO_FUNCTION.match(header):
                inside = depth, at, header
            depth += 1
        elif sign == "}":
            if members:
                members -= 1
                continue
            depth -= 1
            if inside is not None and depth == inside[0]:
                _, opened, header = inside
                begin = opened - len(header.lstrip())
                line, first, last = (text.count("\n", 0, k) + 1 for k in (begin, opened, at))
                yield Function(_name(header), line, first + 1, last - 1)
                inside = None
        if inside is None:
            statement = at + 1


def _name(header: str) -> str:
    return (
        re.findall(r"[\w:~.]+(?=\s*(?:<[^<>]*>)?\()", header) or [header.split("(")[0].strip() or "lambda"]
    )[0]


def check_file(path: Path) -> list[tuple[int, str]]:
    """Return (line number, problem) for one file."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    found = []
    for function in in_python(text) if path.suffix == ".py" else in_braces(text):
        length = function.last - function.first + 1
        near = lines[max(0, function.begin - 1 - NEAR) : function.first - 1 + NEAR]
        if length > MAX_LINES and not any(REASON.search(line) for line in near):
            what = f"{function.name}: {length} lines: split it, or say why not beside it (limit {MAX_LINES})"
            found.append((function.begin, what))
    return found


def main(root: Path) -> int:
    """Check the tree below `root`; return the exit code."""
    command = ["git", "ls-files", "-co", "--exclude-standard", "-z"]
    names = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
    paths = sorted(root / name for name in names.split("\0") if Path(name).suffix in {".py", *BRACES})
    files = [path for path in paths if path.is_file()]
    problems = [f"{p.relative_to(root)}:{line}: {what}" for p in files for line, what in check_file(p)]
    print("\n".join(problems) or f"check_functions: {len(files)} files keep the rule")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(Path(__file__).resolve().parent.parent))
