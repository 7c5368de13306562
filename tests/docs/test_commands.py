# SPDX-License-Identifier: Apache-2.0
"""What documents tell to type can be typed: commands, targets of make, options of CMake, extras, files."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from deltalux.cli import app
from typer import TyperException
from typer.main import get_command

from docs.pages import DOCUMENTS, ROOT, blocks, code_in_lines, links, name_of, shell_lines, text_of

COMMANDS = get_command(app).commands  # type: ignore[attr-defined]
PROGRAMS = {
    ".",
    "build/dev/deltalux_core_tests",
    "cmake",
    "deltalux",
    "make",
    "ninja",
    "pip",
    "pytest",
    "python",
}
ASSIGNMENT = re.compile(r"[A-Z_]+=\S*")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
CMAKE = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
PROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
FOLDERS = "benchmarks|bindings|core|docs|examples|python|tests|tools|viewer"
FILE = re.compile(rf"(?<![\w./-])(?:{FOLDERS})/[\w./*-]*[\w*/]")
TYPED = re.compile(r"(?:\.venv/bin/)?(?:deltalux|make|pip|pytest|python) ")
MADE = ("benchmarks/out",)  # by programs


class Wrong(Exception):
    """What cannot be typed."""


def program_of(line: str) -> tuple[str, list[str]]:
    """The program of a command line, wherever it lies, and its words."""
    words = shlex.split(line)
    while words and ASSIGNMENT.fullmatch(words[0]):
        words.pop(0)
    if not words:
        return "", []
    return words[0].removeprefix(".venv/bin/"), words[1:]


def check_deltalux(words: list[str]) -> None:
    """Parse the words without running them; a verb alone is a name, not a command line."""
    verb, *rest = words
    if verb == "COMMAND":
        return
    if verb not in COMMANDS:
        raise Wrong(f"found no command {verb}, expected one of {sorted(COMMANDS)}")
    if not rest or rest == ["--help"]:
        return
    try:
        COMMANDS[verb].make_context(verb, rest)
    except TyperException as error:
        raise Wrong(error.format_message()) from None


def check_make(words: list[str]) -> None:
    for word in words:
        name, equals, _ = word.partition("=")
        pattern = rf"^{re.escape(name)} \?=" if equals else rf"^{re.escape(name)}:.*##"
        if not re.search(pattern, MAKEFILE, re.MULTILINE):
            raise Wrong(f"found no {'variable' if equals else 'target'} {name} in the Makefile")


def check_line(line: str) -> None:
    """Check a command line.

    Raises
    ------
    Wrong
    """
    program, words = program_of(line)
    if program == "deltalux" and words:
        check_deltalux(words)
    if program == "make":
        check_make(words)
    for option in re.findall(r"-D(DELTALUX_\w+)", line):
        if not re.search(rf"\b{option}\b", CMAKE):
            raise Wrong(f"found no option {option} in CMakeLists.txt")
    for extra in re.findall(r"deltalux\[(\w+)\]", line):
        if not re.search(rf"^{extra} = \[", PROJECT, re.MULTILINE):
            raise Wrong(f"found no extra {extra} in pyproject.toml")
    for group in re.findall(r"--group (\w+)", line):
        if not re.search(rf"^{group} = \[", PROJECT, re.MULTILINE):
            raise Wrong(f"found no group {group} in pyproject.toml")
    for file in FILE.findall(line):
        if "NAME" not in file and not file.startswith(MADE) and not any(ROOT.glob(file)):
            raise Wrong(f"found no file {file}")


def all_lines(path: Path) -> Iterator[str]:
    """Lines of shell blocks, and code in lines that looks like a command or a file."""
    yield from shell_lines(text_of(path))
    for code in code_in_lines(text_of(path)):
        if FILE.match(code) or TYPED.match(code):
            yield code.replace("…", "")


def problems(lines: Iterator[str]) -> list[str]:
    found = []
    for line in lines:
        try:
            check_line(line)
        except Wrong as error:
            found.append(f"{line}: {error}")
    return found


def test_there_is_something_to_check() -> None:
    lines = [program_of(line)[0] for path in DOCUMENTS for line in shell_lines(text_of(path))]
    assert lines.count("deltalux") >= 25
    assert lines.count("make") >= 6


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_what_is_to_be_typed_is_understood(path: Path) -> None:
    assert problems(all_lines(path)) == []


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_every_program_is_one_that_is_checked(path: Path) -> None:
    assert {program_of(line)[0] for line in shell_lines(text_of(path))} <= PROGRAMS


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_links_lead_somewhere(path: Path) -> None:
    assert [target for target in links(text_of(path)) if not (path.parent / target).exists()] == []


def test_the_reference_lists_every_command() -> None:
    text = text_of(ROOT / "docs/reference/command-line.md")
    usage = next(block.text for block in blocks(text) if block.language == "")
    assert {line.split()[1] for line in usage.splitlines()} == set(COMMANDS)


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("deltalux bakes room.glb", "no command bakes"),
        ("deltalux bake room.glb --moveable chair", "--moveable"),
        ("deltalux bake -o room.png", "Missing argument"),
        ("deltalux update room.dlx --move chair=0.5,0 -o a.png", "NAME=dx,dy,dz"),
        ("make dmo", "no target dmo"),
        ("make fuzz FUZZ_TIME=1", "no variable FUZZ_TIME"),
        ("cmake -S . -B build/dev -DDELTALUX_DEVELOP=ON", "DELTALUX_DEVELOP"),
        ('pip install "deltalux[viewer]"', "no extra viewer"),
        (".venv/bin/pip install --group developer", "no group developer"),
        ("PYTHONPATH=python python benchmarks/nothing.py", "no file benchmarks/nothing.py"),
    ],
)
def test_wrong_lines_are_found(line: str, found: str) -> None:
    with pytest.raises(Wrong, match=re.escape(found)):
        check_line(line)
