# SPDX-License-Identifier: Apache-2.0
"""Processor time and memory of one call."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

T = TypeVar("T")
STATUS, PEAK_RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


@dataclass(frozen=True)
class Measured(Generic[T]):
    """Result and cost of a call.

    Attributes
    ----------
    value : what the call returned
    cpu_seconds : processor time of all threads together
    seconds : wall-clock time
    memory_bytes : growth of the process's resident memory up to its peak in the call, the result
        included; None where the system does not report it
    """

    value: T
    cpu_seconds: float
    seconds: float
    memory_bytes: int | None


def measured(call: Callable[[], T]) -> Measured[T]:
    """Run `call` and measure it."""
    before = _reset_peak()
    start, cpu = time.perf_counter(), time.process_time()
    value = call()
    seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - cpu
    peak = _status("VmHWM")
    grown = None if before is None or peak is None else max(0, peak - before)
    return Measured(value, cpu_seconds, seconds, grown)


def _reset_peak() -> int | None:
    """Reset the recorded peak, and return the resident bytes; None without Linux's /proc."""
    try:
        # Otherwise the call could reuse memory that earlier calls freed, which would not count as growth.
        ctypes.CDLL(None).malloc_trim(0)
        PEAK_RESET.write_text("5")
    except (OSError, AttributeError, TypeError):
        return None
    return _status("VmRSS")


def _status(name: str) -> int | None:
    try:
        for line in STATUS.read_text().splitlines():
            if line.startswith(f"{name}:"):
                return 1024 * int(line.split()[1])
    except OSError:
        pass
    return None
