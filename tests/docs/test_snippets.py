# SPDX-License-Identifier: Apache-2.0
"""The Python of every page runs, block after block, as a reader would type it; on less light, to be quick."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from thoroughness import slow

from docs.pages import DOCUMENTS, blocks, name_of, text_of

LANGUAGES = {"", "cpp", "python", "sh"}  # another name for one of these would escape the tests


def run_page(name: str, text: str) -> dict[str, Any]:
    """Run the Python blocks of a page in one namespace; errors show the page's lines."""
    names: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(text):
        if block.language == "python":
            exec(compile("\n" * (block.line - 1) + block.text, name, "exec"), names)
    return names


WITH_WORKERS = "bake-on-a-cluster.md"
PAGES = [path for path in DOCUMENTS if any(b.language == "python" for b in blocks(text_of(path)))]


def test_there_is_something_to_check() -> None:
    assert len(PAGES) >= 8


@pytest.mark.usefixtures("less_light")
@pytest.mark.parametrize(
    "path", [slow(path) if path.name == WITH_WORKERS else path for path in PAGES], ids=name_of
)
def test_python_of_page_runs(path: Path) -> None:
    run_page(name_of(path), text_of(path))


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_languages_of_blocks_are_known(path: Path) -> None:
    assert {block.language for block in blocks(text_of(path))} <= LANGUAGES


def test_blocks_of_a_page_share_names_and_errors_show_its_lines() -> None:
    assert run_page("p.md", "```python\na = 1\n```\ntext\n```python\nb = a + 1\n```\n")["b"] == 2
    with pytest.raises(AttributeError, match="sessions") as error:
        run_page("p.md", "one\n\n```python\nimport deltalux as dl\n\ndl.sessions\n```\n")
    assert (error.traceback[-1].frame.code.raw.co_filename, error.traceback[-1].lineno) == ("p.md", 5)
