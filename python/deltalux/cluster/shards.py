# SPDX-License-Identifier: Apache-2.0
"""All shards of a session: actors on Dask workers, asked together; those that are lost are made again."""

from __future__ import annotations

import functools
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
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
_QUIET = 5.0  # seconds without an answer that is there and need only be fetched: then its shard is lost
_ENOUGH = 5.0  # seconds that shards have to stop
_TOLD_EVERY = 0.25  # seconds between two questions how far a shard is


Step = tuple[str, tuple[Any, ...]]  # a command of `Shard`, and its arguments


class _Pieces:
    """Work that any shard can do, piece by piece.

    Parameters
    ----------
    count : number of pieces
    step : returns the step of a piece
    take : called with the number of a piece and what the shard answered, in any order
    """

    def __init__(self, count: int, step: Callable[[int], Step], take: Callable[[int, Any], None]) -> None:
        self._left = list(range(count))[::-1]
        self._count, self._taken = count, 0
        self.step, self._take = step, take

    def next(self) -> int | None:
        """A piece that nobody works at; None: there is none at present."""
        return self._left.pop() if self._left else None

    def give_back(self, piece: int) -> None:
        """Let another shard do what is lost."""
        self._left.append(piece)

    def take(self, piece: int, answer: Any) -> None:
        """Pass on what a shard answered."""
        self._take(piece, answer)
        self._taken += 1

    @property
    def share(self) -> float:
        """Share of the pieces that are done."""
        return self._taken / self._count


@dataclass
class _Job:
    """What one shard still has to do."""

    number: int
    steps: list[Step]
    after: list[Step]  # steps of a shard that was made again
    pieces: _Pieces | None = None  # that it takes one by one when it did its steps
    piece: int | None = None  # at which it works
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

    most_parts = 8  # of what shards tell, that one process adds up

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
            self._await_answers(self._cancel(range(len(self))))
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
        steps: list[Step] = [(command, args)]
        jobs = [_Job(number, [*steps], steps if again else []) for number in range(len(self))]

        def tell() -> bool:
            share = sum(1.0 if job.done else job.fraction for job in jobs) / len(jobs)
            return progress is None or progress(STAGE, share) is not False

        self._run(jobs, functools.cache(seed), tell, fresh, meanwhile)
        return [job.result for job in jobs]

    def share(
        self,
        stage: str,
        join: Step,
        count: int,
        step: Callable[[int], Step],
        take: Callable[[int, Any], None],
        *,
        seed: Callable[[], Seed],
        progress: Progress | None,
    ) -> None:
        """Let shards do `count` pieces of work, each the next one when it is free.

        Parameters
        ----------
        stage : what the progress callback is told
        join : what each shard does first
        count, step, take : of the pieces; what is lost with a shard is done by another one
        seed : of what to make shards that are not there

        Raises
        ------
        Cancelled, Error
            As `ask`.
        """
        pieces = _Pieces(count, step, take)
        jobs = [_Job(number, [join], [join], pieces) for number in range(len(self))]

        def tell() -> bool:
            return progress is None or progress(stage, pieces.share) is not False

        self._run(jobs, functools.cache(seed), tell)

    def _run(
        self,
        jobs: Sequence[_Job],
        make: Callable[[], Seed],
        tell: Callable[[], bool],
        fresh: bool = False,
        meanwhile: Callable[[], None] | None = None,
    ) -> None:
        """Let shards do their jobs; `tell` reports progress and returns whether to go on."""
        self._command += 1
        waiting = [job for job in jobs if self._actors[job.number] is None and not fresh]
        with self._client.as_current(), self._cancelling(jobs):  # an actor binds itself to the current client
            started = [job for job in jobs if job not in waiting]
            for job in started:
                self._send(job)
            if meanwhile:
                self._await_actors(started, tell)
                meanwhile()
            for job in waiting:
                self._begin_again(job, make)
            self._follow(jobs, make, tell)

    def told(self, progress: Progress | None) -> list[ranges.PathChanges] | None:
        """What all shards told last, added up by a tree of tasks on the workers; None where that fails.

        Raises
        ------
        Cancelled
        """
        with self._client.as_current():
            parts = actors = [self._actor(number) for number in range(len(self))]
            while len(parts) > self.most_parts:
                some = [
                    parts[first : first + self.most_parts] for first in range(0, len(parts), self.most_parts)
                ]
                add = _sum if parts is not actors else functools.partial(_told_by, self._command)
                parts = [self._client.submit(add, *own, pure=False) for own in some]
            while any(part.status == "pending" for part in parts):
                if any(actor.status != "finished" for actor in actors):
                    break
                self._go_on(lambda: progress is None or progress(STAGE, 1.0) is not False)
                time.sleep(_SHORTEST)
            if all(part.status == "finished" for part in parts):
                with suppress(Exception):  # Dask has many for a worker that ended just now
                    return self._client.gather(parts)
        self.notes.append("each shard is asked for what it told, since a worker was lost that added it up")
        return None

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

    def _refill(self, job: _Job) -> None:
        """Give a shard that did its steps the next piece; if all are done, so is its job."""
        if job.steps or job.pieces is None:
            return
        job.piece = job.pieces.next()
        if job.piece is not None:
            job.steps = [job.pieces.step(job.piece)]
        job.done = job.pieces.share == 1

    def _send(self, job: _Job) -> None:
        """Send the first step, if there is one, and the actor is there."""
        self._refill(job)
        future = self._actor(job.number)
        if job.steps and job.reply is None and future.status == "finished":
            if self._proxies[job.number] is None:
                try:
                    self._proxies[job.number] = future.result()
                except (RuntimeError, OSError, CancelledError):
                    return  # its worker ended just now, which the state of its actor tells, too
            name, args = job.steps[0]
            job.reply = self._call(job.number, "run", self._command, name, *args)

    def _call(self, number: int, method: str, *args: Any) -> Any:
        """Call a shard; None if its worker is known to be gone, which the state of its actor tells, too."""
        try:
            return getattr(self._proxies[number], method)(*args)
        except RuntimeError:
            return None

    def _begin_again(self, job: _Job, make: Callable[[], Seed]) -> None:
        if job.pieces and job.piece is not None:
            job.pieces.give_back(job.piece)
        job.steps = [("restore", (make(),)), *job.after]
        job.reply = job.told = job.piece = None
        job.fraction = 0.0
        self._send(job)

    @contextmanager
    def _cancelling(self, jobs: Sequence[_Job]) -> Iterator[None]:
        """Let shards stop if the block fails, and wait for that: nobody then forgets one at work."""
        try:
            yield
        except BaseException:
            left = [job for job in jobs if not job.done]
            sent = self._cancel(job.number for job in left)
            self._await_answers(
                [*sent, *((job.number, reply) for job in left for reply in (job.reply, job.told))]
            )
            raise

    def _cancel(self, numbers: Iterable[int]) -> list[tuple[int, Any]]:
        """Tell shards to stop; returns their numbers and replies."""
        there = [number for number in numbers if self._proxies[number] is not None]
        return [(number, self._call(number, "cancel", self._command)) for number in there]

    def _await_answers(self, replies: Sequence[tuple[int, Any]]) -> None:
        """Wait until shards have answered, but not long, and for none whose worker is gone."""

        def is_open(number: int, reply: Any) -> bool:
            actor = self._actors[number]
            there = actor is not None and actor.status == "finished"
            return reply is not None and there and not reply.done()

        end = time.monotonic() + _ENOUGH
        while any(is_open(*each) for each in replies) and time.monotonic() < end:
            time.sleep(_SHORTEST)

    # ---- all of them --------------------------------------------------------------------------------

    def _await_actors(self, jobs: Sequence[_Job], tell: Callable[[], bool]) -> None:
        """Send first steps as soon as actors are made, unless there is no worker to make them."""
        while self._client.nthreads() and any(self._actor(job.number).status == "pending" for job in jobs):
            self._go_on(tell)
            time.sleep(_LONGEST)
        for job in jobs:
            self._send(job)

    def _go_on(self, tell: Callable[[], bool]) -> None:
        if not tell():
            raise Cancelled("cluster: cancelled by the progress callback")

    def _follow(self, jobs: Sequence[_Job], make: Callable[[], Seed], tell: Callable[[], bool]) -> None:
        pause, asked, alone = _SHORTEST, time.monotonic(), None
        while open_jobs := [job for job in jobs if not job.done]:
            came = sum(self._advance(job, make) for job in open_jobs)
            now = time.monotonic()
            if now - asked > _TOLD_EVERY:
                asked = now
                for job in open_jobs:
                    self._ask_how_far(job)
                alone = self._check_workers(open_jobs, alone, now)
            self._go_on(tell)
            pause = _SHORTEST if came else min(1.2 * pause, _LONGEST)
            if not came:
                time.sleep(pause)

    def _advance(self, job: _Job, make: Callable[[], Seed]) -> bool:
        """Take what a shard answered, send what comes next; whether there was something to do."""
        status = self._actor(job.number).status
        if job.reply is None:
            if status in ("error", "cancelled", "lost"):
                self._lose(job, f"its actor's state is {status}", make)
                return True
            self._send(job)
            return job.reply is not None
        if not job.reply.done():
            if status == "finished":
                return False
            self._lose(job, "its worker is gone", make)
            return True
        try:
            result = job.reply.result()
        except (OSError, OutOfStep) as problem:
            self._lose(job, str(problem), make)
            return True
        job.reply = None
        job.steps.pop(0)
        piece, job.piece = job.piece, None
        if job.steps or job.pieces:
            self._send(job)  # before what came is taken, which takes time
        else:
            job.result, job.done = result, True
        if piece is not None and job.pieces:
            job.pieces.take(piece, result)
        return True

    def _lose(self, job: _Job, why: str, make: Callable[[], Seed]) -> None:
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
        self._begin_again(job, make)

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
            job.told = self._call(job.number, "told")

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


def _told_by(command: int, *shards: Any) -> ranges.PathChanges:
    """What these shards told last, added up."""
    answers = [shard.run(command, "last_answer") for shard in shards]
    came, news = 0, time.monotonic()
    while came < len(answers):
        time.sleep(_SHORTEST)
        done, now = sum(answer.done() for answer in answers), time.monotonic()
        if done > came:
            came, news = done, now
        elif now - news > _QUIET:  # what waits takes the place of the task that makes a lost shard again
            raise OutOfStep(f"cluster: found no answer of a shard for {_QUIET:g} s")
    return ranges.add_up([answer.result().changes for answer in answers])


def _sum(*parts: ranges.PathChanges) -> ranges.PathChanges:
    return ranges.add_up(parts)


def _passed_on(blueprint: Blueprint) -> Blueprint:
    return blueprint


def choices_of(core: Any) -> Mapping[str, bytes]:
    """A copy of what the core's session knows of its bake, without paths."""
    view = core.save_choices()
    return {name: view[name] for name in view.names()}
