# SPDX-License-Identifier: Apache-2.0
"""KHR_draco_mesh_compression: one primitive's triangles and vertices, as its accessors declare them."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux.io.decoding.process import DecoderProcess
from deltalux.io.diagnostics import malformed

from .accessors import Accessors
from .buffers import Buffers

NAME = "KHR_draco_mesh_compression"
TRIANGLES = 4


class DracoPrimitives:
    """Decodes primitives whose accessors have no data of their own."""

    def __init__(self, accessors: Accessors, buffers: Buffers, decoder: DecoderProcess) -> None:
        self._accessors = accessors
        self._buffers = buffers
        self._decoder = decoder

    def size(self, primitive: Any, place: str) -> tuple[int, int]:
        """Numbers of corners and vertices that the accessors declare; decodes nothing."""
        if primitive.mode != TRIANGLES or primitive.indices is None:
            raise malformed(place, f"compressed data, mode {primitive.mode}", "indexed triangles, mode 4")
        source, where = primitive.extensions[NAME], f"{place}.extensions.{NAME}"
        for key in ("bufferView", "attributes"):
            if key not in source:
                raise malformed(where, f'no "{key}"', "it to be there")
        if source["attributes"].POSITION is None:
            raise malformed(f"{where}.attributes", "no POSITION", "it to be there")
        corners = self._accessors.declared(primitive.indices, f"{place}.indices")
        return corners, self._accessors.declared(
            primitive.attributes.POSITION, f"{place}.attributes.POSITION"
        )

    def read(
        self, primitive: Any, place: str, coordinates: str | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Positions (n, 3), corners (k,) and coordinates (n, 2), as many as are declared.

        `coordinates` names the attribute of coordinates; None if there is none, or it is not compressed.
        """
        source, where = primitive.extensions[NAME], f"{place}.extensions.{NAME}"
        declared = self.size(primitive, place)
        data = self._buffers.view(source["bufferView"], f"{where}.bufferView")
        also = getattr(source["attributes"], coordinates, None) if coordinates else None
        wanted = [source["attributes"].POSITION, *(() if also is None else (also,))]
        decoded = self._decoder.decode(data, sum(declared), where, codec="draco", attributes=wanted)
        triangles, points = decoded[:2]
        if (triangles.size, *points.shape) != (*declared, 3):
            raise malformed(
                where,
                f"{len(triangles)} triangles and positions of shape {points.shape}",
                f"{declared[0] // 3} triangles and {declared[1]} vertices as its accessors declare",
            )
        points = self._accessors.positions_of(
            primitive.attributes.POSITION, f"{place}.attributes.POSITION", points
        )
        corners = self._accessors.indices_of(
            primitive.indices, f"{place}.indices", triangles.ravel(), len(points)
        )
        if also is None or coordinates is None:
            return points, corners, None
        if decoded[2].shape != (len(points), 2):
            found = f"{coordinates} of shape {decoded[2].shape}"
            raise malformed(where, found, f"two numbers for each of {len(points)} vertices")
        accessor = getattr(primitive.attributes, coordinates)
        texels = self._accessors.coordinates_of(
            accessor, f"{place}.attributes.{coordinates}", decoded[2], len(points)
        )
        return points, corners, texels
