# SPDX-License-Identifier: Apache-2.0
"""Bytes of a glTF document: buffers, buffer views, and files that must lie in the document's folder."""

from __future__ import annotations

import base64
import binascii
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

from .diagnostics import element, malformed
from .files import read_beside
from .gltf_document import COMPRESSION, Document


class Buffers:
    """Reads buffers when they are first used, and keeps them."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._loaded: dict[int, memoryview] = {}

    def view(self, index: int, where: str) -> memoryview:
        """The bytes of a buffer view, without a copy."""
        view = element(self._document.gltf.bufferViews, index, where)
        place = f"bufferViews[{index}]"
        data = self._buffer(view.buffer, f"{place}.buffer", set(view.extensions) & COMPRESSION)
        start, end = view.byteOffset, view.byteOffset + view.byteLength
        if end > len(data):
            raise malformed(place, f"bytes {start} to {end}", f"at most the buffer's {len(data)} bytes")
        return data[start:end]

    def stride(self, index: int) -> int | None:
        """The view's byte stride, None where elements are packed."""
        return self._document.gltf.bufferViews[index].byteStride

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
                raise malformed(
                    place, f"data compressed by {name} only", "plain data", "export without compression"
                )
            else:
                raise malformed(place, "no data", "a uri, or the binary chunk of a GLB")
            if len(data) < buffer.byteLength:
                raise malformed(place, f"{len(data)} bytes", f"{buffer.byteLength}", "the file is truncated")
            self._loaded[index] = memoryview(data)[: buffer.byteLength]
        return self._loaded[index]


def read_uri(folder: Path, uri: str, where: str, limit: int | None = None) -> bytes:
    """The bytes that a buffer's or image's URI stands for: a data URI, or a file in or below `folder`."""
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
