# SPDX-License-Identifier: Apache-2.0
"""Shared by view and serve: where the server listens, and where it may write."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from deltalux.server import is_loopback

from .console import Terminal

HostOption = Annotated[
    str,
    typer.Option(
        "--host",
        metavar="ADDRESS",
        help="Address to listen on. The default is for this machine only; with any other address, whoever "
        "reaches it and knows the token can edit the session.",
    ),
]
PortOption = Annotated[
    int, typer.Option("--port", min=0, max=65535, metavar="N", help="Port to listen on; 0 = any free one.")
]
FolderOption = Annotated[
    Path,
    typer.Option(
        "--folder",
        metavar="DIR",
        help="Folder for the page's exports and saved sessions: never elsewhere, nor over files of others.",
    ),
]


def warn_of_others(terminal: Terminal, host: str) -> None:
    """Warn if other machines can reach the server."""
    if not is_loopback(host):
        terminal.warn(
            [f"{host} can be reached from other machines; whoever knows the address can edit the session"]
        )
