# SPDX-License-Identifier: Apache-2.0
"""Workers of this machine that nobody else reaches: loopback only, with a secret, without web pages."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from distributed import LocalCluster

LOOPBACK = "127.0.0.1"
# Of Dask's processes: they tell whoever asks what runs where, and some of them do more.
_NO_PAGES: dict[str, list[str]] = {
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}


def local_workers(count: int, threads: int) -> LocalCluster:
    """Processes of this machine that end with the cluster, which is a context manager.

    Whoever reaches a Dask scheduler, a worker or its nanny can run any program there. So all of them listen
    on the loopback interface only; and because other users of the machine are there, too, to talk to them
    takes the key of a certificate that is made here and kept in memory.

    Parameters
    ----------
    count : number of workers
    threads : of each worker
    """
    import dask
    from distributed import LocalCluster, Security

    with dask.config.set(_NO_PAGES):
        return LocalCluster(
            n_workers=count,
            threads_per_worker=threads,
            host=LOOPBACK,
            protocol="tls",
            security=Security.temporary(),
            dashboard_address=f"{LOOPBACK}:0",  # of a server without pages, which Dask starts anyway
            scheduler_kwargs={"dashboard": False},
            silence_logs=logging.CRITICAL,
        )
