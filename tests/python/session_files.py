# SPDX-License-Identifier: Apache-2.0
"""Session files taken apart and put together again with other contents and right checksums."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
import pytest

INDEX = "deltalux.json"


def read_parts(path: Path) -> tuple[dict, dict[str, np.ndarray]]:
    """The index and all arrays of a session file."""
    with zipfile.ZipFile(path) as archive:
        index = json.loads(archive.read(INDEX))
        arrays = {
            name.removesuffix(".npy"): np.load(io.BytesIO(archive.read(name)))
            for name in archive.namelist()
            if name.endswith(".npy")
        }
    return index, arrays


def write_parts(path: Path, index: dict, arrays: dict[str, np.ndarray]) -> None:
    """A session file of them; zipfile makes the checksums."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(INDEX, json.dumps(index))
        for name, array in arrays.items():
            data = io.BytesIO()
            np.save(data, array)
            archive.writestr(f"{name}.npy", data.getvalue())


def rewrite(path: Path, index=lambda index: None, arrays=lambda arrays: None) -> None:
    """Change a file's index or arrays in place."""
    parts = read_parts(path)
    index(parts[0])
    arrays(parts[1])
    write_parts(path, *parts)


def number(name: str, index: int, value: float, kind: str = "<f4") -> Callable[[dict], None]:
    """A change of one number of a core array, for `rewrite`."""

    def change(arrays: dict[str, np.ndarray]) -> None:
        values = arrays[f"core/{name}"].reshape(-1).view(np.uint8).copy().view(kind)
        assert len(values)
        values[index] = value
        arrays[f"core/{name}"] = values.view(np.uint8)

    return change


def assert_refused(session: dl.Session, file: Path, change: Callable[[dict], None], said: str) -> None:
    """The session's file, changed so, is no session."""
    session.save(file)
    rewrite(file, arrays=change)
    with pytest.raises(dl.FormatError, match=said):
        dl.Session.open(file)


def assert_threads_and_files_make_no_difference(
    session: dl.Session, file: Path, edit: Callable[[dl.Session], None], **options: Any
) -> None:
    """A session of one thread and one from the file have the baked one's bits, also after an edit."""
    session.save(file)
    with (
        dl.Session(session.scene, session.samples, threads=1, **options) as one,
        dl.Session.open(file) as opened,
    ):
        one.bake()
        assert one.digest() == session.digest() == opened.digest()
        edit(one), edit(opened)
        assert one.digest() == opened.digest()
        np.testing.assert_array_equal(one.irradiance, opened.irradiance)
        opened.recompute()
        assert opened.digest() == one.digest()
