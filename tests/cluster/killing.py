# SPDX-License-Identifier: Apache-2.0
"""Kills workers at random instants of bakes and updates; also run by benchmarks/cluster_kills.py."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import deltalux as dl
import numpy as np
from rooms import room, samples_in, translation

OPTIONS: dict[str, Any] = {"paths": 60_000, "gather": 16, "max_bounces": 16}


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


def pid_of_holder(dask_worker: Any) -> int | None:
    """The process of a worker that holds shards."""
    return os.getpid() if dask_worker.state.actors else None


def kills(client: Any, count: int, seed: int, shards: int = 4) -> Iterator[Outcome]:
    """Kill a worker in each of `count` calls, in turn in a bake and in two updates."""
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
            _wait_for_two(client)
            after = float(rng.uniform(0, 1.2 * usual[call]))
            victims = [pid for pid in client.run(pid_of_holder).values() if pid]
            victim = victims[int(rng.integers(len(victims)))]
            timer = threading.Timer(after, os.kill, (victim, signal.SIGKILL))
            before, begin = len(many.notes), time.monotonic()
            timer.start()
            getattr(many, call)()
            seconds = time.monotonic() - begin
            timer.join()
            getattr(one, call)()
            right = many.digest() == one.digest() and bool((many.irradiance == one.irradiance).all())
            yield Outcome(call, after, seconds, right, len(many.notes) - before)


def _wait_for_two(client: Any) -> None:
    """Wait for Dask to start a worker in place of the one that was killed, or start another."""
    try:
        client.wait_for_workers(2, timeout=20)
    except TimeoutError:
        client.cluster.scale(len(client.cluster.workers) + 1)
        client.wait_for_workers(2, timeout=60)


def _edit(rng: np.random.Generator, *sessions: dl.Session) -> None:
    x, y, z = rng.uniform((-1.5, 0.45, -1.0), (1.5, 1.5, 1.0))
    name = ("block", "lamp")[int(rng.integers(2))]
    factor = float(rng.uniform(0, 1))
    for session in sessions:
        session.move(name, translation(x, y, z))
        session.dim("desk", factor)
