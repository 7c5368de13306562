# SPDX-License-Identifier: Apache-2.0
"""Experiments as tasks of a Dask cluster: each runs on one worker, as it would here."""

from __future__ import annotations

import time
import uuid
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from deltalux.errors import Cancelled, Error
from deltalux.segments import Progress

from .experiment import Experiment
from .experiments import experiment
from .record import Record
from .runner import run, run_key

STAGE = "experiments"
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
    told: dict[str, float] = {}
    client.subscribe_topic(topic, lambda event: told.update([event[1]]))
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
                    told[record.name] = 1.0
                    yield place, record
                if progress and progress(STAGE, sum(told.values()) / len(jobs)) is False:
                    raise Cancelled("study: cancelled by the progress callback")
                time.sleep(_PAUSE if places else 0.0)
        finally:
            stop.set()
            client.cancel(list(places))
            client.unsubscribe_topic(topic)


def _run(topic: str, name: str, settings: dict[str, Any]) -> Record:
    """Run an experiment in a worker, which tells how far it is."""
    from distributed import Event, get_worker

    worker, stop, last = get_worker(), Event(topic), 0.0

    def tell(_: str, fraction: float) -> bool:
        nonlocal last
        if time.monotonic() - last < _TOLD_EVERY:
            return True
        last = time.monotonic()
        worker.log_event(topic, (name, fraction))
        return not stop.is_set()

    settings["threads"] = settings["threads"] or worker.state.nthreads
    return run(experiment(name), settings, tell)
