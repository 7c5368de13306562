# SPDX-License-Identifier: Apache-2.0
"""Standard streams whose readers may leave: a command goes on, and what it writes is lost."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class Unheard:
    """A stream that writes to nowhere once its reader has closed the pipe.

    Parameters
    ----------
    stream : the text stream that is written to
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write; returns the number of characters."""
        with self._without_reader():
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Write what waits."""
        with self._without_reader():
            self._stream.flush()

    @contextmanager
    def _without_reader(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError:
            _discard(self._stream)


@contextmanager
def unheard_streams() -> Iterator[None]:
    """Let nothing in the block fail because nobody reads standard output or standard error."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (None if stream is None else Unheard(stream) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def flush_output() -> None:
    """Write what waits for standard output, so that a full disk is told as any other failure."""
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except OSError:
        _discard(sys.stdout)
        raise


def _discard(stream: Any) -> None:
    """Let a stream write to nowhere; else its buffer fails again when the interpreter ends."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
