# SPDX-License-Identifier: Apache-2.0
"""Result files of a command: which suffix means what, checked before any work is done."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import typer

KINDS = {
    ".glb": "lit mesh",
    ".png": "picture",
    ".csv": "table",
    ".npz": "arrays",
    ".dlx": "session",
}


def check_targets(outputs: Sequence[Path] | None, more: Sequence[Path] | None) -> list[Path]:
    """Return the result files, certain to be of a known kind and in a writable place.

    Parameters
    ----------
    outputs : values of -o
    more : words that followed the last value of -o

    Raises
    ------
    BadParameter : unknown suffix, a file named twice, or words that follow no -o
    OSError : the folder is absent or cannot be written to
    """
    if more and not outputs:
        raise typer.BadParameter(f"found the extra word '{more[0]}'; result files follow -o")
    targets = [*(outputs or ()), *(more or ())]
    for path in targets:
        if path.suffix.lower() not in KINDS:
            known = ", ".join(f"{suffix} ({kind})" for suffix, kind in KINDS.items())
            raise typer.BadParameter(
                f"output '{path}': found suffix '{path.suffix}', expected one of {known}"
            )
        if targets.count(path) > 1:
            raise typer.BadParameter(f"output '{path}': named twice")
    for path in targets:
        _check_writable(path)
    return targets


def _check_writable(path: Path) -> None:
    folder = path.parent
    if not folder.is_dir():
        raise FileNotFoundError(0, "found no such folder; make it first, or choose another", str(folder))
    if path.is_dir():
        raise IsADirectoryError(0, "found a folder, expected the name of a file", str(path))
    if not os.access(folder, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise PermissionError(0, "found a place that cannot be written to; choose another", str(path))
