# SPDX-License-Identifier: Apache-2.0
"""Sphinx's settings: the Markdown pages as they are, and the Python reference from docstrings (`make docs`).

The source folder is the repository's root, so that a relative link means the same here and where the
repository is browsed. What only the site needs (lists of pages, entries of the reference) stands in
the pages as comments that begin with `<!-- site:`, which no other reader shows.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from deltalux import __version__
from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "tools")]  # for source_pages

project = "Deltalux"
author = "The Deltalux authors"
copyright = author  # noqa: A001, the name that Sphinx asks for
version = release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "source_pages"]
include_patterns = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/**.md", "examples/README.md",
                    "benchmarks/RESULTS.md", "benchmarks/NOTEBOOK.md"]  # fmt: skip
exclude_patterns = [".*", "build", "viewer", "python"]
root_doc = "README"

html_theme = "furo"
html_title = f"Deltalux {__version__}"
html_copy_source = False

myst_heading_anchors = 3

default_role = "py:obj"
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # docstrings say types, and shapes and units, too
numpydoc_show_class_members = False  # autodoc lists them

SITE_ONLY = re.compile(r"<!-- site:\n(.*?)-->", re.DOTALL)
FRONT = '<!doctype html><meta http-equiv="refresh" content="0; url=README.html"><title>Deltalux</title>\n'


def uncover(_: Sphinx, __: str, text: list[str]) -> None:
    """Let what only the site needs be seen by Sphinx."""
    text[0] = SITE_ONLY.sub(r"\1", text[0])


def write_front_page(app: Sphinx, error: Exception | None) -> None:
    """Lead from the folder's address to the first page."""
    if error is None:
        (Path(app.outdir) / "index.html").write_text(FRONT, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect the above."""
    app.connect("source-read", uncover)
    app.connect("build-finished", write_front_page)
    return {"parallel_read_safe": True}
