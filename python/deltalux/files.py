# SPDX-License-Identifier: Apache-2.0
"""Files appear whole or not at all, written beside their place and renamed; inputs are not replaced."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def written_aside(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a path beside `path` to write to; it replaces `path` when the block succeeds.

    Raises
    ------
    OSError
        Where the folder does not exist or cannot be written to.
    """
    target = Path(path)
    aside = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        yield aside
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


def same_file(a: str | os.PathLike[str], b: str | os.PathLike[str]) -> bool:
    """Whether two paths, however spelt, are one file: by relative path, symbolic link or hard link."""
    try:
        return Path(a).samefile(b)
    except OSError:  # what does not exist yet is known by its path only
        return os.path.realpath(a) == os.path.realpath(b)
    except ValueError:  # a path that no file can have
        return False


def found_among(path: str | os.PathLike[str], inputs: Iterable[str | os.PathLike[str]]) -> str | None:
    """The one of `inputs` that is the file `path`, None where none is."""
    return next((os.fspath(each) for each in inputs if same_file(path, each)), None)
