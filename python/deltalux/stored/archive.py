# SPDX-License-Identifier: Apache-2.0
"""Named arrays and a JSON index in one zip, written and read in pieces; every size is checked.

A file may come from an untrusted source. What it holds once decompressed is checked before anything is
read: it may be at most `MOST_GAIN` times the file, and must fit into memory. Files of earlier builds are
not compressed.
"""

from __future__ import annotations

import io
import json
import math
import stat
import tokenize
import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from deltalux.errors import FormatError, OptionError
from deltalux.memory import available_memory

INDEX = "deltalux.json"
PIECE = 1 << 20  # bytes written or read at a time
MOST_INDEX = 64 << 20  # bytes; of 100,000 meshes it is half
_MOST_ENTRIES = 4096
_MOST_DIRECTORY = PIECE  # bytes of the zip's list of its entries
_SUFFIX = ".npy"
LEVEL = 1  # of zlib: a third of the size; higher ones take several times as long for a few per cent
MOST_GAIN = 100  # of a file; sessions come to 3, DEFLATE itself to 1,032
ROOM = 16 << 20  # bytes that a file may hold in any case


class ArchiveWriter:
    """Writes one archive to `file`, which must be seekable."""

    def __init__(self, file: BinaryIO) -> None:
        self._zip = zipfile.ZipFile(file, "w")

    def __enter__(self) -> ArchiveWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._zip.close()
        else:
            self._zip.fp = None  # otherwise the zip's destructor would write its directory

    def add_index(self, index: dict[str, Any]) -> None:
        """Write the index: everything that is not an array.

        Raises
        ------
        OptionError
            If the index is larger than a reader accepts, or a number is not finite.
        """
        try:
            text = json.dumps(index, allow_nan=False).encode()
        except ValueError:
            raise OptionError(
                "save: a camera, a node or a mesh's smooth_angle holds a number that is not finite, "
                "expected finite ones"
            ) from None
        if len(text) > MOST_INDEX:
            raise OptionError(
                f"save: the scene's names and nodes take {len(text) >> 20} MiB, expected at most "
                f"{MOST_INDEX >> 20}; use fewer meshes and nodes"
            )
        self._zip.writestr(_entry(INDEX), text, compresslevel=LEVEL)

    def add_array(self, name: str, dtype: str, pieces: Sequence[np.ndarray], columns: int = 0) -> None:
        """Write the rows of all `pieces` as one array of `columns` columns; 0: one-dimensional."""
        rows = sum(map(len, pieces))
        self.add_bytes(
            name,
            dtype,
            (rows, columns) if columns else (rows,),
            (_bytes_of(np.ascontiguousarray(piece, dtype)) for piece in pieces if piece.size),
        )

    def add_bytes(
        self, name: str, dtype: str, shape: tuple[int, ...], pieces: Iterable[bytes | memoryview]
    ) -> None:
        """Write an array whose bytes come in pieces."""
        header = {"descr": np.dtype(dtype).str, "fortran_order": False, "shape": shape}
        with self._zip.open(_entry(name + _SUFFIX), "w", force_zip64=True) as file:
            np.lib.format.write_array_header_1_0(file, header)
            for piece in pieces:
                for begin in range(0, len(piece), PIECE):
                    file.write(piece[begin : begin + PIECE])


class ArchiveReader:
    """Reads an archive; each array once, from its beginning.

    Raises
    ------
    FormatError
        If `ArchiveWriter` cannot have written the file; all methods raise this, too. Damage inside an entry
        raises zipfile.BadZipFile, OSError, EOFError or ValueError.
    """

    def __init__(self, path: Path) -> None:
        self._file = _Directory(path)
        try:
            self._zip = zipfile.ZipFile(self._file)
            self._entries = self._checked_entries(path.stat().st_size)
            self._arrays: dict[str, _Array] = {}
            self.index = self._read_index()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> ArchiveReader:
        return self

    def __exit__(self, *_: object) -> None:
        self._zip.close()
        self._file.close()

    def _checked_entries(self, file_size: int) -> dict[str, zipfile.ZipInfo]:
        entries: dict[str, zipfile.ZipInfo] = {}
        total = 0
        for info in self._zip.infolist():
            total += info.file_size
            stored = info.compress_type == zipfile.ZIP_STORED
            if not (stored or info.compress_type == zipfile.ZIP_DEFLATED) or info.flag_bits & 1:
                raise FormatError(f'"{info.filename}" is encrypted or compressed otherwise than by DEFLATE')
            if info.filename in entries:
                raise FormatError(f'found "{info.filename}" twice, expected it once')
            if info.compress_size > file_size or (stored and info.file_size != info.compress_size):
                raise FormatError(f'"{info.filename}" is longer than the file')
            entries[info.filename] = info
        if total > MOST_GAIN * file_size + ROOM or 0 < available_memory() < total:
            raise FormatError(
                f"found {total:,} bytes once decompressed, expected at most {MOST_GAIN} times the file's "
                f"{file_size:,}, and what fits into memory"
            )
        if len(entries) > _MOST_ENTRIES:
            raise FormatError(f"found {len(entries)} entries, expected at most {_MOST_ENTRIES}")
        return entries

    def _read_index(self) -> Any:
        info = self._entries.get(INDEX)
        if info is None or info.file_size > MOST_INDEX:
            raise FormatError(f'found no "{INDEX}" of at most {MOST_INDEX >> 20} MiB')
        with self._zip.open(info) as file:
            text = b"".join(iter(lambda: file.read(PIECE), b""))
        try:
            return json.loads(text, parse_constant=_refuse_constant)
        except RecursionError:
            raise FormatError(f'"{INDEX}" is nested too deeply') from None

    @property
    def names(self) -> list[str]:
        """Names of all arrays, read or not."""
        return [name.removesuffix(_SUFFIX) for name in self._entries if name.endswith(_SUFFIX)]

    @property
    def sizes(self) -> dict[str, int]:
        """Bytes of all entries in the file by name, the index among them."""
        return {name.removesuffix(_SUFFIX): info.compress_size for name, info in self._entries.items()}

    def array(self, name: str, dtype: str, rows: int | None = None, columns: int = 0) -> np.ndarray:
        """The whole array (rows, columns), or (rows,) if `columns` is 0; `rows` None: any number."""
        array = self._open(name)
        count = array.shape[0] if rows is None and array.shape else rows
        expected = (count, columns) if columns else (count,)
        if array.dtype != np.dtype(dtype) or array.shape != expected:
            raise FormatError(
                f'"{name}": found {array.dtype} of shape {array.shape}, expected {dtype} of {expected}'
            )
        return array.rows(expected[0] or 0)

    def rows(self, name: str, dtype: str, count: int, columns: int = 0) -> np.ndarray:
        """The next `count` rows of an array that is read in pieces."""
        array = self._open(name)
        width = (columns,) if columns else ()
        if array.dtype != np.dtype(dtype) or array.shape[1:] != width or len(array.shape) != 1 + len(width):
            raise FormatError(f'"{name}": found {array.dtype} of shape {array.shape}, expected {dtype}')
        return array.rows(count)

    def bytes(self, name: str) -> int | None:
        """Length of an array of bytes; None if there is no array of that name."""
        if name + _SUFFIX not in self._entries:
            return None
        array = self._open(name)
        if array.dtype != np.uint8 or len(array.shape) != 1:
            raise FormatError(f'"{name}": found {array.dtype} of shape {array.shape}, expected bytes')
        return array.shape[0]

    def read_into(self, name: str, buffer: memoryview) -> None:
        """Fill `buffer` with the next bytes of an array."""
        self._open(name).read_into(buffer)

    def check_all_read(self) -> None:
        """Raise FormatError if an array was not read to its end, so that its checksum was not verified."""
        for name in self.names:
            if name not in self._arrays or self._arrays[name].left:
                raise FormatError(f'found the array "{name}" or a part of it that nothing asks for')

    def _open(self, name: str) -> _Array:
        if name not in self._arrays:
            info = self._entries.get(name + _SUFFIX)
            if info is None:
                raise FormatError(f'"{name}" is missing')
            self._arrays[name] = _Array(name, self._zip, info)
        return self._arrays[name]


class _Array:
    """One array of the archive; its header is consistent with the entry's length."""

    def __init__(self, name: str, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> None:
        self._name = name
        self._file = archive.open(info)
        try:
            if np.lib.format.read_magic(self._file) != (1, 0):
                raise FormatError(f'"{name}" is of another version')
            self.shape, fortran_order, self.dtype = np.lib.format.read_array_header_1_0(self._file)
        except (tokenize.TokenError, SyntaxError, RecursionError, MemoryError, TypeError) as error:
            raise FormatError(f'"{name}" has a damaged header ({error})') from None
        if fortran_order or self.dtype.kind not in "biuf" or min(self.shape, default=0) < 0:
            raise FormatError(f'"{name}" is no plain array of numbers')
        self.left = math.prod(self.shape) * self.dtype.itemsize
        if self._file.tell() + self.left != info.file_size:
            raise FormatError(f'"{name}" is longer or shorter than its header says')

    def rows(self, count: int) -> np.ndarray:
        if count < 0 or count * math.prod(self.shape[1:]) * self.dtype.itemsize > self.left:
            raise FormatError(f'"{self._name}" has fewer rows than the index says')
        out = np.zeros((count, *self.shape[1:]), self.dtype)
        if out.size:
            self.read_into(_bytes_of(out))
        return out

    def read_into(self, buffer: memoryview) -> None:
        if len(buffer) > self.left:
            raise FormatError(f'"{self._name}" ends too soon')
        self.left -= len(buffer)
        for begin in range(0, len(buffer), PIECE):
            piece = buffer[begin : begin + PIECE]
            data = self._file.read(len(piece))  # reading the last byte verifies the checksum
            if len(data) != len(piece):
                raise EOFError(f'"{self._name}" ends too soon')
            piece[:] = data


class _Directory(io.FileIO):
    """The file; refuses to read a zip directory that is unreasonably large."""

    def __init__(self, path: Path) -> None:
        kind = path.stat().st_mode
        # a device or a pipe may block, or never end
        if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
            raise FormatError("found a device or a pipe, expected a regular file")
        super().__init__(path)

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > _MOST_DIRECTORY:
            raise FormatError(f"found a list of entries of {size} bytes, expected at most {_MOST_DIRECTORY}")
        return super().read(-1 if size is None else size)


def _entry(name: str) -> zipfile.ZipInfo:
    """A compressed entry without a date, so that equal sessions make equal files."""
    entry = zipfile.ZipInfo(name)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry._compresslevel = LEVEL  # type: ignore[attr-defined]  # public from Python 3.13 on, as compress_level
    return entry


def _bytes_of(array: np.ndarray) -> memoryview:
    """The bytes of a contiguous array that is not empty."""
    return array.reshape(-1).view(np.uint8).data


def _refuse_constant(text: str) -> None:
    raise FormatError(f"{INDEX}: found {text}, expected finite numbers")
