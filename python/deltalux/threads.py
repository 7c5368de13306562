# SPDX-License-Identifier: Apache-2.0
"""Starts threads, or tells as an error of this package that there is no room for another one."""

from __future__ import annotations

import threading

from .errors import Error


def start(thread: threading.Thread) -> None:
    """Start a thread.

    Raises
    ------
    Error
        If memory or the system's limits do not suffice for another one.
    """
    try:
        thread.start()
    except RuntimeError as error:
        raise Error(
            f"thread: found no room for another one ({error}), expected one for {thread.name}; free some "
            "memory, or raise the limits of memory and of processes (ulimit -v, ulimit -u)"
        ) from None
