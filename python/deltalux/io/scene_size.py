# SPDX-License-Identifier: Apache-2.0
"""Refuses a scene that would not fit into memory before anything of its size is allocated."""

from __future__ import annotations

from deltalux.errors import SceneError
from deltalux.memory import available_memory

# Arrays of a Mesh and the temporaries of making it. Measured: 212 bytes per triangle and per vertex where one
# mesh holds two million triangles, 54 to 88 where many meshes share 300,000.
BYTES_PER_ELEMENT = 240


def require_memory(triangles: int, vertices: int, where: str) -> None:
    """Raise SceneError where that many triangles and vertices would not fit into memory."""
    needed = (triangles + vertices) * BYTES_PER_ELEMENT
    free = available_memory()
    if 0 < free < needed:  # 0 = unknown
        raise SceneError(
            f"{where}: found {triangles:,} triangles after instancing, which need {needed / 2**20:,.0f} MiB; "
            f"expected at most the {free / 2**20:,.0f} MiB that are free; load a part of the scene"
        )
