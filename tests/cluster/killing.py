# SPDX-License-Identifier: Apache-2.0
"""Kills workers at random instants of bakes and updates; also run by benchmarks/cluster_kills.py."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import dask
import deltalux as dl
import distributed
import numpy as np
from distributed import Client, LocalCluster
from rooms import room, samples_in, translation

OPTIONS: dict[str, Any] = {"paths": 20_000, "gather": 16, "max_bounces": 16}
WORKERS = 2
CALL_SECONDS = 60.0  # time-out of a call: then its progress callback cancels it
LOADED = ["distributed", "deltalux.cluster"]  # by the process that workers are forked from


@dataclass(frozen=True)
class Outcome:
    """What became of one call during which a worker was killed.

    Parameters
    ----------
    call : "bake" or "update"
    after : seconds from the call's beginning to the kill
    seconds : that the call took
    right : whether the digest was that of one process
    lost : how many shards were lost
    """

    call: str
    after: float
    seconds: float
    right: bool
    lost: int


@contextmanager
def quick_workers() -> Iterator[Client]:
    """Workers of one thread that Dask's nannies start anew in a fraction of a second."""
    with dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}):
        distributed.utils.get_mp_context()  # chooses what is loaded, once
        multiprocessing.get_context("forkserver").set_forkserver_preload(LOADED)
        with (
            LocalCluster(
                n_workers=WORKERS, threads_per_worker=1, dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            ) as cluster,
            Client(cluster) as client,
        ):  # fmt: skip
            yield client


def pid_of_holder(dask_worker: Any) -> int | None:
    """The process of a worker that holds shards."""
    return os.getpid() if dask_worker.state.actors else None


def kills(client: Any, count: int, seed: int, shards: int = 4) -> Iterator[Outcome]:
    """Kill a worker in each of `count` calls, in turn in a bake and in two updates.

    Raises
    ------
    Cancelled
        Where a call takes longer than CALL_SECONDS.
    """
    rng = np.random.default_rng(seed)
    scene = room()
    samples = samples_in(scene)
    with (
        dl.Session(scene, samples, **OPTIONS) as one,
        dl.ClusterSession(scene, samples, client=client, shards=shards, **OPTIONS) as many,
    ):
        one.bake()
        many.bake()  # so that workers have loaded everything
        usual = {}
        for call in ("bake", "update"):
            _edit(rng, one, many)
            begin = time.monotonic()
            getattr(many, call)()
            usual[call] = time.monotonic() - begin
            getattr(one, call)()
        for number in range(count):
            call = "bake" if number % 3 == 0 else "update"
            _edit(rng, one, many)
            wait_for_all(client)
            after = float(rng.uniform(0, 1.2 * usual[call]))
            victims = [pid for pid in client.run(pid_of_holder).values() if pid]
            victim = victims[int(rng.integers(len(victims)))]
            timer = threading.Timer(after, os.kill, (victim, signal.SIGKILL))
            before, begin = len(many.notes), time.monotonic()
            many.progress = _in_time(begin)
            timer.start()
            getattr(many, call)()
            seconds = time.monotonic() - begin
            timer.join()
            many.progress = None
            getattr(one, call)()
            right = many.digest() == one.digest() and bool((many.irradiance == one.irradiance).all())
            yield Outcome(call, after, seconds, right, len(many.notes) - before)


def _in_time(begin: float) -> Any:
    return lambda stage, fraction: time.monotonic() - begin < CALL_SECONDS


def wait_for_all(client: Any) -> None:
    """Wait for Dask to start a worker in place of the one that was killed, or start another."""
    try:
        client.wait_for_workers(WORKERS, timeout=20)
    except TimeoutError:
        client.cluster.scale(len(client.cluster.workers) + 1)
        client.wait_for_workers(WORKERS, timeout=60)


def _edit(rng: np.random.Generator, *sessions: dl.Session) -> None:
    x, y, z = rng.uniform((-1.5, 0.45, -1.0), (1.5, 1.5, 1.0))
    name = ("block", "lamp")[int(rng.integers(2))]
    factor = float(rng.uniform(0, 1))
    for session in sessions:
        session.move(name, translation(x, y, z))
        session.dim("desk", factor)
