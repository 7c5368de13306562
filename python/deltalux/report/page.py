# SPDX-License-Identifier: Apache-2.0
"""One self-contained HTML page: tables and pictures, without external resources."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

_STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { line-height: 1.2; } h2 { margin-top: 2.5rem; }
table { border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .9rem .3rem 0; border-bottom: 1px solid #8884; text-align: left; }
td.number, th.number { text-align: right; }
figure { margin: 1.5rem 0; } img { max-width: 100%; height: auto; } figcaption { color: #888; }
td a { white-space: nowrap; } img.vectors { background: #fff; } .scroll { overflow-x: auto; }
"""
_IMAGES = {
    ".png": ("image/png", ""),
    ".svg": ("image/svg+xml", ' class="vectors"'),
}  # suffix: type, attributes


@dataclass(frozen=True)
class Link:
    """A cell that links to another section of the page, by its anchor."""

    text: str
    anchor: str


Cell = str | float | int | Link


@dataclass(frozen=True)
class Section:
    """A heading with paragraphs, an optional table, and pictures.

    Parameters
    ----------
    title : heading
    paragraphs : plain text
    header, rows : the table; columns with numbers are right-aligned
    pictures : (PNG or SVG file, caption) pairs, embedded into the page
    anchor : name by which other parts of the page link to it; such sections are listed in the contents
    level : heading level: 2, or 3 for parts of the section before
    folded : whether the table is hidden until its title is clicked
    download : (file name, text) of a file embedded in the page
    """

    title: str
    paragraphs: Sequence[str] = ()
    header: Sequence[str] = ()
    rows: Sequence[Sequence[Cell]] = ()
    pictures: Sequence[tuple[Path, str]] = field(default=())
    anchor: str = ""
    level: int = 2
    folded: bool = False
    download: tuple[str, str] | None = None


def page(title: str, sections: Sequence[Section]) -> str:
    """Return the page as HTML text.

    Raises
    ------
    OSError : a picture cannot be read
    """
    body = "\n".join(_section(section) for section in sections)
    return (
        '<!doctype html>\n<html lang="en">\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{_STYLE}</style>\n"
        f"<h1>{escape(title)}</h1>\n{_contents(sections)}{body}\n</html>\n"
    )


def _contents(sections: Sequence[Section]) -> str:
    listed = [section for section in sections if section.anchor]
    if not listed:
        return ""
    entries = "".join(f'<li><a href="#{escape(s.anchor)}">{escape(s.title)}</a></li>' for s in listed)
    return f"<nav><ol>{entries}</ol></nav>\n"


def _section(section: Section) -> str:
    anchor = f' id="{escape(section.anchor)}"' if section.anchor else ""
    parts = [f"<h{section.level}{anchor}>{escape(section.title)}</h{section.level}>"]
    parts += [f"<p>{escape(text)}</p>" for text in section.paragraphs]
    if section.rows:
        columns = range(len(section.rows[0]))
        numeric = [any(isinstance(row[i], (int, float)) for row in section.rows) for i in columns]
        head = "".join(_cell("th", text, right) for text, right in zip(section.header, numeric, strict=True))
        rows = [
            "<tr>" + "".join(_cell("td", *cell) for cell in zip(row, numeric, strict=True)) + "</tr>"
            for row in section.rows
        ]
        table = f'<div class="scroll"><table><tr>{head}</tr>\n' + "\n".join(rows) + "</table></div>"
        parts.append(f"<details><summary>show</summary>{table}</details>" if section.folded else table)
    if section.download:
        parts.append(_download(*section.download))
    parts += [_figure(path, caption) for path, caption in section.pictures]
    return "\n".join(parts)


def _download(name: str, text: str) -> str:
    data = base64.b64encode(text.encode()).decode("ascii")
    return f'<p><a download="{escape(name)}" href="data:text/csv;base64,{data}">{escape(name)}</a></p>'


def _cell(tag: str, value: Cell, right: bool) -> str:
    if isinstance(value, Link):
        text = f'<a href="#{escape(value.anchor)}">{escape(value.text)}</a>'
    elif isinstance(value, str):
        text = escape(value)
    else:
        text = f"{value:,}" if isinstance(value, int) else f"{value:,.4g}"
    return f'<{tag} class="number">{text}</{tag}>' if right else f"<{tag}>{text}</{tag}>"


def _figure(path: Path, caption: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    kind, attributes = _IMAGES[path.suffix]
    text = escape(caption)
    image = f'<img alt="{text}"{attributes} src="data:{kind};base64,{data}">'
    return f"<figure>{image}<figcaption>{text}</figcaption></figure>"
