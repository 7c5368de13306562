# SPDX-License-Identifier: Apache-2.0
"""The binary part of a .glb: arrays as accessors, images in their encoding."""

from __future__ import annotations

import numpy as np
import pygltflib as gl

COMPONENTS = {"f": gl.FLOAT, "H": gl.UNSIGNED_SHORT, "I": gl.UNSIGNED_INT}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
MOST_SHORT = 65534  # 65535 is the primitive restart index


class Binary:
    """Appends to the first buffer of `document`."""

    def __init__(self, document: gl.GLTF2) -> None:
        self._document = document
        self._bytes = bytearray()

    def view(self, data: bytes | memoryview, target: int | None = None) -> int:
        """Add a buffer view of these bytes."""
        self._bytes += b"\0" * (-len(self._bytes) % 4)
        view = gl.BufferView(buffer=0, byteOffset=len(self._bytes), byteLength=len(data), target=target)
        self._bytes += data
        self._document.bufferViews.append(view)
        return len(self._document.bufferViews) - 1

    def vertices(self, values: np.ndarray, bounds: bool = False) -> int:
        """Add an accessor of vertex values (n, k), float32 or normalized uint16, optionally with bounds."""
        return self._accessor(
            values,
            self.view(np.ascontiguousarray(values).data.cast("B"), gl.ARRAY_BUFFER),
            normalized=values.dtype.char == "H" or None,
            min=values.min(axis=0).tolist() if bounds else None,
            max=values.max(axis=0).tolist() if bounds else None,
        )

    def indices(self, corners: np.ndarray) -> int:
        """Add an accessor of vertex numbers, two bytes each if that suffices."""
        values = corners.ravel().astype(np.uint16 if corners.max() <= MOST_SHORT else np.uint32)
        return self._accessor(values, self.view(values.data.cast("B"), gl.ELEMENT_ARRAY_BUFFER))

    def finish(self) -> None:
        """Set the document's buffer to the collected bytes."""
        self._document.buffers[0].byteLength = len(self._bytes)
        self._document.set_binary_blob(bytes(self._bytes))

    def _accessor(self, values: np.ndarray, view: int, **fields: object) -> int:
        self._document.accessors.append(
            gl.Accessor(
                bufferView=view,
                componentType=COMPONENTS[values.dtype.char],
                count=len(values),
                type=KINDS[1 if values.ndim == 1 else values.shape[1]],
                **fields,
            )
        )
        return len(self._document.accessors) - 1
