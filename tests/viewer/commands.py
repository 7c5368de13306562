# SPDX-License-Identifier: Apache-2.0
"""Commands as processes of their own, as scripts start them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import deltalux as dl

SOURCES = Path(dl.__file__).parent.parent


def environment() -> dict[str, str]:
    """In which `python -m deltalux.cli` is the package under test."""
    return os.environ | {"PYTHONPATH": str(SOURCES)}


def listen() -> None:
    """A job in the background of a script starts with Ctrl-C ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def running(*words: str) -> Iterator[subprocess.Popen[str]]:
    """`deltalux` with these words; its outputs are pipes, and it is gone at the end."""
    with subprocess.Popen(
        [sys.executable, "-m", "deltalux.cli", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
        preexec_fn=listen,
    ) as process:
        try:
            yield process
        finally:
            process.kill()
