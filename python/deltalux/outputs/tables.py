# SPDX-License-Identifier: Apache-2.0
"""Results as tables: .npz (complete and exact) and .csv (for spreadsheets), and their reader."""

from __future__ import annotations

import io
import json
import os
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from deltalux.errors import FormatError
from deltalux.files import written_aside
from deltalux.units import UNITS, photopic

from .baked import Baked, about_text, keep_inputs

COLUMNS = ("x", "y", "z", "nx", "ny", "nz", "E_r", "E_g", "E_b", "E", "se_r", "se_g", "se_b", "radius")
ARRAYS = ("points", "normals", "irradiance", "standard_error", "radius")


@dataclass(frozen=True, eq=False)
class Table:
    """A result read from a file; it has the fields of a `Result`."""

    points: np.ndarray
    normals: np.ndarray
    irradiance: np.ndarray
    standard_error: np.ndarray
    radius: np.ndarray
    unit: str
    about: Mapping[str, Any]
    gradient: np.ndarray | None = None


def write_npz(path: str | os.PathLike[str], baked: Baked) -> None:
    """Write the arrays of the result, `unit`, `about` (JSON text), and the gradient if there is one."""
    keep_inputs(path, baked)
    arrays: dict[str, Any] = {name: np.asarray(getattr(baked.result, name)) for name in ARRAYS}
    if baked.gradient is not None:
        arrays["gradient"] = np.asarray(baked.gradient)
    about = json.dumps(about_text(baked.result))
    # in memory first: the destructor of an incompletely written zip would try to write again
    data = io.BytesIO()
    np.savez_compressed(data, **arrays, unit=np.array(baked.result.unit), about=np.array(about))
    with written_aside(path) as file:
        file.write(data.getbuffer())


def write_csv(path: str | os.PathLike[str], baked: Baked) -> None:
    """Write header lines `# key: value`, then one line per sample; E is the photopic value."""
    keep_inputs(path, baked)
    result = baked.result
    rows = np.column_stack(
        [
            result.points,
            result.normals,
            result.irradiance,
            photopic(result.irradiance),
            result.standard_error,
            result.radius,
        ]
    )
    header = [f"# {key}: {json.dumps(value)}" for key, value in about_text(result).items()]
    header.append(",".join(COLUMNS))
    with written_aside(path) as file:
        np.savetxt(
            file, rows, fmt="%.9g", delimiter=",", header="\n".join(header), comments="", encoding="utf-8"
        )


def read(path: str | os.PathLike[str]) -> Table:
    """Read a .npz or .csv that Deltalux wrote.

    Raises
    ------
    FormatError
        If the file does not exist, is truncated or foreign.
    """
    file = Path(path)
    reader = {".npz": _read_npz, ".csv": _read_csv}.get(file.suffix.lower())
    if reader is None:
        raise FormatError(f'table "{file}": found suffix "{file.suffix}", expected .npz or .csv')
    try:
        return reader(file)
    except FileNotFoundError:
        raise FormatError(f'table "{file}": found no such file, expected a .npz or .csv') from None
    except (OSError, ValueError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        raise FormatError(
            f'table "{file}": found a truncated or foreign file ({error}), '
            "expected one written by deltalux bake or update; write it again"
        ) from None


def _read_npz(file: Path) -> Table:
    with np.load(file, allow_pickle=False) as data:
        arrays = {name: data[name] for name in ARRAYS}
        gradient = data.get("gradient")
        return _checked(arrays, json.loads(str(data["about"])), gradient)


def _read_csv(file: Path) -> Table:
    about: dict[str, Any] = {}
    with file.open(encoding="utf-8") as lines:
        for line in lines:
            if not line.startswith("#"):
                break
            key, _, value = line[1:].partition(":")
            about[key.strip()] = json.loads(value)
        else:
            raise ValueError("no table after the header")
        if tuple(line.strip().split(",")) != COLUMNS:
            raise ValueError(f"columns {line.strip():.80}")
        rows = np.loadtxt(lines, delimiter=",", ndmin=2).reshape(-1, len(COLUMNS))
    if len(rows) != about["samples"]:
        raise ValueError(f"{len(rows)} lines instead of {about['samples']}")
    columns = {"points": rows[:, 0:3], "normals": rows[:, 3:6], "irradiance": rows[:, 6:9]}
    return _checked({**columns, "standard_error": rows[:, 10:13], "radius": rows[:, 13]}, about, None)


def _checked(arrays: dict[str, np.ndarray], about: dict[str, Any], gradient: np.ndarray | None) -> Table:
    count = len(arrays["points"])
    for name, array in arrays.items():
        expected = (count,) if name == "radius" else (count, 3)
        if array.shape != expected:
            raise ValueError(f"{name} of shape {array.shape} instead of {expected}")
    if about.get("unit") not in UNITS:
        raise ValueError(f"unit {about.get('unit')!r}")
    return Table(**arrays, unit=about["unit"], about=about, gradient=gradient)
