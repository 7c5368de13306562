# SPDX-License-Identifier: Apache-2.0
"""Where a command's session is: in this process, in several of this machine, or on a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Annotated, Any
from urllib.parse import urlsplit

import typer

import deltalux as dl
from deltalux.cluster.extra import CERTIFICATES, check_extra
from deltalux.cluster.local import local_workers
from deltalux.errors import Error
from deltalux.pace import Overall
from deltalux.server import is_loopback

from .console import Terminal
from .interrupts import put_off

CONNECT_SECONDS = 15
CERTIFIED = ("tls", "wss")  # need certificates
ENCRYPTED = (*CERTIFIED, "ucx")

WorkersOption = Annotated[
    int | None,
    typer.Option(
        "--workers",
        min=1,
        metavar="N",
        help="Share the work among N processes of this machine, which are started and ended by the command, "
        "and which nobody else can talk to. Never changes a result.",
        show_default=False,
    ),
]
ClusterOption = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="ADDRESS",
        help="Share the work among the workers of this Dask scheduler, such as tls://desk:8786. Never "
        "changes a result.",
        show_default=False,
    ),
]


@dataclass(frozen=True)
class Place:
    """Where sessions are made and opened.

    Parameters
    ----------
    client : distributed.Client; None: in this process
    workers : number of workers
    """

    client: Any = None
    workers: int = 0

    def make(self, scene: dl.Scene, samples: dl.Samples, **options: Any) -> dl.Session:
        """A session that is not baked yet."""
        if self.client is None:
            return dl.Session(scene, samples, **options)
        return dl.ClusterSession(scene, samples, client=self.client, **options)

    def open(self, path: Any, **options: Any) -> dl.Session:
        """A session of a file."""
        if self.client is None:
            return dl.Session.open(path, **options)
        return dl.ClusterSession.open(path, client=self.client, **options)


def is_shared(workers: int | None, cluster: str | None) -> bool:
    """Whether the options ask for more than this process; raises BadParameter for both of them."""
    if workers is not None and cluster is not None:
        raise typer.BadParameter("found --workers and --cluster, expected one of them")
    return workers is not None or cluster is not None


@contextmanager
def place_of(
    workers: int | None,
    cluster: str | None,
    threads: int | None,
    terminal: Terminal,
    progress: Overall | None = None,
) -> Iterator[Place]:
    """The place that the options ask for; workers that are started here end with it.

    Raises
    ------
    Error
        If the extra is not installed, or the cluster does not answer.
    """
    if not is_shared(workers, cluster):
        yield Place()
        return
    if cluster is None:
        check_extra("--workers", CERTIFICATES)
    else:
        check_extra("--cluster")
    if progress:
        progress.begin("start workers")
    with ExitStack() as stack:
        if workers is not None:
            with put_off():
                client = _start(workers, threads, stack)
        else:
            _check_wire(str(cluster), terminal)
            client = _connect(str(cluster), stack)
        yield Place(client, max(1, len(client.nthreads())))


def _start(workers: int, threads: int | None, stack: ExitStack) -> Any:
    """A client of workers that end with the stack."""
    from distributed import Client

    each = max(1, (threads or os.cpu_count() or 1) // workers)
    cluster = stack.enter_context(local_workers(workers, each))
    return stack.enter_context(Client(cluster, set_as_default=False))


def _connect(address: str, stack: ExitStack) -> Any:
    """A client of the scheduler at an address; raises Error if none answers."""
    from distributed import Client

    try:
        return stack.enter_context(Client(address, timeout=CONNECT_SECONDS, set_as_default=False))
    except (OSError, ValueError, RuntimeError) as problem:
        raise Error(
            f"--cluster {address}: no Dask scheduler answers there ({problem}), expected one; start "
            "it with dask scheduler, and check address, firewall and certificates"
        ) from None


def notes_of(session: dl.Session) -> list[str]:
    """What happened to the workers of a session."""
    return session.notes if isinstance(session, dl.ClusterSession) else []


def _check_wire(address: str, terminal: Terminal) -> None:
    """Warn of an open wire; raise Error if certificates are needed and not there."""
    parts = urlsplit(address if "://" in address else f"tcp://{address}")
    if parts.scheme in CERTIFIED:
        _check_certificates(address)
    elif parts.scheme not in ENCRYPTED and not is_loopback(parts.hostname or ""):
        terminal.warn(
            [
                f"--cluster {address}: the wire is not encrypted, and whoever reaches the scheduler can run "
                "any program on its workers; use tls:// (docs/how-to/bake-on-a-cluster.md)"
            ]
        )


def _check_certificates(address: str) -> None:
    from distributed import Security

    try:
        found = Security().get_connection_args("client")["ssl_context"]
        problem = "found no certificates" if found is None else None
    except (OSError, ValueError) as flaw:
        problem = f"found certificates that cannot be read ({flaw})"
    if problem:
        raise Error(
            f"--cluster {address}: {problem}, expected ca-file, cert and key of distributed.comm.tls in "
            "Dask's configuration, ~/.config/dask/*.yaml (docs/how-to/bake-on-a-cluster.md)"
        )
