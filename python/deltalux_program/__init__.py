# SPDX-License-Identifier: Apache-2.0
"""Entry point of the `deltalux` program, outside of the package: it is there before the libraries are.

Importing anything of `deltalux` takes a second; Ctrl-C within it ends the program as quietly as later.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from typing import NoReturn

CANCELLED = 130
LONG = frozenset({"bake", "update", "render"})  # verbs that go on to show a bar
LOADING = b"loading libraries"


def main() -> NoReturn:
    """Load the command line and run it."""
    _open_missing_streams()
    # Not where the signal is ignored, as in a script's background.
    listening = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if listening:
        signal.signal(signal.SIGINT, _leave)
    waiting = sys.stderr.isatty() and not LONG.isdisjoint(sys.argv) and {"-q", "--quiet"}.isdisjoint(sys.argv)
    if waiting:
        os.write(2, LOADING + b"\r")
    from deltalux.cli import run

    if waiting:
        os.write(2, b" " * len(LOADING) + b"\r")
    try:
        if listening:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.exit(run())
    except KeyboardInterrupt:  # between its steps
        _leave()


def _open_missing_streams() -> None:
    """Open to nowhere what was closed by whoever started this, as some daemons do.

    Else the first file that the program opens is its standard error.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest number that is free, which is this
            os.set_inheritable(number, True)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            # of its own, because Python may have opened a file of that number
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))


def _leave(*_: object) -> NoReturn:
    """End at once: an exception in the middle of an import could be taken for a broken library."""
    with suppress(OSError):
        os.write(2, b"error: cancelled\n")
    os._exit(CANCELLED)
