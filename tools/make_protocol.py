# SPDX-License-Identifier: Apache-2.0
"""Makes the page's message types and the tables of the protocol's reference from the server's declarations.

    python tools/make_protocol.py [--check]

Reads `messages` (requests) and `told` (what the server says) of deltalux.server.protocol, writes
viewer/src/messages.ts and the tables between marks in docs/reference/viewer-protocol.md. With --check nothing
is written; the exit code is 1 where a file is not what it would become.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from deltalux.server.protocol import messages, told

ROOT = Path(__file__).resolve().parent.parent
TYPES = ROOT / "viewer" / "src" / "messages.ts"
PAGE = ROOT / "docs" / "reference" / "viewer-protocol.md"
MARK = "<!-- {}: made by tools/make_protocol.py -->\n"
WIDTH = 110  # of lines, as viewer/package.json sets it
END = "<!-- end -->\n"
SIMPLE = {int: "number", float: "number", str: "string", bool: "boolean", NoneType: "null"}


def typescript(kind: Any) -> str:
    """Return what a type of Python is on the page."""
    if get_origin(kind) is Annotated:
        return typescript(get_args(kind)[0])
    if kind in SIMPLE:
        return SIMPLE[kind]
    if inspect.isclass(kind):
        return "SingleEdit" if kind is messages.Message else kind.__name__
    arguments = get_args(kind)
    if get_origin(kind) is Literal:
        return " | ".join(f"'{value}'" for value in arguments)
    if get_origin(kind) in (Union, UnionType):
        return " | ".join(dict.fromkeys(map(typescript, arguments)))
    if get_origin(kind) is tuple and arguments[-1] is Ellipsis:
        inner = typescript(arguments[0])
        return f"({inner})[]" if " " in inner else f"{inner}[]"
    if get_origin(kind) is tuple:
        return f"[{', '.join(map(typescript, arguments))}]"
    if get_origin(kind) is dict:
        return f"Record<{', '.join(map(typescript, arguments))}>"
    raise TypeError(f"{kind}: found a type that no message has had so far")


def fields_of(message: type) -> dict[str, tuple[Any, bool]]:
    """Return type and whether it must be there for each field but `type`, and of requests but `id`."""
    hints = get_type_hints(message, include_extras=True)
    if dataclasses.is_dataclass(message):
        return {
            field.name: (hints[field.name], field.default is dataclasses.MISSING)
            for field in dataclasses.fields(message)
            if field.name != "id"
        }
    return {name: (kind, True) for name, kind in hints.items() if name != "type"}


def type_of(message: Any) -> str:
    """Return the message's `type`."""
    if dataclasses.is_dataclass(message):
        return message.type
    return get_args(get_type_hints(message)["type"])[0]


def interface(message: type, name: str) -> str:
    """Return the declaration of a message."""
    lines = [f"export interface {name} {{", f"  type: '{type_of(message)}'"]
    for field, (kind, needed) in fields_of(message).items():
        lines.append(f"  {field}{'' if needed else '?'}: {typescript(kind)}")
    return "\n".join([*lines, "}"])


def union(name: str, members: list[str]) -> str:
    """Return the declaration of one of several messages, as prettier breaks it."""
    line = f"export type {name} = {' | '.join(members)}"
    if len(line) <= WIDTH:
        return line
    return f"export type {name} =\n" + "\n".join(f"  | {member}" for member in members)


def types_text() -> str:
    """Return viewer/src/messages.ts."""
    requests = [kind for kind in messages.REQUESTS.values() if kind not in messages.EDITS]
    answers = get_args(told.Told)
    parts = [
        "// SPDX-License-Identifier: Apache-2.0\n"
        "// Messages between page and server, as python/deltalux/server declares them.\n"
        "// Made by tools/make_protocol.py: change the declarations there.",
        *(interface(kind, f"{kind.__name__}Request") for kind in (*messages.EDITS, *requests)),
        union("SingleEdit", [f"{kind.__name__}Request" for kind in messages.EDITS]),
        union("RequestMessage", ["SingleEdit", *(f"{kind.__name__}Request" for kind in requests)]),
        *(interface(kind, kind.__name__) for kind in answers),
        union("ServerMessage", [kind.__name__ for kind in answers]),
    ]
    return "\n\n".join(parts) + "\n"


def row(message: Any) -> str:
    """Return the line of a table for a message."""
    cells = []
    for field, (kind, _) in fields_of(message).items():
        notes = get_args(kind)[1:] if get_origin(kind) is Annotated else ()
        cells.append(" ".join([f"`{field}`", *notes]).replace("` :", "`:"))
    about = re.sub(r"\s+", " ", inspect.getdoc(message) or "")
    return f"| `{type_of(message)}` | {', '.join(cells)} | {about} |"


def tables() -> dict[str, str]:
    """Return the tables of the page by their marks."""
    requests = [*messages.REQUESTS.values(), messages.Ack]
    return {
        "requests": "| `type` | fields | what it does |\n| --- | --- | --- |\n"
        + "".join(f"{row(kind)}\n" for kind in requests),
        "told": "| `type` | fields | when |\n| --- | --- | --- |\n"
        + "".join(f"{row(kind)}\n" for kind in get_args(told.Told)),
    }


def page_text(text: str) -> str:
    """Return the page with its tables as they should be."""
    for name, table in tables().items():
        start = text.index(MARK.format(name)) + len(MARK.format(name))
        text = text[:start] + "\n" + table + "\n" + text[text.index(END, start) :]
    return text


def main() -> int:
    """Write both files, or compare them; return the exit code."""
    check = sys.argv[1:] == ["--check"]
    stale = []
    for path, made in ((TYPES, types_text()), (PAGE, page_text(PAGE.read_text(encoding="utf-8")))):
        if path.is_file() and path.read_text(encoding="utf-8") == made:
            continue
        stale.append(path.relative_to(ROOT).as_posix())
        if not check:
            path.write_text(made, encoding="utf-8")
    for path in stale if check else ():
        print(f"{path}: found one that the server's declarations do not make; run tools/make_protocol.py")
    print(f"make_protocol: {'checked' if check else f'wrote {len(stale)} of'} 2 files")
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
