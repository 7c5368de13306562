# SPDX-License-Identifier: Apache-2.0
"""EXT_meshopt_compression: the record of a compressed buffer view, checked before it is decoded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from deltalux.io.decoding.process import DecoderProcess
from deltalux.io.diagnostics import malformed

NAME = "EXT_meshopt_compression"
REQUIRED = ("buffer", "byteLength", "byteStride", "count", "mode")
FILTER_STRIDES = {"NONE": range(4, 257, 4), "OCTAHEDRAL": (4, 8), "QUATERNION": (8,),
                  "EXPONENTIAL": range(4, 257, 4)}  # fmt: skip
INDEX_STRIDES = (2, 4)
# Most bytes that one compressed byte can expand to: 16 elements take at least two bits of each of their
# bytes' headers, three indices of triangles or one of a sequence at least one byte.
MOST_OF_ATTRIBUTES = 64
# The memory limit of a decoder is per element; this many decoded bytes count as one element.
BYTES_PER_ELEMENT = 128


@dataclass(frozen=True)
class MeshoptView:
    """The extension's record of one buffer view; see the specification for its fields."""

    place: str
    buffer: int
    start: int
    end: int
    stride: int
    count: int
    mode: str
    filter: str

    @property
    def decoded(self) -> int:
        """Bytes once decoded."""
        return self.count * self.stride

    def decode(self, data: memoryview, decoder: DecoderProcess) -> memoryview:
        """The view's bytes, of which `data` are the compressed form."""
        if self.count == 0:
            return memoryview(b"")
        elements = self.decoded // BYTES_PER_ELEMENT
        job = {"codec": "meshopt", "mode": self.mode, "filter": self.filter}
        (values,) = decoder.decode(data, elements, self.place, **job, count=self.count, stride=self.stride)
        if values.nbytes != self.decoded:
            raise malformed(self.place, f"{values.nbytes} decoded bytes", f"{self.decoded}")
        return memoryview(values.tobytes())


def meshopt_view(view: Any, place: str) -> MeshoptView:
    """The checked record of a compressed buffer view; whether its bytes lie in the buffer is not checked."""
    source = view.extensions[NAME]
    place = f"{place}.extensions.{NAME}"
    for key in REQUIRED:
        if key not in source:
            raise malformed(place, f'no "{key}"', "it to be there")
    start = source.get("byteOffset", 0)
    found = MeshoptView(
        place,
        source["buffer"],
        start,
        start + source["byteLength"],
        source["byteStride"],
        source["count"],
        source["mode"],
        source.get("filter", "NONE"),
    )
    _check_layout(found)
    _check_sizes(found, view, source["byteLength"])
    return found


def _check_layout(view: MeshoptView) -> None:
    if view.mode not in ("ATTRIBUTES", "TRIANGLES", "INDICES"):
        raise malformed(f"{view.place}.mode", repr(view.mode)[:40], "ATTRIBUTES, TRIANGLES or INDICES")
    indices = view.mode != "ATTRIBUTES"
    allowed = ("NONE",) if indices else tuple(FILTER_STRIDES)
    if view.filter not in allowed:
        raise malformed(f"{view.place}.filter", repr(view.filter)[:40], f"one of {', '.join(allowed)}")
    strides = INDEX_STRIDES if indices else FILTER_STRIDES[view.filter]
    if view.stride not in strides:
        raise malformed(f"{view.place}.byteStride", view.stride, f"one of {', '.join(map(str, strides))}")
    if view.mode == "TRIANGLES" and view.count % 3:
        raise malformed(f"{view.place}.count", view.count, "a multiple of 3")


def _check_sizes(view: MeshoptView, parent: Any, length: int) -> None:
    if view.decoded != parent.byteLength:
        raise malformed(
            f"{view.place}.count",
            f"{view.count} elements of {view.stride} bytes",
            f"the {parent.byteLength} bytes of the view",
        )
    if parent.byteStride is not None and parent.byteStride != view.stride:
        raise malformed(f"{view.place}.byteStride", view.stride, f"{parent.byteStride}, the view's")
    most = {"ATTRIBUTES": MOST_OF_ATTRIBUTES * length, "TRIANGLES": 3 * view.stride * length}
    if view.decoded > most.get(view.mode, view.stride * length):
        raise malformed(
            f"{view.place}.byteLength",
            f"{length} bytes for {view.count} elements of {view.stride}",
            "more compressed data",
        )
