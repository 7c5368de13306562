# SPDX-License-Identifier: Apache-2.0
"""Refuses a scene that would not fit into memory before anything of its size is allocated."""

from __future__ import annotations

from deltalux.errors import SceneError
from deltalux.memory import available_memory

# Arrays of a Mesh, and temporary arrays while it is made. Measured: 212 bytes per triangle and per vertex if
# one mesh holds two million triangles, 54 to 88 if many meshes share 300,000.
BYTES_PER_ELEMENT = 240
# Records of a node and its Mesh, with their matrices. Measured: 3,200 to 3,300 bytes for each of 20,000.
BYTES_PER_NODE = 4000
# Python objects for JSON text. Measured: 2.5 to 5.5 bytes per byte for real files, 30 for bare brackets.
BYTES_PER_JSON_BYTE = 32


def require_memory_for_triangles(triangles: int, vertices: int) -> None:
    """Raise SceneError if that many triangles and vertices would not fit into memory."""
    needed = (triangles + vertices) * BYTES_PER_ELEMENT
    _require(needed, f"scene: found {triangles:,} triangles after instancing")


def require_memory_for_nodes(nodes: int) -> None:
    """Raise SceneError if that many nodes, most of them with a mesh, would not fit into memory."""
    _require(nodes * BYTES_PER_NODE, f"scene: found {nodes:,} nodes after instancing")


def require_memory_for_json(size: int) -> None:
    """Raise SceneError if JSON text of that many bytes would not fit into memory once read."""
    _require(size * BYTES_PER_JSON_BYTE, f"JSON: found {size:,} bytes of text")


def require_memory_for_decoding(size: int) -> None:
    """Raise SceneError if that many bytes of decoded buffer views would not fit into memory."""
    _require(2 * size, f"compressed buffer views: found {size:,} bytes once decoded")


def _require(needed: int, found: str) -> None:
    free = available_memory()
    if 0 < free < needed:  # 0 = unknown
        raise SceneError(
            f"{found}, which need {needed / 2**20:,.0f} MiB; expected at most the {free / 2**20:,.0f} MiB "
            "that are free; load a part of the scene"
        )
