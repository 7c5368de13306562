# SPDX-License-Identifier: Apache-2.0
"""Writes files completely or not at all: to a temporary file, then renamed; protects inputs."""

from __future__ import annotations

import errno
import os
import secrets
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

_DESCRIPTORS = Path("/proc/self/fd")
_SUFFIX = ".part"


@contextmanager
def written_aside(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Provide a binary file to write to; it replaces `path` when the block succeeds.

    Whoever opens `path` finds either the old or the new file, complete, even if the process was killed or
    the power failed; if several processes write to one path, the last one wins. If the file system supports
    files without a name (most of Linux's do), a killed process leaves nothing behind, unless it is killed
    between the two system calls that name and rename its file; otherwise it leaves a hidden `.part` file. A
    replaced file's permissions are kept; a symbolic link is replaced, not followed.

    Raises
    ------
    OSError
        If the folder does not exist or cannot be written to, or the disk is full; `path` is then unchanged.
    """
    target = Path(path)
    with _explained(target, ""):
        folder = os.open(target.parent, os.O_PATH | os.O_DIRECTORY)
    try:
        with _explained(target, ""):
            aside = _Aside(folder, target.name)
        with aside, _explained(target, "; nothing was written, what was there is as before"):
            yield aside.file
            aside.replace_target()
    finally:
        os.close(folder)


@contextmanager
def _explained(target: Path, outcome: str) -> Iterator[None]:
    """Make errors name `target` and the outcome; errors of other files pass unchanged."""
    try:
        yield
    except OSError as error:
        place = None if error.filename is None else str(error.filename)
        own = (None, ".", target.name, str(target.parent))
        if place not in own and not str(place).endswith(_SUFFIX):
            raise
        raise OSError(error.errno, f"{error.strerror or error}{outcome}", str(target)) from error


class _Aside:
    """A new file in an open folder, with no name or a random one."""

    def __init__(self, folder: int, target: str) -> None:
        self._folder, self._target = folder, target
        # Short, so that the name is not too long; random, so that nobody can have created it before.
        self._part = f".{target[:40]}.{secrets.token_hex(8)}{_SUFFIX}"
        kept = self._target_mode()
        mode = 0o666 if kept is None else kept
        self._named, descriptor = self._open(mode)
        self.file: BinaryIO = os.fdopen(descriptor, "w+b")
        if kept is not None:
            try:
                os.fchmod(descriptor, kept)
            except OSError:
                self._discard()
                raise

    def _target_mode(self) -> int | None:
        """Permissions of the file that is replaced; None if there is none."""
        try:
            found = os.stat(self._target, dir_fd=self._folder, follow_symlinks=False)
        except FileNotFoundError:
            return None
        if stat.S_ISLNK(found.st_mode):
            return None
        if not stat.S_ISREG(found.st_mode):
            raise FileExistsError(
                errno.EEXIST, "found a folder, device or pipe of that name, expected a file"
            )
        return found.st_mode & 0o777

    def _open(self, mode: int) -> tuple[bool, int]:
        """Open the file; return whether it has a name yet, and its descriptor."""
        if _DESCRIPTORS.exists():
            with suppress(OSError):  # the file system does not support files without a name
                return False, os.open(".", os.O_TMPFILE | os.O_RDWR, mode, dir_fd=self._folder)
        flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
        return True, os.open(self._part, flags, mode, dir_fd=self._folder)

    def replace_target(self) -> None:
        """Rename the file to its target, after all of it is on disk."""
        self.file.flush()
        descriptor = self.file.fileno()
        os.fsync(descriptor)
        if not self._named:
            os.link(_DESCRIPTORS / str(descriptor), self._part, dst_dir_fd=self._folder, follow_symlinks=True)
            self._named = True
        os.replace(self._part, self._target, src_dir_fd=self._folder, dst_dir_fd=self._folder)
        self._named = False
        # Without this, a file system may lose the renaming, but never half of the file.
        with suppress(OSError):
            readable = os.open(".", os.O_RDONLY | os.O_DIRECTORY, dir_fd=self._folder)
            try:
                os.fsync(readable)
            finally:
                os.close(readable)

    def __enter__(self) -> _Aside:
        return self

    def __exit__(self, *_: object) -> None:
        self._discard()

    def _discard(self) -> None:
        """Close the file; remove it if it has not replaced the target."""
        with suppress(OSError):  # a full disk was already reported by a write
            self.file.close()
        if self._named:
            with suppress(OSError):
                os.unlink(self._part, dir_fd=self._folder)


def same_file(a: str | os.PathLike[str], b: str | os.PathLike[str]) -> bool:
    """Whether two paths, however spelt, are one file: via a relative path, symbolic link or hard link."""
    try:
        return Path(a).samefile(b)
    except OSError:  # a file that does not exist yet is identified by its path only
        return os.path.realpath(a) == os.path.realpath(b)
    except ValueError:  # no file can have this path
        return False


def found_among(path: str | os.PathLike[str], inputs: Iterable[str | os.PathLike[str]]) -> str | None:
    """The path among `inputs` that is the same file as `path`; None if there is none."""
    return next((os.fspath(each) for each in inputs if same_file(path, each)), None)
