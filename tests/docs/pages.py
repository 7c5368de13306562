# SPDX-License-Identifier: Apache-2.0
"""The documents as text: fenced blocks, code in lines, links; without what only the site shows."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = [
    *(
        ROOT / name
        for name in ("README.md", "CONTRIBUTING.md", "examples/README.md", "benchmarks/RESULTS.md")
    ),
    *sorted((ROOT / "docs").rglob("*.md")),
]
_SITE_ONLY = re.compile(r"<!-- site:\n.*?-->", re.DOTALL)
_FENCE = re.compile(r"^```([\w-]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_INLINE = re.compile(r"`([^`\n]+)`")
_LINK = re.compile(r"\]\((?!https?:|#)([^)#]+)[^)]*\)")


@dataclass(frozen=True)
class Block:
    """A fenced block; `line` is that of its first line in the document."""

    language: str
    text: str
    line: int


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def text_of(path: Path) -> str:
    """As other readers than the site's show it; lines keep their numbers."""
    return _SITE_ONLY.sub(lambda match: "\n" * match[0].count("\n"), path.read_text(encoding="utf-8"))


def site_only(path: Path) -> str:
    """What only the site shows."""
    return "\n".join(_SITE_ONLY.findall(path.read_text(encoding="utf-8")))


def blocks(text: str) -> list[Block]:
    return [
        Block(match[1], match[2], text.count("\n", 0, match.start(2)) + 1) for match in _FENCE.finditer(text)
    ]


def shell_lines(text: str) -> Iterator[str]:
    """Lines of `sh` blocks without comments."""
    for block in blocks(text):
        if block.language == "sh":
            yield from (line for row in block.text.splitlines() if (line := row.split(" #")[0].strip()))


def code_in_lines(text: str) -> list[str]:
    """What stands between single backticks outside of blocks."""
    return _INLINE.findall(_FENCE.sub("", text))


def links(text: str) -> list[str]:
    """Targets of relative links, without anchors."""
    return _LINK.findall(_FENCE.sub("", text))
