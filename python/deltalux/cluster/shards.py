# SPDX-License-Identifier: Apache-2.0
"""All shards of a session: actors on Dask workers, asked together; those that are lost are made again."""

from __future__ import annotations

import functools
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from deltalux.errors import Cancelled, Error
from deltalux.segments import Progress
from deltalux.session import ranges

from .shard import Blueprint, OutOfStep, Seed, Shard

STAGE = "trace shards"  # what progress callbacks are told while shards trace paths
LONG_STAGE = "trace paths"  # the stage of a shard that takes its time
MOST_LOSSES = 4  # of one shard in one call: then its work itself is what ends its workers
_SHORTEST, _LONGEST = 5e-4, 2e-2  # seconds between two looks at what has come
_TOLD_EVERY = 0.25  # seconds between two questions how far a shard is


@dataclass
class _Job:
    """What one shard still has to do."""

    number: int
    steps: list[tuple[str, tuple[Any, ...]]]
    reply: Any = None  # of the first step, once it was sent
    told: Any = None  # a question how far it is
    fraction: float = 0.0
    losses: int = 0
    result: Any = None
    done: bool = False


class Shards:
    """The shards of one session.

    Parameters
    ----------
    client : distributed.Client
    blueprint : what each shard's session is made of
    count : number of shards
    patience : seconds to wait for a worker when there is none
    """

    def __init__(self, client: Any, blueprint: Blueprint, count: int, patience: float) -> None:
        self._client, self._blueprint, self._patience = client, blueprint, patience
        self._ranges = ranges.ranges_of(int(blueprint.options["paths"]), count)
        self._plan: Any = None  # the blueprint, as a task whose result workers pass on to each other
        self._actors: list[Any] = [None] * count  # futures of actors
        self._proxies: list[Any] = [None] * count
        self._command = 0
        self.notes: list[str] = []  # what happened to workers

    def __len__(self) -> int:
        return len(self._ranges)

    def close(self) -> None:
        """Let the workers forget the shards."""
        self._forget(range(len(self)))
        self._plan = None

    def forget_all(self) -> None:
        """Make all shards anew when they are asked next: nobody knows which state they are in."""
        with self._client.as_current():
            self._cancel(range(len(self)))
        self.close()

    def ask(
        self,
        command: str,
        *args: Any,
        seed: Callable[[], Seed],
        again: bool = True,
        fresh: bool = False,
        meanwhile: Callable[[], None] | None = None,
        progress: Progress | None = None,
    ) -> list[Any]:
        """Let all shards run `command`, and return what they answer, in order.

        Parameters
        ----------
        command, args : of `Shard`
        seed : of what to make shards that are not there, once `meanwhile` is over
        again : whether such a shard runs the command after that; otherwise its answer is that of the seed
        fresh : whether shards that are not there can run the command just as they are made
        meanwhile : called while they work
        progress : callable (stage, fraction) -> keep going, or None

        Raises
        ------
        Cancelled
            Where the callback asks to stop; shards stop, too.
        Error
            If no worker comes within `patience` seconds, or a shard ends its workers again and again; any
            error of a shard.
        """
        self._command += 1
        jobs = [_Job(number, [(command, args)]) for number in range(len(self))]
        waiting = [job for job in jobs if self._actors[job.number] is None and not fresh]
        with self._client.as_current(), self._cancelling(jobs):  # an actor binds itself to the current client
            for job in jobs:
                if job not in waiting:
                    self._send(job)
            if meanwhile:
                meanwhile()
            make = functools.cache(seed)
            for job in waiting:
                self._begin_again(job, make, again)
            self._follow(jobs, make, again, progress)
        return [job.result for job in jobs]

    # ---- one shard ----------------------------------------------------------------------------------

    def _actor(self, number: int) -> Any:
        """The future of a shard's actor, which is made if there is none."""
        if self._actors[number] is None:
            if self._plan is None:
                with warnings.catch_warnings():
                    warnings.filterwarnings("ignore", "Sending large graph")  # it is sent once
                    self._plan = self._client.submit(_passed_on, self._blueprint, pure=False)
            self._actors[number] = self._client.submit(
                Shard, self._plan, self._ranges[number], actor=True, pure=False
            )
        return self._actors[number]

    def _forget(self, numbers: Iterable[int]) -> None:
        """Let workers forget these shards, now: garbage collection would free their memory much later."""
        there = [self._actors[number] for number in numbers if self._actors[number] is not None]
        for number in numbers:
            self._proxies[number] = self._actors[number] = None
        if there and self._client.status == "running":
            self._client.cancel(there, force=True)

    def _send(self, job: _Job) -> None:
        """Send the first step, if the actor is there."""
        future = self._actor(job.number)
        if job.reply is None and future.status == "finished":
            if self._proxies[job.number] is None:
                self._proxies[job.number] = future.result()
            name, args = job.steps[0]
            job.reply = self._proxies[job.number].run(self._command, name, *args)

    def _begin_again(self, job: _Job, make: Callable[[], Seed], again: bool) -> None:
        seed = make()
        job.steps = [("restore", (seed,)), *(job.steps[-1:] if again else [])]
        job.reply = job.told = None
        job.fraction = 0.0
        self._send(job)

    @contextmanager
    def _cancelling(self, jobs: Sequence[_Job]) -> Iterator[None]:
        """Let shards stop if the block fails."""
        try:
            yield
        except BaseException:
            self._cancel(job.number for job in jobs if not job.done)
            raise

    def _cancel(self, numbers: Iterable[int]) -> None:
        for number in numbers:
            if self._proxies[number] is not None:
                self._proxies[number].cancel(self._command)

    # ---- all of them --------------------------------------------------------------------------------

    def _follow(
        self,
        jobs: Sequence[_Job],
        make: Callable[[], Seed],
        again: bool,
        progress: Progress | None,
    ) -> None:
        pause, asked, alone = _SHORTEST, time.monotonic(), None
        while open_jobs := [job for job in jobs if not job.done]:
            if sum(self._advance(job, make, again) for job in open_jobs):
                pause = _SHORTEST
                continue
            now = time.monotonic()
            if now - asked > _TOLD_EVERY:
                asked = now
                for job in open_jobs:
                    self._ask_how_far(job)
                alone = self._check_workers(open_jobs, alone, now)
            if progress:
                share = sum(1.0 if job.done else job.fraction for job in jobs) / len(jobs)
                if progress(STAGE, share) is False:
                    raise Cancelled("cluster: cancelled by the progress callback")
            time.sleep(pause)
            pause = min(1.2 * pause, _LONGEST)

    def _advance(self, job: _Job, make: Callable[[], Seed], again: bool) -> bool:
        """Take what a shard answered, send what comes next; whether there was something to do."""
        status = self._actor(job.number).status
        if job.reply is None:
            if status in ("error", "cancelled", "lost"):
                self._lose(job, f"its actor's state is {status}", make, again)
                return True
            self._send(job)
            return job.reply is not None
        if not job.reply.done():
            if status == "finished":
                return False
            self._lose(job, "its worker is gone", make, again)
            return True
        try:
            result = job.reply.result()
        except (OSError, OutOfStep) as problem:
            self._lose(job, str(problem), make, again)
            return True
        job.reply = None
        job.steps.pop(0)
        if job.steps:
            self._send(job)
        else:
            job.result, job.done = result, True
        return True

    def _lose(self, job: _Job, why: str, make: Callable[[], Seed], again: bool) -> None:
        job.losses += 1
        first, last = self._ranges[job.number]
        name = f"shard {job.number} (paths {first} to {last})"
        if job.losses > MOST_LOSSES:
            raise Error(
                f"cluster: {name} was lost {job.losses} times in one call, expected a worker that survives "
                f"it ({why}); see the workers' logs: a memory limit that is too small ends them, then use "
                "more shards, or workers with more memory"
            )
        self.notes.append(f"{name} was lost ({why}) and is traced again by another worker")
        self._forget([job.number])
        self._begin_again(job, make, again)

    def _ask_how_far(self, job: _Job) -> None:
        proxy = self._proxies[job.number]
        if job.reply is None or proxy is None:
            return
        if job.told is not None and job.told.done():
            try:
                stage, fraction = job.told.result()
            except OSError:
                return  # seen by the state of the actor
            if stage == LONG_STAGE and len(job.steps) == 1:
                job.fraction = max(job.fraction, fraction)
            job.told = None
        if job.told is None:
            job.told = proxy.told()

    def _check_workers(self, jobs: Sequence[_Job], alone: float | None, now: float) -> float | None:
        """Since when shards wait for a worker; raises Error after too long a time."""
        if all(self._actor(job.number).status != "pending" for job in jobs):
            return None
        if self._client.nthreads():
            return None
        if alone is not None and now - alone > self._patience:
            raise Error(
                f"cluster: found no worker for {self._patience:g} s, expected at least one at "
                f"{self._client.scheduler.address}; start workers there (dask worker ADDRESS)"
            )
        return now if alone is None else alone


def _passed_on(blueprint: Blueprint) -> Blueprint:
    return blueprint


def choices_of(core: Any) -> Mapping[str, bytes]:
    """A copy of what the core's session knows of its bake, without paths."""
    view = core.save_choices()
    return {name: view[name] for name in view.names()}
