# SPDX-License-Identifier: Apache-2.0
"""One self-contained HTML page: tables and pictures, nothing fetched from elsewhere."""

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
"""


@dataclass(frozen=True)
class Section:
    """A heading with paragraphs, an optional table, and pictures.

    Parameters
    ----------
    title : heading
    paragraphs : plain text
    header, rows : the table; columns with numbers are set flush right
    pictures : (PNG file, caption) pairs, embedded into the page
    """

    title: str
    paragraphs: Sequence[str] = ()
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str | float | int]] = ()
    pictures: Sequence[tuple[Path, str]] = field(default=())


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
        f"<h1>{escape(title)}</h1>\n{body}\n</html>\n"
    )


def _section(section: Section) -> str:
    parts = [f"<h2>{escape(section.title)}</h2>"]
    parts += [f"<p>{escape(text)}</p>" for text in section.paragraphs]
    if section.rows:
        columns = range(len(section.rows[0]))
        numeric = [any(not isinstance(row[i], str) for row in section.rows) for i in columns]
        head = "".join(_cell("th", text, right) for text, right in zip(section.header, numeric, strict=True))
        rows = [
            "<tr>" + "".join(_cell("td", *cell) for cell in zip(row, numeric, strict=True)) + "</tr>"
            for row in section.rows
        ]
        parts.append(f"<table><tr>{head}</tr>\n" + "\n".join(rows) + "</table>")
    parts += [_figure(path, caption) for path, caption in section.pictures]
    return "\n".join(parts)


def _cell(tag: str, value: str | float | int, right: bool) -> str:
    if isinstance(value, str):
        text = escape(value)
    else:
        text = f"{value:,}" if isinstance(value, int) else f"{value:,.4g}"
    return f'<{tag} class="number">{text}</{tag}>' if right else f"<{tag}>{text}</{tag}>"


def _figure(path: Path, caption: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    text = escape(caption)
    image = f'<img alt="{text}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption>{text}</figcaption></figure>"
