# SPDX-License-Identifier: Apache-2.0
"""The maps of the code, and the recipes of CONTRIBUTING, name what is there."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
from definitions import SUFFIXES, line_of

from docs.pages import ROOT, code_in_lines, name_of, text_of

MAPS = [ROOT / "docs/explanation" / name for name in ("follow-a-bake.md", "follow-an-update.md")]
SOURCES = ("core", "bindings", "python", "viewer/src")
AROUND = ("tests/contract", "tests/core", "tests/fuzz", "tests/oracles", "tests/python", "tests/viewer")
NAMED = re.compile(r"\[`([^`]+)`\]\(([^)]+)\)")


@cache
def words(folders: tuple[str, ...] = SOURCES) -> frozenset[str]:
    """Every word of the sources in these folders, comments included."""
    files = (path for folder in folders for path in (ROOT / folder).rglob("*") if path.suffix in SUFFIXES)
    return frozenset(word for path in files for word in re.findall(r"\w+", path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("path", MAPS, ids=name_of)
def test_functions_are_where_the_map_says(path: Path) -> None:
    named = NAMED.findall(text_of(path))
    assert len(named) >= 30
    missing = [
        f"{file}: {name}"
        for name, file in named
        if not (path.parent / file).is_file() or line_of(path.parent / file, name) is None
    ]
    assert missing == []


@pytest.mark.parametrize("path", [*MAPS, ROOT / "docs/reference/glossary.md"], ids=name_of)
def test_other_names_are_in_the_sources(path: Path) -> None:
    """Fields, options and messages that are named in passing."""
    unknown = {
        word for code in code_in_lines(text_of(path)) for word in re.findall(r"[A-Za-z_]\w+", code)
    } - words()
    assert unknown == set()


def test_recipes_name_what_there_is() -> None:
    """In CONTRIBUTING's sections on adding something; its files and commands are checked as all are."""
    sections = re.findall(
        r"^## Adding .*?(?=^## )", text_of(ROOT / "CONTRIBUTING.md"), re.MULTILINE | re.DOTALL
    )
    assert len(sections) == 6
    named = [code for code in code_in_lines("".join(sections)) if not re.search(r"[/ ]", code)]
    unknown = {word for code in named for word in re.findall(r"[A-Za-z_]\w+", code)}
    unknown -= words((*SOURCES, *AROUND, "tools")) | {"CHANGELOG", "NAME", "README", "bind_NAME", "grep"}
    assert unknown == set()


@pytest.mark.parametrize(
    ("file", "name", "found"),
    [
        ("core/trace/walk.cpp", "Walk::scatter", True),
        ("core/trace/walk.cpp", "Walk::fall", False),
        ("core/trace/walk.cpp", "scatter", False),  # called there, and a member
        ("core/trace/walk.cpp", "facing_normal", False),  # called there
        ("core/trace/scatter.h", "facing_normal", True),
        ("core/gather/hits/gather_hits.cpp", "GatherHits::Caster::cast", True),
        ("core/gather/hits/gather_hits.cpp", "Looks::Caster::closest", False),  # called there
        ("core/gather/aim/ray_counts.h", "RayCounts::count", True),
        ("core/segments/segment_store.h", "Segment", True),
        ("python/deltalux/session/session.py", "Session.move", True),
        ("python/deltalux/session/session.py", "Session.moved", False),
        ("python/deltalux/session/session.py", "Session.pose_matrix", False),
        ("python/deltalux/scene/flatten.py", "flatten", True),
        ("python/deltalux/session/session.py", "flatten", False),  # imported there
        ("viewer/src/remoteSession.ts", "RemoteSession.drag", True),
        ("viewer/src/remoteSession.ts", "RemoteSession.send", False),  # of another class
        ("viewer/src/protocol.ts", "decodeFrame", True),
        ("viewer/src/connection.ts", "decodeFrame", False),  # imported there
    ],
)
def test_definitions_are_told_from_uses(file: str, name: str, found: bool) -> None:
    assert (line_of(ROOT / file, name) is not None) is found
