# SPDX-License-Identifier: Apache-2.0
"""Two worker processes of one thread each, for all tests of a file; one test with workers at a time."""

from __future__ import annotations

import fcntl
import gc
from collections.abc import Iterator

import pytest

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def client():
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture(autouse=True)
def one_at_a_time(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Workers take all processors, and Dask gives its threads ten seconds to start."""
    with (tmp_path_factory.getbasetemp().parent / "workers.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
        # A client that could not connect closes itself when it is collected. If that happens in a thread in
        # which Dask starts a loop, it waits for a lock that is held until the loop has started.
        gc.collect()
