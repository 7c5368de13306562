# SPDX-License-Identifier: Apache-2.0
"""The process that `DecoderProcess` starts: reads jobs from stdin, writes decoded bytes to stdout.

It runs as a script, so that it starts without loading the rest of the package; `process.py` explains why
third-party decoders run in a separate process. No module beside it may have the name of one that it imports.
"""

from __future__ import annotations

import json
import resource
import struct
import sys
from typing import Any, BinaryIO

import numpy as np

LENGTH = struct.Struct("<Q")
FILTERS = {
    "OCTAHEDRAL": "decode_filter_oct",
    "QUATERNION": "decode_filter_quat",
    "EXPONENTIAL": "decode_filter_exp",
}


def draco(data: bytes, job: dict[str, Any]) -> list[np.ndarray]:
    """Triangles (m, 3), and each of `attributes` (n, k)."""
    import DracoPy

    mesh = DracoPy.decode(data)
    if not isinstance(mesh, DracoPy.DracoMesh):
        raise ValueError("a point cloud")
    found = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
    for wanted in job["attributes"]:
        if wanted not in found:
            raise ValueError(f"no attribute {wanted}")
    return [np.asarray(mesh.faces).reshape(-1, 3), *(found[wanted] for wanted in job["attributes"])]


def meshopt(data: bytes, job: dict[str, Any]) -> list[np.ndarray]:
    """The bytes of one buffer view."""
    import meshoptimizer

    count, size = job["count"], job["stride"]
    if job["mode"] == "ATTRIBUTES":
        values = meshoptimizer.decode_vertex_buffer(count, size, data).view(np.uint8).ravel()
        if job["filter"] in FILTERS:
            values = getattr(meshoptimizer, FILTERS[job["filter"]])(values, count, size)
    else:
        triangles = job["mode"] == "TRIANGLES"
        name = "decode_index_buffer" if triangles else "decode_index_sequence"
        values = getattr(meshoptimizer, name)(count, size, data).view(np.uint8)
    return [values[: count * size]]


def limit_memory(more: int) -> None:
    """Limit this process to `more` bytes beyond its present memory."""
    with open("/proc/self/statm") as file:  # noqa: PTH123, pathlib would load slower than all of this
        now = int(file.read().split()[0]) * resource.getpagesize()
    most = resource.getrlimit(resource.RLIMIT_AS)[1]
    wanted = now + more if most == resource.RLIM_INFINITY else min(now + more, most)
    resource.setrlimit(resource.RLIMIT_AS, (wanted, most))


def read(stream: BinaryIO) -> bytes:
    """One message; empty at the end of the stream."""
    head = stream.read(LENGTH.size)
    return stream.read(LENGTH.unpack(head)[0]) if head else b""


def write(stream: BinaryIO, *parts: bytes) -> None:
    """Write several messages."""
    for part in parts:
        stream.write(LENGTH.pack(len(part)) + part)
    stream.flush()


def serve(jobs: BinaryIO, results: BinaryIO) -> None:
    """Process jobs until there are no more; write a description as JSON, then the arrays that it lists."""
    for module in ("DracoPy", "meshoptimizer"):  # before memory is limited
        try:
            __import__(module)
        except ImportError:
            continue
    while description := read(jobs):
        job, data = json.loads(description), read(jobs)
        try:
            limit_memory(job["memory"])
            arrays = {"draco": draco, "meshopt": meshopt}[job["codec"]](data, job)
            shapes = [[str(array.dtype), list(array.shape)] for array in arrays]
            write(results, json.dumps({"arrays": shapes}).encode(), *(a.tobytes() for a in arrays))
        except Exception as error:  # decoders may raise any exception for a broken file
            write(results, json.dumps({"error": f"{type(error).__name__}: {error}"[:200]}).encode())


if __name__ == "__main__":
    serve(sys.stdin.buffer, sys.stdout.buffer)
