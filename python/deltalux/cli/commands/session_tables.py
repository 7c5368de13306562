# SPDX-License-Identifier: Apache-2.0
"""Tables of a session file's contents: commands that made it, light, edits, size by part."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

from deltalux.quantities import significant

_UNITS = (("GiB", 2**30), ("MiB", 2**20), ("KiB", 2**10))


def session_tables(facts: Mapping[str, Any]) -> list[Table]:
    """`file_facts` as tables; the one of edits only if there are any."""
    tables = [_light(facts)]
    if edits := _edits(facts["edits"]):
        table = Table("edit", "", title="edits", title_justify="left", show_header=False)
        for row in edits:
            table.add_row(*map(Text, row))
        tables.append(table)
    sizes = Table("part", title="size by part", title_justify="left", show_header=False)
    sizes.add_column(justify="right")
    for part, size in {**facts["bytes"], "all": sum(facts["bytes"].values())}.items():
        sizes.add_row(part, size_text(size))
    return [*tables, sizes]


def size_text(size: int) -> str:
    """Bytes in the largest unit that gives at least one."""
    for name, unit in _UNITS:
        if size >= unit:
            return f"{significant(size / unit, 3)} {name}"
    return f"{size} B"


def _light(facts: Mapping[str, Any]) -> Table:
    table = Table(title="session", title_justify="left", show_header=False)
    table.add_row("made by", Text("\n".join(facts["made_by"]) or "–"))
    table.add_row("light of", Text(facts["built_by"] or "no light yet"))
    options, samples = facts["options"], facts["samples"]
    segments = "" if facts["segments"] is None else f", {facts['segments']:,} segments"
    table.add_row("paths", f"{options['paths']:,}, seed {options['seed']}{segments}")
    table.add_row("rays of a sample", str(options["gather"]))
    spacing = "" if samples["spacing"] is None else f", at most {significant(samples['spacing'], 3)} m apart"
    table.add_row("samples", f"{samples['count']:,}{spacing}")
    if samples["vertices"] is not None:
        table.add_row("shown by", f"{samples['vertices']:,} vertices")
    if samples["grid"] is not None:
        table.add_row("grid", " × ".join(map(str, samples["grid"])))
    return table


def _edits(edits: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = []
    for name, motion in edits["moved"].items():
        offset = ", ".join(significant(x) for x in motion["offset"])
        turned = f", turned by {significant(motion['degrees'])}°" if motion["degrees"] > 1e-6 else ""
        rows.append((name, f"moved by {offset} m{turned}"))
    rows += [(name, "removed") for name in edits["removed"]]
    rows += [(name, f"dimmed to {significant(factor)}") for name, factor in edits["dimmed"].items()]
    for name, values in edits["reflectances"].items():
        rows.append((name, f"reflects {', '.join(significant(v, 3) for v in values)}"))
    return rows
