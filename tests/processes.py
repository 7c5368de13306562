# SPDX-License-Identifier: Apache-2.0
"""Helpers of tests that start programs, wait until they work, and interrupt them."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import time
from pathlib import Path

PATIENCE = 200  # seconds in which a program does what is waited for, however busy the machine


def listen_to_interrupts() -> None:
    """In a new process: what a script starts in its background has Ctrl-C ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def seconds_of(process: int) -> float:
    """Processor seconds that a process has taken; 0 if there is none of that number."""
    try:
        times = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    except FileNotFoundError:
        return 0.0
    return sum(map(int, times)) / os.sysconf("SC_CLK_TCK")


def interrupt_after(process: subprocess.Popen[str], seconds: float) -> tuple[str, str, float]:
    """Interrupt a program that has taken so many processor seconds.

    Returns
    -------
    what it writes to its streams; processor seconds that it still takes, which no other program changes
    """
    end = time.monotonic() + PATIENCE
    while seconds_of(process.pid) < seconds and time.monotonic() < end:
        assert process.poll() is None, "it was over before it could be interrupted"
        time.sleep(0.02)
    ended_before = _seconds_of_ended_children()
    taken = seconds_of(process.pid)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    return out, err, _seconds_of_ended_children() - ended_before - taken


def _seconds_of_ended_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
