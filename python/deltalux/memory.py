# SPDX-License-Identifier: Apache-2.0
"""How much memory a scene or a bake may use by default, and how what is free again returns to the system."""

from __future__ import annotations

import ctypes
from pathlib import Path

SHARE = 0.9  # of what is free
KEPT = 2**30, 0.25  # bytes that pictures may leave for the next one, and of what is free


def available_memory() -> int:
    """Bytes that may still be used: most of what the system says is available, 0 = unknown."""
    limits = []
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                limits.append(int(line.split()[1]) * 1024)
    except OSError:
        pass
    try:  # a container's limit
        limit = Path("/sys/fs/cgroup/memory.max").read_text().strip()
        used = Path("/sys/fs/cgroup/memory.current").read_text().strip()
        if limit != "max":
            limits.append(max(1, int(limit) - int(used)))
    except (OSError, ValueError):
        pass
    try:  # the process's own limit on address space
        import resource

        limit_bytes = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit_bytes != resource.RLIM_INFINITY:
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            limits.append(max(1, limit_bytes - pages * resource.getpagesize()))
    except (ImportError, OSError):
        pass
    return int(SHARE * min(limits)) if limits else 0


def bytes_to_keep() -> int:
    """How much of what a picture found may be kept for the next one."""
    most, share = KEPT
    free = available_memory()
    return min(most, int(share * free)) if free else most


def return_free_memory() -> None:
    """Give back what the C library keeps after large arrays were freed among small ones; takes milliseconds.

    Without it the memory of a process that exports and checks for long grows by as much as fragments hold.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc's
    if trim is not None:
        trim(0)
