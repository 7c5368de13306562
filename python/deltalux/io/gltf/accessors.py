# SPDX-License-Identifier: Apache-2.0
"""Converts accessors to arrays: strides, sparse values, normalised integers; checks every bound first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux.io.diagnostics import element, malformed

from .buffers import Buffers
from .document import Document

COMPONENTS: dict[int, np.dtype] = {
    5120: np.dtype("<i1"),
    5121: np.dtype("<u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
INDEX_COMPONENTS = (5121, 5123, 5125)
VECTOR_COMPONENTS = (5120, 5121, 5122, 5123, 5126)  # some of the integers come from KHR_mesh_quantization
# Without a buffer view nothing bounds the count; a larger sparse accessor is not plausible for a mesh.
MAX_UNBACKED_COUNT = 1 << 22


@dataclass(frozen=True)
class _Accessor:
    place: str
    source: Any  # record of pygltflib
    dtype: np.dtype
    width: int

    @property
    def count(self) -> int:
        return self.source.count


class Accessors:
    """Reads vertex positions, texture coordinates and vertex indices; errors name the accessor."""

    def __init__(self, document: Document, buffers: Buffers) -> None:
        self._document = document
        self._buffers = buffers
        self._positions: dict[int, np.ndarray] = {}

    def declared(self, index: int, where: str) -> int:
        """Number of elements declared by an accessor whose data are elsewhere."""
        return self._describe(index, where).count

    def count(self, index: int, where: str) -> int:
        """Number of elements, after checking all bounds; allocates nothing of that size."""
        accessor = self._describe(index, where)
        if accessor.source.bufferView is not None:
            self._base_stride(accessor)
        elif accessor.count > MAX_UNBACKED_COUNT:
            raise malformed(
                accessor.place,
                f"{accessor.count} elements without a buffer view",
                f"at most {MAX_UNBACKED_COUNT}",
            )
        if accessor.source.sparse is not None:
            self._sparse(accessor)
        return accessor.count

    def has_data(self, index: int, where: str) -> bool:
        """Whether the accessor has a buffer view or sparse values."""
        source = element(self._document.gltf.accessors, index, where)
        return source.bufferView is not None or source.sparse is not None

    def positions(self, index: int, where: str) -> np.ndarray:
        """(n, 3) float64; integers are interpreted according to KHR_mesh_quantization."""
        if index not in self._positions:
            self.count(index, where)
            self._positions[index] = self.positions_of(index, where, None)
        return self._positions[index]

    def positions_of(self, index: int, where: str, decoded: np.ndarray | None) -> np.ndarray:
        """(n, 3) float64 positions, from values `decoded` elsewhere or (None) the accessor's own data."""
        accessor = self._describe(index, where)
        values = self._vectors(accessor, "VEC3", decoded)
        _require_finite(values, accessor.place, "vertex", "finite positions")
        values.setflags(write=False)
        return values

    def vectors(self, index: int, where: str, kind: str) -> np.ndarray:
        """(n, width) float64 values of the type `kind`, finite."""
        self.count(index, where)
        accessor = self._describe(index, where)
        values = self._vectors(accessor, kind, None)
        _require_finite(values, accessor.place, "element", "finite numbers")
        return values

    def colours(self, index: int, where: str, vertex_count: int) -> np.ndarray:
        """(n, 3) float64 linear colours, one per vertex, 0 to 1; without alpha."""
        accessor = self._for_each(index, where, vertex_count)
        kind = "VEC4" if accessor.source.type == "VEC4" else "VEC3"
        return np.clip(self.vectors(index, where, kind)[:, :3], 0.0, 1.0)

    def coordinates(self, index: int, where: str, vertex_count: int) -> np.ndarray:
        """(n, 2) float32 texture coordinates, one per vertex; NaN where not finite."""
        self.count(index, where)
        return self.coordinates_of(index, where, None, vertex_count)

    def coordinates_of(
        self, index: int, where: str, decoded: np.ndarray | None, vertex_count: int
    ) -> np.ndarray:
        """(n, 2) float32, from values `decoded` elsewhere or (None) from the accessor's own data."""
        accessor = self._for_each(index, where, vertex_count)
        values = self._vectors(accessor, "VEC2", decoded).astype(np.float32)
        return np.where(np.isfinite(values), values, np.float32(np.nan))

    def _for_each(self, index: int, where: str, vertex_count: int) -> _Accessor:
        """The accessor, which must have an element for each vertex."""
        accessor = self._describe(index, where)
        if accessor.count != vertex_count:
            raise malformed(
                accessor.place, f"{accessor.count} elements", f"one for each of {vertex_count} vertices"
            )
        return accessor

    def _vectors(self, accessor: _Accessor, kind: str, decoded: np.ndarray | None) -> np.ndarray:
        """Float64; values that are not finite are kept."""
        self._expect(accessor, kind, VECTOR_COMPONENTS)
        with np.errstate(invalid="ignore"):
            values = (self._read(accessor) if decoded is None else decoded).astype(np.float64)
        if accessor.source.normalized and accessor.dtype.kind != "f":
            values = np.maximum(values / np.iinfo(accessor.dtype).max, -1.0)
        return values

    def indices(self, index: int, where: str, vertex_count: int) -> np.ndarray:
        """(n,) int64, each below `vertex_count`."""
        self.count(index, where)
        return self.indices_of(index, where, None, vertex_count)

    def indices_of(self, index: int, where: str, decoded: np.ndarray | None, vertex_count: int) -> np.ndarray:
        """(n,) int64 below `vertex_count`, from values `decoded` elsewhere or (None) the accessor's own."""
        accessor = self._describe(index, where)
        self._expect(accessor, "SCALAR", INDEX_COMPONENTS)
        values = (self._read(accessor)[:, 0] if decoded is None else decoded).astype(np.int64)
        if values.size and values.max() >= vertex_count:
            raise malformed(
                accessor.place,
                f"vertex index {int(values.max())}",
                f"an index below {vertex_count}, the vertex count",
            )
        return values

    def _describe(self, index: int, where: str) -> _Accessor:
        source = element(self._document.gltf.accessors, index, where)
        place = f"accessors[{index}]"
        if source.componentType not in COMPONENTS:
            raise malformed(f"{place}.componentType", source.componentType, f"one of {list(COMPONENTS)}")
        if source.type not in WIDTHS:
            raise malformed(f"{place}.type", repr(source.type)[:40], "SCALAR, VEC2, VEC3 or VEC4")
        return _Accessor(place, source, COMPONENTS[source.componentType], WIDTHS[source.type])

    def _expect(self, accessor: _Accessor, kind: str, components: tuple[int, ...]) -> None:
        source = accessor.source
        if source.type != kind or source.componentType not in components:
            raise malformed(
                accessor.place,
                f"type {source.type} of component type {source.componentType}",
                f"{kind} of {' or '.join(map(str, components))}",
            )

    def _read(self, accessor: _Accessor) -> np.ndarray:
        if accessor.source.bufferView is None:
            values = np.zeros((accessor.count, accessor.width), accessor.dtype)
        else:
            values = self._base(accessor)
        if accessor.source.sparse is not None:
            where, replacements = self._sparse(accessor)
            values = values.copy()
            values[where] = replacements
        return values

    def _base(self, accessor: _Accessor) -> np.ndarray:
        source = accessor.source
        return self._elements(
            source.bufferView,
            source.byteOffset,
            accessor.dtype,
            accessor.width,
            accessor.count,
            accessor.place,
        )

    def _base_stride(self, accessor: _Accessor) -> int:
        source, size = accessor.source, accessor.dtype.itemsize * accessor.width
        return self._stride(source.bufferView, source.byteOffset, size, accessor.count, accessor.place)

    def _sparse(self, accessor: _Accessor) -> tuple[np.ndarray, np.ndarray]:
        sparse, place = accessor.source.sparse, f"{accessor.place}.sparse"
        if sparse.count > accessor.count:
            raise malformed(f"{place}.count", sparse.count, f"at most the accessor's count {accessor.count}")
        if sparse.indices.componentType not in INDEX_COMPONENTS:
            raise malformed(
                f"{place}.indices", sparse.indices.componentType, f"one of {list(INDEX_COMPONENTS)}"
            )
        dtype = COMPONENTS[sparse.indices.componentType]
        where = self._elements(
            sparse.indices.bufferView, sparse.indices.byteOffset, dtype, 1, sparse.count, f"{place}.indices"
        )[:, 0].astype(np.int64)
        if where.size and (where.max() >= accessor.count or (np.diff(where) <= 0).any()):
            raise malformed(f"{place}.indices", "indices that repeat, fall, or reach beyond the count",
                            f"rising indices below {accessor.count}")  # fmt: skip
        values = self._elements(
            sparse.values.bufferView,
            sparse.values.byteOffset,
            accessor.dtype,
            accessor.width,
            sparse.count,
            f"{place}.values",
        )
        return where, values

    def _elements(
        self, view_index: int, offset: int, dtype: np.dtype, width: int, count: int, place: str
    ) -> np.ndarray:
        """(count, width) view of the buffer view's bytes; no copy."""
        stride = self._stride(view_index, offset, dtype.itemsize * width, count, place)
        if count == 0:
            return np.zeros((0, width), dtype)
        data = self._buffers.view(view_index, f"{place}.bufferView")
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))

    def _stride(self, view_index: int, offset: int, size: int, count: int, place: str) -> int:
        """Bytes from one element to the next, after checking the view's bounds."""
        length = self._buffers.length(view_index, f"{place}.bufferView")
        stride = self._buffers.stride(view_index) or size
        if stride < size:
            raise malformed(f"bufferViews[{view_index}].byteStride", stride, f"at least {size}")
        end = offset + stride * (count - 1) + size if count else offset
        if end > length:
            raise malformed(place, f"{count} elements up to byte {end}", f"at most the view's {length} bytes")
        return stride


def _require_finite(values: np.ndarray, place: str, kind: str, expected: str) -> None:
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        bad = int(np.argmin(finite))
        raise malformed(place, f"{values[bad].tolist()} at {kind} {bad}", expected)
