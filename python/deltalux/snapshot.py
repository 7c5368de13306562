# SPDX-License-Identifier: Apache-2.0
"""Session files of the state as it is: paths that wait are saved as such, where `Session.save` ends them."""

from __future__ import annotations

from pathlib import Path

from deltalux.errors import OptionError

from .session import Session


def write(path: str | Path, session: Session, command: str = "snapshot.write") -> None:
    """Write `session` to `path`, under a temporary name first.

    Opened again, it goes on with the paths that waited.

    Parameters
    ----------
    path : of the file (.dlx)
    session : Session
    command : what made the file, for those who read it

    Raises
    ------
    OptionError
        If edits are queued, which no file holds: apply them with `Session.update`, within whatever budget.
    OSError
    Cancelled
        If the session's callback asks to stop; a file at `path` is as it was before.
    """
    with session._calls.one(long=True):
        if len(session._edits):
            raise OptionError(
                f"save: found {len(session._edits)} queued edits, expected none; call update() first"
            )
        session._write(Path(path), command)
