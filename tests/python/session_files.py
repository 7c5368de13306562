# SPDX-License-Identifier: Apache-2.0
"""Session files taken apart and put together again with other contents and right checksums."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np

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
