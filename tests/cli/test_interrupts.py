# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C that is put off: told at the end of a block, and not to processes that the block starts."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest
from deltalux.cli.interrupts import put_off

BLOCKED = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"


@pytest.fixture(autouse=True)
def listening() -> Iterator[None]:
    """As a program in the foreground."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupt() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def test_an_interrupt_comes_at_the_end_of_the_block() -> None:
    reached = False
    with pytest.raises(KeyboardInterrupt), put_off():
        interrupt()
        reached = True
    assert reached
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with pytest.raises(KeyboardInterrupt):
        interrupt()


def test_an_error_of_the_block_passes() -> None:
    with pytest.raises(ValueError, match="why"), put_off():
        interrupt()
        raise ValueError("why")
    with put_off():  # what came is over
        pass


def test_processes_of_the_block_are_never_interrupted() -> None:
    with put_off():
        within = subprocess.run([sys.executable, "-c", BLOCKED], capture_output=True, text=True)
    after = subprocess.run([sys.executable, "-c", BLOCKED], capture_output=True, text=True)
    assert (within.stdout, after.stdout) == ("True\n", "False\n")


def test_an_ignored_interrupt_stays_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with put_off():
        interrupt()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
