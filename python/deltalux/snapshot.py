# SPDX-License-Identifier: Apache-2.0
"""Session files of the state as it is: paths that wait are saved as such, where `Session.save` ends them."""

from __future__ import annotations

from pathlib import Path

from .session import Session


def write(path: str | Path, session: Session, command: str = "snapshot.write") -> None:
    """Write `session` to `path`, under a temporary name first.

    Opened again, it goes on with the paths that waited. Queued edits must have been applied, with whatever
    budget (`Session.update`): what is only queued is in no file.

    Parameters
    ----------
    path : of the file (.dlx)
    session : Session
    command : what made the file, for those who read it

    Raises
    ------
    OSError
    Cancelled
        If the session's callback asks to stop; a file at `path` is as it was before.
    """
    session._write(Path(path), command)
