# SPDX-License-Identifier: Apache-2.0
"""Exports: files that pages write, with plain names in one folder, never over other people's files."""

from __future__ import annotations

import os
import re
from pathlib import Path

from deltalux.errors import OptionError
from deltalux.outputs import WRITERS, write
from deltalux.outputs.of_session import baked_of
from deltalux.session import Session

SESSION = ".dlx"
SUFFIXES = (*WRITERS, SESSION)
# A name begins with a letter or digit, so it is not hidden, and has no separator, colon or control character.
_PLAIN = re.compile(r"\w[\w .()+-]*", re.ASCII)
MAX_NAME = 100


class Exports:
    """The folder of exports, and the names of the files that this run wrote there.

    Parameters
    ----------
    folder : an existing folder, or None: exports are refused
    command : the command that the files name as their origin
    """

    def __init__(self, folder: str | os.PathLike[str] | None, command: str = "deltalux view") -> None:
        self._command = command
        self._folder = None if folder is None else Path(folder).resolve()
        if self._folder is not None and not self._folder.is_dir():
            raise OptionError(f'folder: found no folder "{folder}", expected an existing one')
        self._written: set[str] = set()

    @property
    def allowed(self) -> bool:
        """Whether there is a folder."""
        return self._folder is not None

    def checked_name(self, name: str) -> str:
        """Return `name` if a file of that name may be written now.

        Raises
        ------
        OptionError
        """
        if self._folder is None:
            raise OptionError("export: found no folder to write to; start it with --folder")
        if len(name) > MAX_NAME or not _PLAIN.fullmatch(name) or name[-1] in ". ":
            raise OptionError(
                f"export: found {name[:MAX_NAME]!r}, expected a plain name of letters, digits and .-_+ "
                "without a folder"
            )
        if Path(name).suffix not in SUFFIXES:
            raise OptionError(
                f'export "{name}": found no known suffix, expected one of {", ".join(SUFFIXES)}'
            )
        if name not in self._written and os.path.lexists(self._folder / name):
            raise OptionError(
                f'export "{name}": found a file of that name that is not of this run; '
                f'"{self._free_name(name)}" is free'
            )
        return name

    def _free_name(self, name: str) -> str:
        assert self._folder is not None
        stem, suffix, number = Path(name).stem, Path(name).suffix, 2
        while os.path.lexists(self._folder / f"{stem}-{number}{suffix}"):
            number += 1
        return f"{stem}-{number}{suffix}"

    def write(self, name: str, session: Session) -> tuple[int, str]:
        """Write the session's present state; return the file's bytes and its address.

        Raises
        ------
        OptionError, OSError
        """
        assert self._folder is not None
        path = self._folder / self.checked_name(name)
        if path.suffix == SESSION:
            session.save(path, self._command)
        else:
            write(path, baked_of(session, self._command))
        self._written.add(name)
        return path.stat().st_size, f"files/{name}"

    def path_of(self, name: str) -> Path | None:
        """Path of a regular file of that name, if this run wrote it, else None."""
        if self._folder is None or name not in self._written:
            return None
        path = self._folder / name
        return path if path.is_file() and not path.is_symlink() else None
