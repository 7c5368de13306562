# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C while a command starts processes: it waits until they are there, and reaches this one only."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker

_CTRL_C = {signal.SIGINT}


@contextmanager
def put_off() -> Iterator[None]:
    """Raise KeyboardInterrupt at the end of the block, not within it; processes begun there see none, ever.

    Where a library starts processes, an exception between any two lines of it leaves some that nobody
    ends, or is taken for a process that failed. And those processes, which a terminal interrupts as well,
    would tell where each of them was.
    """
    listening = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not listening or threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    resource_tracker.ensure_running()  # it would let the signal in again where it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _CTRL_C)  # threads and processes inherit it
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if came:
        raise KeyboardInterrupt
