# SPDX-License-Identifier: Apache-2.0
"""Links from the documents to source files lead to pages with the source, at the line of what they name."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from definitions import SUFFIXES, line_of
from docutils import nodes
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name
from sphinx.addnodes import download_reference
from sphinx.application import Sphinx

LANGUAGES = {".h": "cpp", ".cpp": "cpp", ".glsl": "glsl", ".py": "python", ".ts": "typescript"}
FOLDER = "source"
BEFORE_DOWNLOADS = 100  # are collected


class SourceLink(nodes.reference):
    """A link whose address follows when its page is written; `file` is a path from the root."""


def take_links(app: Sphinx, doctree: nodes.document) -> None:
    """Let links to sources be such, not downloads."""
    root = Path(app.srcdir)
    for node in list(doctree.findall(download_reference)):
        _, path = app.env.relfn2path(node["reftarget"], app.env.docname)
        file = Path(path)
        if file.suffix in SUFFIXES and file.is_relative_to(root) and file.is_file():
            line = line_of(file, node.astext())
            link = SourceLink("", "", *node.children, file=file.relative_to(root).as_posix(), line=line or 0)
            node.replace_self(link)


def place_links(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Give links their addresses, and note which files are linked."""
    for link in doctree.findall(SourceLink):
        _files(app).add(link["file"])
        anchor = f"#L-{link['line']}" if link["line"] else ""
        target = app.builder.get_relative_uri(page, f"{FOLDER}/{link['file']}") + anchor
        link.replace_self(nodes.reference("", "", *link.children, refuri=target, internal=True))


def source_pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    """A page for each file that is linked."""
    formatter = HtmlFormatter(linenos="inline", lineanchors="L")
    for file in sorted(_files(app)):
        lexer = get_lexer_by_name(LANGUAGES[Path(file).suffix])
        text = highlight((Path(app.srcdir) / file).read_text(encoding="utf-8"), lexer, formatter)
        yield f"{FOLDER}/{file}", {"title": file, "body": f"<h1>{file}</h1>{text}"}, "page.html"


def _files(app: Sphinx) -> set[str]:
    if not hasattr(app, "linked_sources"):
        app.linked_sources = set()  # type: ignore[attr-defined]
    return app.linked_sources  # type: ignore[attr-defined]


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect the above."""
    app.connect("doctree-read", take_links, priority=BEFORE_DOWNLOADS)
    app.connect("doctree-resolved", place_links)
    app.connect("html-collect-pages", source_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": False}
