# SPDX-License-Identifier: Apache-2.0
"""Decoders of compressed geometry, in a separate process.

The data may be hostile, and the decoders of Draco and meshoptimizer are third-party C++ code that trusts
the sizes in it. In a separate process with limits on memory and time, their failures become errors of the
file.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from deltalux import threads
from deltalux.errors import FormatError
from deltalux.io.diagnostics import malformed

from .worker import LENGTH

PACKAGES = {"KHR_draco_mesh_compression": "DracoPy", "EXT_meshopt_compression": "meshoptimizer"}
WORKER = Path(__file__).with_name("worker.py")
DTYPES = ("float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32")
BASE_MEMORY = 256 << 20  # bytes that a decoder may use for any job; below, for each declared element
MEMORY_PER_ELEMENT = 1024
BASE_SECONDS, SECONDS_PER_ELEMENT = 30.0, 1e-4


def missing_package(extension: str) -> str | None:
    """The package to install so that an extension's data can be decoded; None if it is installed."""
    if find_spec(PACKAGES[extension]) is not None:
        return None
    return "install deltalux[compressed], or export the file without compression"


class DecoderProcess:
    """Starts the worker when it is first needed; use it as a context manager."""

    def __init__(self) -> None:
        self._worker: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> DecoderProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop()

    def decode(self, data: bytes | memoryview, elements: int, place: str, **job: Any) -> list[np.ndarray]:
        """The arrays that one job of the worker decodes.

        Parameters
        ----------
        data : compressed
        elements : number of declared vertices and triangles, which bounds memory and time
        place : place of the data in the file, for errors
        job : see `worker`

        Raises
        ------
        FormatError : the data cannot be decoded within those bounds
        """
        job["memory"] = BASE_MEMORY + MEMORY_PER_ELEMENT * elements
        worker = self._worker or self._start()
        watch = threading.Timer(BASE_SECONDS + SECONDS_PER_ELEMENT * elements, worker.kill)
        watch.name = "deltalux-decoder"
        threads.start(watch)
        try:
            return self._ask(worker, json.dumps(job).encode(), bytes(data), job["memory"])
        except (OSError, ValueError) as error:
            self._stop()
            found = f"compressed data that cannot be decoded ({error})"
            raise malformed(place, found, "data that its decoder reads") from None
        finally:
            watch.cancel()

    def _start(self) -> subprocess.Popen[bytes]:
        # Otherwise the worker's numerical libraries would reserve memory for idle threads.
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "OPENBLAS_NUM_THREADS": "1"}
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        pipes["stderr"] = subprocess.DEVNULL
        try:
            self._worker = subprocess.Popen([sys.executable, str(WORKER)], env=environment, **pipes)
        except OSError as error:
            raise FormatError(f"compressed geometry: its decoder cannot be started ({error})") from None
        return self._worker

    def _ask(self, worker: subprocess.Popen[bytes], job: bytes, data: bytes, most: int) -> list[np.ndarray]:
        assert worker.stdin is not None
        for part in (job, data):
            worker.stdin.write(LENGTH.pack(len(part)) + part)
        worker.stdin.flush()
        answer = json.loads(_read(worker, most))
        if "error" in answer:
            raise ValueError(answer["error"])
        return [_array(_read(worker, most), *described) for described in answer["arrays"]]

    def _stop(self) -> None:
        worker, self._worker = self._worker, None
        if worker is None:
            return
        worker.kill()
        for stream in (worker.stdin, worker.stdout):
            if stream is not None:
                try:
                    stream.close()
                except OSError:  # data not yet sent to a worker that has ended
                    continue
        worker.wait()


def _read(worker: subprocess.Popen[bytes], most: int) -> bytes:
    """One message of at most `most` bytes."""
    assert worker.stdout is not None
    head = worker.stdout.read(LENGTH.size)
    size = LENGTH.unpack(head)[0] if len(head) == LENGTH.size else 0
    if size > most:
        raise ValueError(f"{size} bytes, more than are declared")
    data = worker.stdout.read(size)
    if len(data) < size or len(head) < LENGTH.size:
        raise ValueError(f"the decoder ended, with code {worker.wait()}")
    return data


def _array(data: bytes, dtype: str, shape: list[int]) -> np.ndarray:
    if dtype not in DTYPES:
        raise ValueError(f"values of type {dtype}")
    return np.frombuffer(data, dtype).reshape(shape)
