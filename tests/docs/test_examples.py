# SPDX-License-Identifier: Apache-2.0
"""Every example and every Python snippet of the documents runs; every command they show is understood."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import deltalux
import pytest
from deltalux.cli import app
from typer.main import get_command

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?:|#)([^)#]+)\)")


def snippets(language: str) -> list[tuple[str, str]]:
    """Return (document, text) of each fenced block in that language."""
    return [
        (str(path.relative_to(ROOT)), block)
        for path in DOCUMENTS
        for kind, block in FENCE.findall(path.read_text(encoding="utf-8"))
        if kind == language
    ]


def commands() -> list[tuple[str, str]]:
    """Return (document, command line) of each `deltalux` call in a shell block."""
    return [
        (document, line.split(" #")[0].strip())
        for document, block in snippets("sh")
        for line in block.splitlines()
        if line.startswith("deltalux ")
    ]


def run_python(tmp_path: Path, *arguments: str | Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(Path(deltalux.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_there_is_something_to_check() -> None:
    assert len(EXAMPLES) >= 6
    assert len(snippets("python")) >= 2
    assert len(commands()) >= 8


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_example_runs(path: Path, tmp_path: Path) -> None:
    run_python(tmp_path, path)


@pytest.mark.parametrize(("document", "text"), snippets("python"))
def test_snippet_runs(document: str, text: str, tmp_path: Path) -> None:
    run_python(tmp_path, "-c", text)


@pytest.mark.parametrize(("document", "line"), commands())
def test_command_is_understood(document: str, line: str) -> None:
    """Parse the words without running them."""
    _, verb, *words = shlex.split(line)
    group = get_command(app)
    command = group.commands[verb]  # type: ignore[attr-defined]
    command.make_context(verb, words)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_somewhere(path: Path) -> None:
    targets = LINK.findall(path.read_text(encoding="utf-8"))
    missing = [target for target in targets if not (path.parent / target).exists()]
    assert missing == []
