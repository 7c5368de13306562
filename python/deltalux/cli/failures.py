# SPDX-License-Identifier: Apache-2.0
"""Failures as one line: what, where, and the remedy."""

from __future__ import annotations

import errno

from deltalux.errors import Error

_ELSEWHERE = "choose a place where you may write"
REMEDIES = {
    errno.ENOENT: "check the name, and that the folder is there",
    errno.EACCES: _ELSEWHERE,
    errno.EPERM: _ELSEWHERE,
    errno.EROFS: _ELSEWHERE,
    errno.EEXIST: "a file stands where a folder is expected; choose another name",
    errno.ENOTDIR: "a file stands where a folder is expected; choose another name",
    errno.EISDIR: "a folder stands where a file is expected; choose another name",
    errno.ENOSPC: "free some space, or choose another disk",
}

NO_THREAD = "can't start new thread"  # Python's words
EXPECTED = (OSError, MemoryError, Error)  # failures that commands report; any other exception is a defect


def is_expected(error: Exception) -> bool:
    """Whether an exception is one of `EXPECTED`, or tells that a library has no room for a thread."""
    return isinstance(error, EXPECTED) or (type(error) is RuntimeError and str(error) == NO_THREAD)


def failure_text(error: BaseException) -> str:
    """The message for a failure that `is_expected`."""
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        remedy = REMEDIES.get(error.errno or 0)
        return f"{where}{error.strerror or error}" + (f"; {remedy}" if remedy else "")
    if isinstance(error, (MemoryError, RuntimeError)):
        return "out of memory: use fewer --paths, a larger --spacing, or set --memory-limit"
    return str(error)
