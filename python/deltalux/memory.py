# SPDX-License-Identifier: Apache-2.0
"""Memory that a scene or a bake may use by default, and the return of freed memory to the system."""

from __future__ import annotations

import ctypes
from pathlib import Path

SHARE = 0.9  # share of the available memory that may be used
# memory in which a picture may keep data for the next one: bytes, and share of the available memory
KEPT = 2**30, 0.25


def available_memory() -> int:
    """Bytes that may still be used: most of the memory that the system reports as available; 0 = unknown."""
    limits = []
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                limits.append(int(line.split()[1]) * 1024)
    except OSError:
        pass
    try:  # limit of the container
        limit = Path("/sys/fs/cgroup/memory.max").read_text().strip()
        used = Path("/sys/fs/cgroup/memory.current").read_text().strip()
        if limit != "max":
            limits.append(max(1, int(limit) - int(used)))
    except (OSError, ValueError):
        pass
    try:  # limit of the process's address space
        import resource

        limit_bytes = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit_bytes != resource.RLIM_INFINITY:
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            limits.append(max(1, limit_bytes - pages * resource.getpagesize()))
    except (ImportError, OSError):
        pass
    return int(SHARE * min(limits)) if limits else 0


def bytes_to_keep() -> int:
    """Memory in which a picture may keep data for the next one, bytes."""
    most, share = KEPT
    free = available_memory()
    return min(most, int(share * free)) if free else most


def return_free_memory() -> None:
    """Return memory that the C library keeps after large arrays were freed; takes milliseconds.

    Without this, a process that exports and checks for a long time grows by the fragments.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc only
    if trim is not None:
        trim(0)
