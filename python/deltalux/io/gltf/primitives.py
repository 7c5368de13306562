# SPDX-License-Identifier: Apache-2.0
"""glTF meshes to triangles in their own space: modes, windings, shared and oversized vertex arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux.io.decoding.process import DecoderProcess
from deltalux.io.diagnostics import element, malformed
from deltalux.vectors import triangle_areas

from .accessors import Accessors
from .buffers import Buffers
from .document import COMPRESSION, Document, compression_remedy
from .draco import NAME as DRACO
from .draco import DracoPrimitives
from .materials import Materials
from .schema import LIT_ATTRIBUTE
from .vertex_colours import MOST, tints

TRIANGLES, STRIP, FAN = 4, 5, 6
LIT = (
    "this file was lit by Deltalux: its vertex colours are light, not reflectance, and are left out; "
    "surfaces that shone are dark (load the scene that it was made from)"
)
NO_TRIANGLES = {0: "points", 1: "lines", 2: "lines", 3: "lines"}


@dataclass(frozen=True)
class Surface:
    """Triangles of one glTF mesh in the mesh's space.

    `vertices` (n, 3) float64; `triangles` (m, 3) int64; `materials` (m,) int64, the glTF material of each
    triangle, -1 for glTF's default material, or the number of a tinted one; `coordinates` (m, 3, 2) float32,
    the texture coordinates of each corner, NaN where a triangle needs or has none; None if no triangle has
    any; `tinted`: whether vertices have colours.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    materials: np.ndarray
    coordinates: np.ndarray | None = None
    tinted: bool = False

    def placed(self, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Vertices transformed by a 4x4 matrix, triangles whose front stays the front, and coordinates."""
        with np.errstate(over="ignore", invalid="ignore"):
            vertices = self.vertices @ matrix[:3, :3].T + matrix[:3, 3]
        corners = slice(None, None, -1 if np.linalg.det(matrix[:3, :3]) < 0 else 1)
        coordinates = None if self.coordinates is None else self.coordinates[:, corners]
        return vertices, self.triangles[:, corners], coordinates


class Primitives:
    """Reads each glTF mesh once."""

    def __init__(
        self,
        document: Document,
        accessors: Accessors,
        buffers: Buffers,
        decoder: DecoderProcess,
        materials: Materials,
        users: Mapping[int, str],
    ) -> None:
        """`users`: for each mesh the name of the first object that it is part of."""
        self._materials = materials
        self._users = users
        self._document = document
        self._accessors = accessors
        self._draco = DracoPrimitives(accessors, buffers, decoder)
        self._surfaces: dict[int, Surface] = {}

    def size(self, mesh: int) -> tuple[int, int]:
        """Number of triangles, and an upper bound of the number of vertices; reads no array."""
        triangles = vertices = 0
        for place, primitive in self._triangle_primitives(mesh):
            corners, count = self._declared(place, primitive)
            own = corners // 3 if primitive.mode == TRIANGLES else max(corners - 2, 0)
            triangles += own
            vertices += min(count, 3 * own)
        return triangles, vertices

    def surface(self, mesh: int) -> Surface:
        """All triangles of a mesh."""
        if mesh not in self._surfaces:
            self._surfaces[mesh] = self._read(mesh)
        return self._surfaces[mesh]

    def note_unhonoured(self, mesh: int, name: str) -> None:
        """Warn of contents of the mesh that are ignored."""
        notes = self._document.notes
        for primitive in self._document.gltf.meshes[mesh].primitives:
            if primitive.mode in NO_TRIANGLES:
                notes.add(f"{NO_TRIANGLES[primitive.mode]} are not surfaces and are left out", name)
            if primitive.targets:
                notes.add("morph targets are not applied: vertices stand as authored", name)
        if self.surface(mesh).tinted:
            notes.add("vertex colours count with the mean of each triangle", name)

    def _triangle_primitives(self, mesh: int) -> list[tuple[str, Any]]:
        found = []
        for i, primitive in enumerate(self._document.gltf.meshes[mesh].primitives):
            place = f"meshes[{mesh}].primitives[{i}]"
            if primitive.mode in NO_TRIANGLES:
                continue
            if primitive.mode not in (TRIANGLES, STRIP, FAN):
                raise malformed(f"{place}.mode", primitive.mode, "0 to 6")
            if primitive.attributes.POSITION is None:
                raise malformed(f"{place}.attributes", "no POSITION", "it to be there")
            if primitive.material is not None:
                element(self._document.gltf.materials, primitive.material, f"{place}.material")
                if self._materials.leaves_out(primitive.material):
                    continue
            found.append((place, primitive))
        return found

    def _declared(self, place: str, primitive: Any) -> tuple[int, int]:
        """Declared numbers of corners and vertices."""
        if self._is_compressed(place, primitive):
            return self._draco.size(primitive, place)
        count = self._accessors.count(primitive.attributes.POSITION, f"{place}.attributes.POSITION")
        if primitive.indices is None:
            return count, count
        return self._accessors.count(primitive.indices, f"{place}.indices"), count

    def _is_compressed(self, place: str, primitive: Any) -> bool:
        """Whether the data exist only in compressed form; FormatError if they cannot be decoded."""
        compressed = set(primitive.extensions) & COMPRESSION
        position = primitive.attributes.POSITION
        if not compressed or self._accessors.has_data(position, f"{place}.attributes.POSITION"):
            return False
        name = min(compressed)
        if remedy := compression_remedy(name):
            raise malformed(place, f"data compressed by {name} only", "plain accessors", remedy)
        return name == DRACO

    def _corners(self, place: str, primitive: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Positions, the corners of the list, strip or fan, and the vertices' texture coordinates."""
        name = self._coordinates_name(primitive)
        if self._is_compressed(place, primitive):
            return self._draco.read(primitive, place, name)
        points = self._accessors.positions(primitive.attributes.POSITION, f"{place}.attributes.POSITION")
        coordinates = None
        if name is not None:
            accessor, where = getattr(primitive.attributes, name), f"{place}.attributes.{name}"
            coordinates = self._accessors.coordinates(accessor, where, len(points))
        if primitive.indices is None:
            return points, np.arange(len(points), dtype=np.int64), coordinates
        corners = self._accessors.indices(primitive.indices, f"{place}.indices", len(points))
        return points, corners, coordinates

    def _is_lit(self, primitive: Any) -> bool:
        """Whether vertex colours are light that Deltalux wrote, perhaps changed by another program since."""
        own = (self._document.gltf.asset.generator or "").startswith("deltalux ")
        return own or getattr(primitive.attributes, LIT_ATTRIBUTE, None) is not None

    def _coordinates_name(self, primitive: Any) -> str | None:
        """Name of the attribute that the material's texture needs; None if none is needed or present."""
        number = None if primitive.material is None else self._materials.coordinate_set(primitive.material)
        name = f"TEXCOORD_{number}"
        return None if number is None or getattr(primitive.attributes, name, None) is None else name

    def _read(self, mesh: int) -> Surface:
        vertices, triangles, materials = (
            [np.zeros((0, 3))],
            [np.zeros((0, 3), np.int64)],
            [np.zeros(0, np.int64)],
        )
        coordinates: list[np.ndarray | None] = []
        offset = 0
        for place, primitive in self._triangle_primitives(mesh):
            points, corners, texels = self._corners(place, primitive)
            own = _assemble(corners, primitive.mode, place)
            if texels is not None:
                texels = texels[own]
                texels.setflags(write=False)
            coordinates.append(texels)
            materials.append(self._materials_of(place, primitive, own, points))
            used, own = _compact(own, len(points))
            vertices.append(points if used is None else points[used])
            triangles.append(own + offset)
            offset += len(vertices[-1])
        points, corners = np.concatenate(vertices), np.concatenate(triangles)
        numbers = np.concatenate(materials)
        joined = joined_coordinates(coordinates, [len(own) for own in triangles[1:]])
        tinted = bool((numbers >= len(self._document.gltf.materials)).any())
        numbers = self._materials.on_object(numbers, joined, _areas(points, corners), self._users[mesh])
        return Surface(points, corners, numbers, joined, tinted)

    def _materials_of(
        self, place: str, primitive: Any, triangles: np.ndarray, points: np.ndarray
    ) -> np.ndarray:
        """Number of each triangle's material, by its vertices' colours where it has any."""
        index = -1 if primitive.material is None else primitive.material
        if primitive.attributes.COLOR_0 is None:
            return np.full(len(triangles), index, np.int64)
        if self._is_lit(primitive):
            self._document.notes.add(LIT)
            return np.full(len(triangles), index, np.int64)
        if self._is_compressed(place, primitive):
            self._document.notes.add("vertex colours that Draco compressed are not honoured", place)
            return np.full(len(triangles), index, np.int64)
        where = f"{place}.attributes.COLOR_0"
        colours = self._accessors.colours(primitive.attributes.COLOR_0, where, len(points))
        palette, number = tints(colours[triangles], _areas(points, triangles))
        if len(palette) == MOST:
            self._document.notes.add(f"vertex colours: similar ones become one, {MOST} in all", place)
        return self._materials.tinted(index, palette)[number]


def _areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(m,) areas, as weights: those beyond float64 are 0."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.nan_to_num(triangle_areas(points[triangles]), posinf=0.0)


def joined_coordinates(parts: list[np.ndarray | None], counts: list[int]) -> np.ndarray | None:
    """(m, 3, 2) float32 of all parts, of `counts` triangles each; NaN where absent, None if all are."""
    own = [(part, count) for part, count in zip(parts, counts, strict=True) if count]
    if all(part is None for part, _ in own):
        return None
    if len(own) == 1:  # instances share their array
        return own[0][0]
    missing = np.float32(np.nan)
    joined = np.concatenate(
        [np.full((count, 3, 2), missing) if part is None else part for part, count in own]
    )
    joined.setflags(write=False)
    return joined


def _assemble(corners: np.ndarray, mode: int, place: str) -> np.ndarray:
    """(m, 3) triangles with glTF's winding from the corners of a list, strip or fan."""
    if mode == TRIANGLES:
        if len(corners) % 3:
            raise malformed(place, f"{len(corners)} corners", "a multiple of 3 for separate triangles")
        return corners.reshape(-1, 3)
    if len(corners) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == FAN:
        return np.stack([corners[1:-1], corners[2:], np.full(len(corners) - 2, corners[0])], axis=1)
    strip = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    strip[1::2] = strip[1::2][:, [0, 2, 1]]  # every other triangle has the opposite winding
    return strip


def _compact(triangles: np.ndarray, vertex_count: int) -> tuple[np.ndarray | None, np.ndarray]:
    """The vertices in use (None: all) and the triangles numbered by them.

    Exporters often let a thousand small meshes share one vertex array, of which each must not keep all.
    """
    if triangles.size * 8 < vertex_count:  # sorting few corners is cheaper than marking many vertices
        used, own = np.unique(triangles, return_inverse=True)
        return used, own.reshape(-1, 3)
    marked = np.zeros(vertex_count, bool)
    marked[triangles] = True
    if marked.all():
        return None, triangles
    renumbered = np.cumsum(marked) - 1
    return np.flatnonzero(marked), renumbered[triangles]
