# SPDX-License-Identifier: Apache-2.0
"""`deltalux serve`: serves a session to programs, which edit it and read its light."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import deltalux as dl
from deltalux.cli.console import Terminal
from deltalux.cli.inputs import foreign_light
from deltalux.cli.options import JsonOption, QuietOption, SessionArgument, ThreadsOption
from deltalux.cli.serving import FolderOption, HostOption, PortOption, warn_of_others


def run(
    session: SessionArgument,
    threads: ThreadsOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = 0,
    folder: FolderOption = Path(),
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Keep a session open for scripts and plug-ins: they edit it and read its light, to the last bit.

    The session is opened once; then each edit takes only the time of its light. Programs send JSON
    over a WebSocket; Python has a client for that. The session's file is never written to: save
    under another name. Ctrl-C or SIGTERM ends the server.

    [bold]Examples[/]

    A session, at an address that --json prints as one line:
    deltalux serve office.dlx --port 8000 --json

    From Python, at that address:
    import deltalux as dl
    with dl.connect("http://127.0.0.1:8000/?token=…") as office:
        office.dim("desk lamp", 0.5)
        office.update()
        print(office.irradiance.mean())
    """
    terminal = Terminal(as_json, quiet)
    with terminal.progress() as progress:
        opened = dl.Session.open(session, threads=threads, progress=progress)
    terminal.warn(foreign_light(opened, str(session)))
    with opened, _ended_by_sigterm():
        served = dl.serve(opened, host=host, port=port, folder=folder)
        warn_of_others(terminal, host)
        data = {"session": str(session), "folder": str(folder.resolve()), "pid": os.getpid(), **served.places}
        terminal.record(data)
        terminal.say(f"{session} is served at {served.url}\nCtrl-C ends it")
        served.wait()


@contextmanager
def _ended_by_sigterm() -> Iterator[None]:
    """Let SIGTERM, which ends services, act like Ctrl-C."""

    def interrupt(*_: Any) -> NoReturn:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
