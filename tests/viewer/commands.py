# SPDX-License-Identifier: Apache-2.0
"""Commands as processes of their own, as scripts start them."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import deltalux as dl
from processes import listen_to_interrupts

SOURCES = Path(dl.__file__).parent.parent


def environment() -> dict[str, str]:
    """In which `python -m deltalux.cli` is the package under test."""
    return os.environ | {"PYTHONPATH": str(SOURCES)}


@contextmanager
def running(*words: str) -> Iterator[subprocess.Popen[str]]:
    """`deltalux` with these words; its outputs are pipes, and it is gone at the end."""
    with subprocess.Popen(
        [sys.executable, "-m", "deltalux.cli", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
        preexec_fn=listen_to_interrupts,
    ) as process:
        try:
            yield process
        finally:
            process.kill()
