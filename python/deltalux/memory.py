# SPDX-License-Identifier: Apache-2.0
"""How much memory a bake may use by default."""

from __future__ import annotations

from pathlib import Path

SHARE = 0.9  # of what is free


def available_memory() -> int:
    """Bytes that a bake may use: most of what the system says is available, 0 = unknown."""
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
    return int(SHARE * min(limits)) if limits else 0
