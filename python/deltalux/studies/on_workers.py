# SPDX-License-Identifier: Apache-2.0
"""Experiments as tasks of a Dask cluster, and what they do with each seed as tasks of these."""

from __future__ import annotations

import time
import uuid
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from deltalux.errors import Cancelled, Error
from deltalux.segments import Progress

from .experiment import Experiment
from .experiments import experiment
from .record import Record
from .runner import run, run_key
from .seeds import OfSeed, spread_by

STAGE = "experiments"
WHOLE = ""  # the part of an experiment that is not of single seeds
_PAUSE = 0.1  # seconds between two looks at what is done
_TOLD_EVERY = 0.5  # seconds between two reports of a worker


def run_on_workers(
    client: Any, jobs: Sequence[tuple[Experiment, Mapping[str, Any]]], progress: Progress | None = None
) -> Iterator[tuple[int, Record]]:
    """Run experiments on the workers of a cluster; yields place in `jobs` and record of each, as it ends.

    Parameters
    ----------
    client : distributed.Client
    jobs : experiments with their settings, see `settings_of`; `threads` None: those that Dask gave a worker
    progress : callable (stage, fraction) -> keep going; there is one stage for all

    Raises
    ------
    Cancelled
        Where the callback asks to stop; workers stop at their next report.
    Error
        If a worker has another version of the program; any error of an experiment.
    """
    from distributed import Event

    topic = f"deltalux-study-{uuid.uuid4().hex}"
    told = _Told()
    client.subscribe_topic(topic, lambda event: told.hear(*event[1]))
    keys = [run_key(*job) for job in jobs]  # before the runs, because sources may be edited during them
    with client.as_current():
        stop = Event(topic)
        places = {
            client.submit(_run, topic, each.name, dict(settings), pure=False): place
            for place, (each, settings) in enumerate(jobs)
        }
        try:
            while places:
                for future in [each for each in places if each.done()]:
                    place = places.pop(future)
                    record = future.result()
                    if record.key != keys[place]:
                        raise Error(
                            "study: found a worker with another version or build of deltalux "
                            f"(for {record.name}), expected those that are here; use one installation"
                        )
                    told.hear(record.name, WHOLE, 1.0)
                    yield place, record
                if progress and progress(STAGE, told.sum() / len(jobs)) is False:
                    raise Cancelled("study: cancelled by the progress callback")
                time.sleep(_PAUSE if places else 0.0)
        finally:
            stop.set()
            client.cancel(list(places))
            client.unsubscribe_topic(topic)


class _Told:
    """How far the experiments are, by what workers tell of them and of what they do with single seeds."""

    def __init__(self) -> None:
        self._shares: dict[str, dict[str, float]] = {}

    def hear(self, name: str, part: str, share: float) -> None:
        """A part of an experiment is so far, as a share of the experiment; WHOLE counts what itself did."""
        self._shares.setdefault(name, {})[part] = share

    def sum(self) -> float:
        """Of all experiments, each up to 1."""
        return sum(min(1.0, sum(parts.values())) for parts in self._shares.values())


class _Teller:
    """Tells from a worker how far a part of an experiment is, now and then."""

    def __init__(self, topic: str, name: str, part: str) -> None:
        from distributed import Event, get_worker

        self._worker, self._stop = get_worker(), Event(topic)
        self._topic, self._about, self._last = topic, (name, part), 0.0

    def __call__(self, share: float) -> bool:
        """Returns whether to go on."""
        if time.monotonic() - self._last < _TOLD_EVERY:
            return True
        self._last = time.monotonic()
        self._worker.log_event(self._topic, (*self._about, share))
        return not self._stop.is_set()


def _run(topic: str, name: str, settings: dict[str, Any]) -> Record:
    """Run an experiment in a worker, which tells how far it is."""
    from distributed import get_worker

    tell = _Teller(topic, name, WHOLE)
    settings["threads"] = settings["threads"] or get_worker().state.nthreads
    with spread_by(partial(_seeds_on_workers, topic, name)):
        return run(experiment(name), settings, lambda _, share: tell(share))


def _seeds_on_workers(topic: str, name: str, one: OfSeed, seeds: Sequence[int], share: float) -> list[Any]:
    """`by_seed` in a worker: a task for each seed. Meanwhile this worker is free to take one."""
    from distributed import worker_client

    with worker_client() as client:
        part = uuid.uuid4().hex  # an experiment may come here several times
        tasks = [
            client.submit(_run_seed, topic, name, f"{part}-{seed}", one, seed, share, pure=False)
            for seed in seeds
        ]
        try:
            return list(client.gather(tasks))
        except BaseException:
            client.cancel(tasks)
            raise


def _run_seed(topic: str, name: str, part: str, one: OfSeed, seed: int, share: float) -> Any:
    tell, done = _Teller(topic, name, part), 0

    def step() -> None:
        nonlocal done
        done += 1
        if not tell(done * share):
            raise Cancelled("study: cancelled by the progress callback")

    return one(seed, step)
