# SPDX-License-Identifier: Apache-2.0
"""Workers with other instruction sets give the same bits; those that reckon otherwise are refused at once."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import deltalux as dl
import pytest
from deltalux import _core
from deltalux.errors import Error
from distributed import Client, Nanny, Scheduler, SpecCluster, Worker
from rooms import room, samples_in, translation

from .test_cluster_session import PATHS, equal


@contextmanager
def workers_of(isas: list[str]) -> Iterator[Client]:
    """A worker of one thread for each instruction set of our own loops."""
    workers = {
        number: {"cls": Nanny, "options": {"nthreads": 1, "env": {"DELTALUX_ISA": isa}}}
        for number, isa in enumerate(isas)
    }
    scheduler = {"cls": Scheduler, "options": {"dashboard_address": ":0"}}
    with SpecCluster(workers=workers, scheduler=scheduler) as cluster, Client(cluster) as client:
        yield client


def isa_of_worker() -> str:
    return os.environ["DELTALUX_ISA"]


def shards_that_began(dask_worker: Worker) -> int:
    made = (actor for actor in dask_worker.state.actors.values() if actor is not None)
    return sum(actor._session is not None for actor in made)


@pytest.mark.slow
def test_each_instruction_set_gives_the_same_bits():
    scene, isas = room(), ["portable", *(["avx2"] if "avx2" in _core.description() else [])]
    samples = samples_in(scene)
    with (
        workers_of(isas) as client,
        dl.Session(scene, samples, paths=PATHS, gather=16) as one,
        dl.ClusterSession(scene, samples, client=client, shards=4, paths=PATHS, gather=16) as many,
    ):
        assert set(client.run(isa_of_worker).values()) == set(isas)
        for each in (one, many):
            each.bake()
        equal(many, one)
        for each in (one, many):
            each.move("block", translation(0.3, 0.4, 0.2))
            each.update()
        equal(many, one)


def test_a_worker_that_reckons_otherwise_is_refused_before_it_traces(client, monkeypatch):
    scene = room()
    monkeypatch.setattr(_core, "description", lambda: "embree 3.13.5, avx2, build 0.1, arithmetic 12345678")
    with dl.ClusterSession(scene, samples_in(scene), client=client, paths=PATHS, gather="off") as many:
        with pytest.raises(
            Error, match=r"found a worker, tcp://.*, that computes by embree.*12345678, as he"
        ):
            many.bake()
        assert set(client.run(shards_that_began).values()) == {0}
        assert not many.baked
