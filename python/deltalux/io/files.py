# SPDX-License-Identifier: Apache-2.0
"""Reads regular files, and files that another file references, which must lie beside or below it."""

from __future__ import annotations

import re
import stat
from pathlib import Path

from deltalux.errors import FormatError

from .diagnostics import malformed

SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.\-]*:")  # scheme of a URL, or a drive letter


def read_regular_file(path: Path, where: str, limit: int | None = None) -> bytes:
    """The file's bytes, at most the first `limit`; refuses devices and pipes, which may never end."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise malformed(where, f'"{path.name}", which is no regular file', "a regular file")
        with path.open("rb") as file:
            return file.read() if limit is None else file.read(limit)
    except FileNotFoundError:
        raise malformed(
            where, f'no file "{path.name}" in {path.parent}', "it to be there", "restore it"
        ) from None
    except (OSError, ValueError) as error:
        raise malformed(where, f'"{path.name}" that cannot be read ({error})', "a readable file") from None


def is_beside(folder: Path, relative: str) -> bool:
    """Whether `read_beside` would find a regular file."""
    try:
        return _found_beside(folder, relative, "").is_file()
    except (FormatError, OSError, ValueError):
        return False


def read_beside(folder: Path, relative: str, where: str, limit: int | None = None) -> bytes:
    """The bytes of `folder`/`relative`.

    Refuses "..", absolute paths, addresses and symbolic links that lead out of the folder.
    """
    return read_regular_file(_found_beside(folder, relative, where), where, limit)


def _found_beside(folder: Path, relative: str, where: str) -> Path:
    shown = repr(relative[:80])
    if SCHEME.match(relative) or relative.startswith(("/", "\\")) or not relative.isprintable():
        raise malformed(
            where, f"the path {shown}", "a relative path below the file's folder", "move it there"
        )
    try:
        base = folder.resolve(strict=True)
        target = (base / relative).resolve()
    except (OSError, RuntimeError) as error:  # RuntimeError: a loop of symbolic links, before Python 3.13
        raise malformed(where, f"the path {shown} ({error})", "a file below the folder") from None
    if not target.is_relative_to(base):
        raise malformed(
            where,
            f"the path {shown}, which leads out of the file's folder",
            "a file inside it",
            "move it there",
        )
    return target
