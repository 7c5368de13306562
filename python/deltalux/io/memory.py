# SPDX-License-Identifier: Apache-2.0
"""How much memory is left, so that a reader can refuse before it allocates."""

from __future__ import annotations

import sys
from pathlib import Path

from deltalux.errors import SceneError

# Arrays of a Mesh and the temporaries of making it. Measured: 212 bytes per triangle and per vertex where one
# mesh holds two million triangles, 54 to 88 where many meshes share 300,000.
BYTES_PER_ELEMENT = 240


def available_bytes() -> int:
    """Memory that this process can still take: the machine's and its own limit, whichever is less."""
    found = [sys.maxsize]
    meminfo = Path("/proc/meminfo")
    if meminfo.exists():
        fields = dict(line.split(":", 1) for line in meminfo.read_text().splitlines())
        found.append(int(fields["MemAvailable"].split()[0]) * 1024)
    try:
        import resource
    except ImportError:  # not a POSIX system
        return min(found)
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        found.append(limit - pages * resource.getpagesize())
    return max(min(found), 0)


def require_memory(triangles: int, vertices: int, what: str) -> None:
    """Raise SceneError where that many triangles and vertices would not fit into memory."""
    needed = (triangles + vertices) * BYTES_PER_ELEMENT
    free = available_bytes()
    if needed > free:
        raise SceneError(
            f"{what}: found {triangles:,} triangles after instancing, which need {needed / 2**20:,.0f} MiB; "
            f"expected at most the {free / 2**20:,.0f} MiB that are free; load a part of the scene"
        )
