# SPDX-License-Identifier: Apache-2.0
"""What sharing the paths among processes gains and costs, measured here and reckoned for up to 1,000 workers.

    PYTHONPATH=python .venv/bin/python benchmarks/cluster.py --paths 1e7 --repeats 3

Bakes of the atrium by paths alone (gather="off", direct="paths") with one and with two single-threaded
workers; with --defaults, bakes by default options instead, a shard per worker, and nothing else. Then updates
of its trolley with 8 shards on two workers against one process of two threads; what shards answer, in bytes,
and how long it takes to take that in; with more than 8 shards also without the tree of tasks that adds up
what they tell. Then a simulation of one update with many workers: their answers arrive one after another at
the coordinator, which unpacks and adds them, or at a tree in which workers add up those of others.
"""

from __future__ import annotations

import argparse
import heapq
import logging
import pickle
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import deltalux as dl
import numpy as np
from distributed import Client, LocalCluster

MOVED = "trolley"
STEP = 0.05  # metres
WIRE = 1.25e9  # bytes per second, 10 Gbit/s
LATENCY = 2e-4  # seconds for a message through the scheduler, within a rack
FAN_IN = 8  # of the tree
COUNTS = (1, 2, 8, 32, 100, 316, 1000)


class Costs(NamedTuple):
    """Of an answer to an update: its bytes, and seconds to unpack, to add, and to join it with another."""

    size: float
    unpack: float
    add: float
    join: float


@contextmanager
def workers(count: int) -> Iterator[Client]:
    """So many processes of one thread."""
    with (
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


BY_PATHS: dict[str, Any] = {"gather": "off", "direct": "paths", "shards": 2}


def bake_seconds(
    scene: dl.Scene, samples: dl.Samples, count: int, repeats: int, options: dict[str, Any]
) -> list[float]:
    """Seconds of bakes with `count` workers, the first one left out."""
    found = []
    with (
        workers(count) as client,
        dl.ClusterSession(scene, samples, client=client, threads=1, **options) as session,
    ):
        for _ in range(repeats + 1):
            begin = time.perf_counter()
            session.bake()
            found.append(time.perf_counter() - begin)
    return found[1:]


def moves(session: dl.Session, repeats: int) -> list[float]:
    """Milliseconds of updates that move the object to and fro."""
    home, found = session.pose(MOVED), []
    for number in range(repeats):
        pose = home.copy()
        pose[0, 3] += STEP * (1 + number % 3)
        session.move(MOVED, pose)
        begin = time.perf_counter()
        session.update()
        found.append(1e3 * (time.perf_counter() - begin))
    return found


def updates(scene: dl.Scene, samples: dl.Samples, paths: int, shards: int, repeats: int) -> Costs:
    """Print what an update costs here and there; return what its answers cost."""
    options: dict[str, Any] = {"paths": paths}
    with dl.Session(scene, samples, threads=2, **options) as one:
        one.bake()
        alone = moves(one, repeats)
        digest = one.digest()
    answers: list[Any] = []
    with (
        workers(2) as client,
        dl.ClusterSession(scene, samples, client=client, shards=shards, threads=2, **options) as many,
    ):
        many.bake()
        add = many._core._add
        many._core._add = lambda changes: (answers.append(changes), add(changes))
        shared = moves(many, repeats)
        assert many.digest() == digest
        tree = many._core._shards
        if shards > tree.most_parts:
            tree.most_parts = shards
            single = statistics.median(moves(many, repeats))
            print(f"update, {shards} shards, their answers one by one: {single:.1f} ms")
        costs = costs_of(answers)
        print(f"update, one process of 2 threads: {statistics.median(alone):.1f} ms")
        print(f"update, {shards} shards on 2 workers of 1 thread: {statistics.median(shared):.1f} ms")
    return costs


def costs_of(answers: Sequence[Any]) -> Costs:
    """Medians over answers of shards."""
    packed = [pickle.dumps(answer) for answer in answers]
    unpack, join = [], []
    for data, other in zip(packed, answers, strict=True):
        begin = time.perf_counter()
        answer = pickle.loads(data)
        unpack.append(time.perf_counter() - begin)
        begin = time.perf_counter()
        answer.cells + other.cells
        answer.discs + other.discs
        join.append(time.perf_counter() - begin)
    numbers = statistics.median(len(answer.cells.at) + len(answer.discs.at) for answer in answers)
    row = np.zeros(1 << 22, np.int64)
    begin = time.perf_counter()
    for answer in answers:
        row[answer.cells.at.astype(np.int64) % len(row)] += answer.cells.values
    add = (time.perf_counter() - begin) / len(answers)
    size = statistics.median(map(len, packed))
    print(
        f"an answer: {size / 1024:.1f} KiB for {numbers:.0f} numbers; unpacked in "
        f"{1e3 * statistics.median(unpack):.2f} ms, added in {1e3 * add:.2f} ms, joined with another in "
        f"{1e3 * statistics.median(join):.2f} ms"
    )
    return Costs(size, statistics.median(unpack), add, statistics.median(join))


def one_by_one(costs: Costs, ends: Sequence[float]) -> float:
    """When a coordinator has added all answers, which are ready at `ends`."""
    now = 0.0
    for end in sorted(ends):
        now = max(now, end + LATENCY) + costs.size / WIRE + costs.unpack + costs.add
    return now


def by_tree(costs: Costs, ends: Sequence[float]) -> float:
    """The same where workers join FAN_IN answers each, level by level, before the coordinator."""
    level = sorted(ends)
    while len(level) > FAN_IN:
        level = [_joined(costs, level[first : first + FAN_IN]) for first in range(0, len(level), FAN_IN)]
        heapq.heapify(level)
    return one_by_one(costs, level)


def _joined(costs: Costs, ends: Sequence[float]) -> float:
    now = 0.0
    for end in ends[1:]:
        now = max(now, end + LATENCY) + costs.size / WIRE + costs.unpack + costs.join
    return max(now, ends[0])


def simulate(costs: Costs, work: float) -> None:
    """Print when an update that takes one worker `work` seconds of paths ends, for many workers."""
    rng = np.random.default_rng(1)
    print(f"\nan update of {work:.0f} s of path work; ms until all is added")
    print("workers  paths  one by one  tree")
    for count in COUNTS:
        # jitter of a tenth, as shards and nodes differ
        ends = (work / count * rng.uniform(0.95, 1.05, count)).tolist()
        single, tree = one_by_one(costs, ends), by_tree(costs, ends)
        print(f"{count:7} {1e3 * work / count:6.0f} {1e3 * single:11.0f} {1e3 * tree:5.0f}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--paths", type=float, default=1e7, help="of the bakes")
    parser.add_argument(
        "--defaults", action="store_true", help="bake by default options, a shard per worker; nothing else"
    )
    parser.add_argument("--update-paths", type=float, default=3e5)
    parser.add_argument("--shards", type=int, default=8)
    parser.add_argument("--repeats", type=int, default=3)
    asked = parser.parse_args()
    scene = dl.scenes.atrium()
    samples = dl.Samples.on_vertices(scene)
    seconds = {}
    for n in (1, 2):
        options = {"shards": n} if asked.defaults else BY_PATHS
        seconds[n] = bake_seconds(scene, samples, n, asked.repeats, {"paths": int(asked.paths), **options})
    one, two = (statistics.median(seconds[n]) for n in (1, 2))
    print(f"bake of {asked.paths:.0e} paths: one worker {one:.1f} s, two {two:.1f} s, {one / two:.2f} times")
    if asked.defaults:
        return 0
    costs = updates(scene, samples, int(asked.update_paths), asked.shards, 4 * asked.repeats)
    simulate(costs, work=10.0)
    return 0


if __name__ == "__main__":
    sys.exit(main())
