# SPDX-License-Identifier: Apache-2.0
"""Bytes of a glTF document: buffers, buffer views, and files that must lie in the document's folder."""

from __future__ import annotations

import base64
import binascii
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

from deltalux.io.decoding.process import DecoderProcess
from deltalux.io.diagnostics import element, malformed
from deltalux.io.files import read_beside
from deltalux.io.scene_size import require_memory_for_decoding

from .document import COMPRESSION, Document, compression_remedy
from .meshopt import NAME as MESHOPT
from .meshopt import meshopt_view


class Buffers:
    """Reads buffers and decodes compressed views when they are first used, and caches them."""

    def __init__(self, document: Document, decoder: DecoderProcess) -> None:
        self._document = document
        self._decoder = decoder
        self._loaded: dict[int, memoryview] = {}
        self._decoded: dict[int, memoryview] = {}

    def length(self, index: int, where: str) -> int:
        """Number of bytes of a buffer view, after checking its bounds; decodes nothing."""
        view = element(self._document.gltf.bufferViews, index, where)
        place = f"bufferViews[{index}]"
        if self._is_compressed(view):
            compressed = meshopt_view(view, place)
            self._bytes(compressed.buffer, compressed.start, compressed.end, compressed.place, set())
        else:
            self._plain(view, place)
        return view.byteLength

    def view(self, index: int, where: str) -> memoryview:
        """The bytes of a buffer view, without a copy."""
        view = element(self._document.gltf.bufferViews, index, where)
        place = f"bufferViews[{index}]"
        if not self._is_compressed(view):
            return self._plain(view, place)
        if index not in self._decoded:
            compressed = meshopt_view(view, place)
            data = self._bytes(compressed.buffer, compressed.start, compressed.end, compressed.place, set())
            require_memory_for_decoding(compressed.decoded + sum(map(len, self._decoded.values())))
            self._decoded[index] = compressed.decode(data, self._decoder)
        return self._decoded[index]

    def stride(self, index: int) -> int | None:
        """The view's byte stride; None if elements are packed."""
        return self._document.gltf.bufferViews[index].byteStride

    def _is_compressed(self, view: Any) -> bool:
        """Whether the view's bytes must be decoded; fallback buffers may contain them, too."""
        if MESHOPT not in view.extensions or compression_remedy(MESHOPT):
            return False
        buffer = element(self._document.gltf.buffers, view.buffer, f"bufferViews.{MESHOPT}.buffer")
        fallback = buffer.extensions.get(MESHOPT, {}).get("fallback", False)
        has_data = view.buffer == 0 and self._document.blob is not None and not fallback
        return buffer.uri is None and not has_data

    def _plain(self, view: Any, place: str) -> memoryview:
        start, end = view.byteOffset, view.byteOffset + view.byteLength
        return self._bytes(view.buffer, start, end, place, set(view.extensions) & COMPRESSION)

    def _bytes(self, buffer: int, start: int, end: int, place: str, compression: set[str]) -> memoryview:
        data = self._buffer(buffer, f"{place}.buffer", compression)
        if end > len(data):
            raise malformed(place, f"bytes {start} to {end}", f"at most the buffer's {len(data)} bytes")
        return data[start:end]

    def _buffer(self, index: int, where: str, compression: set[str]) -> memoryview:
        buffer = element(self._document.gltf.buffers, index, where)
        if index not in self._loaded:
            place = f"buffers[{index}]"
            if buffer.uri is not None:
                data = read_uri(self._document.path.parent, buffer.uri, place, buffer.byteLength)
            elif index == 0 and self._document.blob is not None:
                data = self._document.blob
            elif compression:
                name = min(compression)
                remedy = compression_remedy(name) or "repair or re-export the file"
                raise malformed(place, f"data compressed by {name} only", "plain data", remedy)
            else:
                raise malformed(place, "no data", "a uri, or the binary chunk of a GLB")
            if len(data) < buffer.byteLength:
                raise malformed(place, f"{len(data)} bytes", f"{buffer.byteLength}", "the file is truncated")
            self._loaded[index] = memoryview(data)[: buffer.byteLength]
        return self._loaded[index]


def read_uri(folder: Path, uri: str, where: str, limit: int | None = None) -> bytes:
    """The bytes that a buffer's or image's URI refers to: a data URI, or a file in or below `folder`."""
    if uri[:5].lower() == "data:":
        return _decode_data_uri(uri, where)
    return read_beside(folder, unquote(uri), where, limit)


def _decode_data_uri(uri: str, where: str) -> bytes:
    header, comma, payload = uri.partition(",")
    if not comma:
        raise malformed(where, "a data URI without a comma", '"data:…;base64,…"')
    if not header.lower().endswith(";base64"):
        return unquote_to_bytes(payload)
    try:
        return base64.b64decode(unquote_to_bytes(payload), validate=False)
    except (binascii.Error, ValueError) as error:
        raise malformed(where, f"a data URI that is no base64 ({error})", "base64 text") from None
