# SPDX-License-Identifier: Apache-2.0
"""glTF's two containers: JSON text, or GLB with a JSON and a binary chunk."""

from __future__ import annotations

import gc
import json
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from deltalux.errors import FormatError
from deltalux.io.diagnostics import malformed
from deltalux.io.files import read_regular_file
from deltalux.io.scene_size import require_memory_for_json

MAGIC = b"glTF"
JSON_CHUNK = 0x4E4F534A
BINARY_CHUNK = 0x004E4942


def read_container(path: Path) -> tuple[dict[str, Any], bytes | None]:
    """The file's JSON object, and the binary chunk of a GLB.

    The content determines which container it is, not the suffix.
    """
    data = read_regular_file(path, "file")
    if data[:4] == MAGIC:
        text, blob = _split_glb(data)
    else:
        text, blob = data, None
    return _parse_json(text), blob


def _split_glb(data: bytes) -> tuple[bytes, bytes | None]:
    if len(data) < 20:
        raise malformed(
            "GLB header", f"{len(data)} bytes", "at least 20", "the file is truncated: copy it again"
        )
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise malformed("GLB header", f"version {version}", "version 2", "convert the file to glTF 2.0")
    if length > len(data):
        raise malformed(
            "GLB header", f"{len(data)} bytes", f"{length}", "the file is truncated: copy it again"
        )
    chunks: list[tuple[int, int, int]] = []  # type, first byte, bytes
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<II", data, offset)
        offset += 8
        if size > length - offset:
            raise malformed(
                f"GLB chunk {len(chunks)}",
                f"{size} bytes",
                f"at most {length - offset}",
                "the file is truncated: copy it again",
            )
        chunks.append((kind, offset, size))
        offset += size
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise malformed("GLB chunk 0", "something else", "a JSON chunk")
    _, start, size = chunks[0]
    blob = next((data[at : at + n] for kind, at, n in chunks[1:2] if kind == BINARY_CHUNK), None)
    return data[start : start + size], blob


def _parse_json(text: bytes) -> dict[str, Any]:
    require_memory_for_json(len(text))
    try:
        with _no_garbage_collection():
            root = json.loads(text.decode("utf-8-sig"), parse_constant=_refuse_constant)
    except RecursionError:
        raise malformed("JSON", "deeply nested lists or objects", "a glTF object") from None
    except ValueError as error:
        raise FormatError(
            f"JSON: found text that is no JSON ({error}); repair or re-export the file"
        ) from None
    if not isinstance(root, dict):
        raise malformed("JSON", root, "an object")
    return root


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    """JSON has no cycles, but garbage collection during parsing takes eight times as long as parsing."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"the number {name}")
