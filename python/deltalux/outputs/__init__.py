# SPDX-License-Identifier: Apache-2.0
"""Writers of results to files."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from deltalux.errors import OptionError

from .baked import Baked, Result
from .images import Picture, difference, render, side_by_side
from .plans import grid_picture, plan_axes
from .png import write_png
from .tables import Table, read, write_csv, write_npz
from .vertex_colors import write_glb

__all__ = [
    "WRITERS",
    "Baked",
    "Picture",
    "Result",
    "Table",
    "difference",
    "grid_picture",
    "plan_axes",
    "read",
    "render",
    "side_by_side",
    "write",
    "writer_for",
]

Writer = Callable[[str | os.PathLike[str], Baked], None]

# Writers by suffix. Session files (.dlx) are written by Session.save.
WRITERS: dict[str, Writer] = {
    ".csv": write_csv,
    ".glb": write_glb,
    ".npz": write_npz,
    ".png": write_png,
}


def writer_for(path: str | os.PathLike[str]) -> Writer:
    """The writer for a file's suffix.

    Raises
    ------
    OptionError
        If there is none. Call this before the work, to check output paths early.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        known = ", ".join(sorted(WRITERS))
        raise OptionError(f'output "{os.fspath(path)}": found suffix "{suffix}", expected one of {known}')
    return WRITERS[suffix]


def write(path: str | os.PathLike[str], baked: Baked) -> None:
    """Write `baked` in the format of the suffix: .npz, .csv, .glb or .png.

    Raises
    ------
    OptionError
        If the suffix is unknown, the folder does not exist, or the samples do not fit the format.
    """
    writer = writer_for(path)
    folder = Path(path).parent
    if not folder.is_dir():
        raise OptionError(f'output "{os.fspath(path)}": found no folder "{folder}", expected an existing one')
    writer(path, baked)
