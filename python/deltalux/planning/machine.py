# SPDX-License-Identifier: Apache-2.0
"""Costs of tests on this machine: calibrated once, then kept in a file in the user's cache."""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
from functools import cache
from pathlib import Path
from typing import Any

from deltalux import _core
from deltalux.files import written_aside
from deltalux.segments import Progress

FORMAT = "deltalux-machine"
VERSION = 4  # version of the file; increases when the constants change their meaning

Machine = dict[str, list[list[float]]]
_known: dict[str, Machine] = {}


def machine_constants(progress: Progress | None = None) -> Machine:
    """Constants of this processor and build, calibrated if no file holds them.

    The file is `deltalux/machine.json` in the user's cache folder (XDG_CACHE_HOME, else ~/.cache). It
    is renewed when the processor or the build changes; if it cannot be written, every process
    calibrates again, which takes just under a second of one processor.

    Returns
    -------
    dict
        By method; a row for each array size: the size, seconds per disc to build, seconds per count in
        the order of `_core.count_names()`.

    Raises
    ------
    Cancelled
    """
    key = f"{processor()}; {core_build()}"
    if key not in _known:
        path = _cache_file()
        found = _read(path, key)
        if found is None:
            found = _core.calibrate(progress)
            _write(path, key, found)
        _known[key] = found
    return _known[key]


def is_calibrated() -> bool:
    """Whether `machine_constants` will find its file, and so take no time."""
    key = f"{processor()}; {core_build()}"
    return key in _known or _read(_cache_file(), key) is not None


@cache
def core_build() -> str:
    """Digest of the compiled core."""
    return hashlib.sha256(Path(_core.__file__).read_bytes()).hexdigest()


def processor() -> str:
    """Name of the processor, from the system."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _cache_file() -> Path | None:
    folder = os.environ.get("XDG_CACHE_HOME", "")
    try:
        root = Path(folder) if folder else Path.home() / ".cache"
    except RuntimeError:  # there is no home folder
        return None
    return root / "deltalux" / "machine.json"


def _read(path: Path | None, key: str) -> Machine | None:
    """The constants in the file for `key`, or None."""
    if path is None:
        return None
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(data, dict) or (data.get("format"), data.get("version")) != (FORMAT, VERSION):
        return None
    machine = data.get("machine")
    return machine if data.get("key") == key and _is_machine(machine) else None


def _is_machine(machine: Any) -> bool:
    width = 2 + len(_core.count_names())
    return isinstance(machine, dict) and all(
        isinstance(rows, list)
        and rows
        and all(isinstance(row, list) and len(row) == width and all(map(_is_time, row)) for row in rows)
        for rows in (machine.get(name) for name in _core.typical_machine())
    )


def _is_time(value: Any) -> bool:
    return isinstance(value, (int, float)) and math.isfinite(value) and value >= 0


def _write(path: Path | None, key: str, machine: Machine) -> None:
    if path is None:
        return
    data = {"format": FORMAT, "version": VERSION, "key": key, "machine": machine}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with written_aside(path) as file:
            file.write(json.dumps(data, indent=1).encode())
    except OSError:
        pass  # without the file, the next process calibrates again
