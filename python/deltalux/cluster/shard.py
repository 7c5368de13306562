# SPDX-License-Identifier: Apache-2.0
"""A shard: the session with a range of the paths that a worker holds as a Dask actor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from deltalux.core_session import description
from deltalux.errors import Cancelled, Error
from deltalux.results import Frame
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.session import Session, ranges

from .archive import BounceArrays, paths_of


class Edit(NamedTuple):
    """One edit, as the core takes it: its kind, and values that can be pickled."""

    kind: str
    values: tuple[Any, ...]


class Batch(NamedTuple):
    """Edits that take effect together; numbers ascend in the life of a session."""

    number: int
    edits: tuple[Edit, ...]


@dataclass(frozen=True, eq=False)
class Blueprint:
    """What a shard's session is made of."""

    scene: Scene
    samples: Samples
    options: Mapping[str, Any]
    built_by: str  # what bits depend on; workers must agree


@dataclass(frozen=True, eq=False)
class Seed:
    """What a shard that was lost is made of again, in a state in which nothing was pending.

    Parameters
    ----------
    scene : with the meshes that edits inserted
    choices : arrays of the core's session, by name: the bake's choices and the present scene
    number : of the last batch of edits that these contain
    """

    scene: Scene
    choices: Mapping[str, bytes]
    number: int


@dataclass(frozen=True, eq=False)
class Answer:
    """What a shard says after a bake, an update or a recompute."""

    changes: ranges.PathChanges
    frame: Frame


@dataclass(frozen=True, eq=False)
class Held:
    """An answer without what is told, which others ask for."""

    frame: Frame


class OutOfStep(Error):
    """A shard cannot tell what was asked for: what it told last never arrived, or others forgot it."""


class MemoryArchive:
    """Arrays in memory, from which the core restores a session."""

    def __init__(self, arrays: Mapping[str, Any]) -> None:
        self._arrays = arrays
        self._begin = dict.fromkeys(arrays, 0)

    def bytes(self, name: str) -> int | None:
        """Size of an array, None where there is none of that name."""
        return len(self._arrays[name]) if name in self._arrays else None

    def read_into(self, name: str, buffer: memoryview) -> None:
        """Fill `buffer` with the next bytes of an array."""
        begin = self._begin[name]
        buffer[:] = self._arrays[name][begin : begin + len(buffer)]
        self._begin[name] += len(buffer)


class Shard:
    """Works in one thread of a worker, a command at a time; `cancel` and `told` answer meanwhile.

    Parameters
    ----------
    blueprint : Blueprint
    own : range of the paths
    """

    def __init__(self, blueprint: Blueprint, own: tuple[int, int]) -> None:
        from distributed import get_worker

        self._blueprint, self._own = blueprint, own
        self._threads = get_worker().state.nthreads
        self._session: Session | None = None
        self._number = 0  # of the last batch of edits that was queued
        self._answer: Answer | None = None  # the last one, for whom it did not reach
        self._command = self._cancelled = 0
        self._told = ("", 0.0)

    # ---- while a command runs: coroutines, which Dask runs beside the thread of the commands ---------

    async def told(self) -> tuple[str, float]:
        """Stage and fraction of the command that runs."""
        return self._told

    async def cancel(self, command: int) -> None:
        """Let all commands up to this number end as soon as possible, by `Cancelled`."""
        self._cancelled = max(self._cancelled, command)

    # ---- commands -----------------------------------------------------------------------------------

    def run(self, command: int, name: str, *args: Any) -> Any:
        """Run the command `name`; `command`: its number, which ascends."""
        self._command, self._told = command, ("", 0.0)
        self._check_build()
        if command <= self._cancelled:
            raise Cancelled("cluster: cancelled")
        return getattr(self, f"_{name}")(*args)

    def _check_build(self) -> None:
        """Raise Error if this worker's bits may differ from those of the session."""
        from distributed import get_worker

        found, expected = description(), self._blueprint.built_by
        if found != expected:
            raise Error(
                f"cluster: found a worker, {get_worker().address}, that computes by {found}, expected "
                f"{expected}, as here: bits may differ; use one installation and one kind of processor"
            )

    def _keep_on(self, stage: str, fraction: float) -> bool:
        self._told = (stage, fraction)
        return self._command > self._cancelled

    def _make(self, scene: Scene) -> Session:
        if self._session is not None:
            self._session.close()
        plan = self._blueprint
        options: dict[str, Any] = {**plan.options, "path_range": self._own}
        options["threads"] = options["threads"] or self._threads
        self._session = Session(scene, plan.samples, progress=self._keep_on, **options)
        self._answer = None
        return self._session

    def _own_session(self) -> Session:
        assert self._session is not None
        return self._session

    def _queue(self, batches: Sequence[Batch]) -> None:
        session = self._session or self._make(self._blueprint.scene)
        for batch in batches:
            if batch.number > self._number:
                for kind, values in batch.edits:
                    ranges.queue_edit(session, kind, values)
                self._number = batch.number

    def _say(self, frame: Frame) -> Answer:
        self._answer = Answer(ranges.path_changes(self._own_session()), frame)
        return self._answer

    def _bake(self, batches: Sequence[Batch]) -> Answer:
        self._answer = None
        self._queue(batches)
        return self._say(self._own_session().bake())

    def _restore(self, seed: Seed) -> Answer:
        """Trace all paths anew in the state of the seed."""
        session = self._make(seed.scene)
        ranges.restore_choices(session, MemoryArchive(seed.choices))
        self._number = seed.number
        return self._say(session.recompute())

    def _recompute(self) -> Answer:
        self._answer = None
        return self._say(self._own_session().recompute())

    def _update(self, batches: Sequence[Batch], since: int | None) -> Answer:
        """Apply the batches that are new here; tell what they changed `since` that edit.

        An answer that did not arrive is given again.
        """
        self._queue(batches)
        frame = self._own_session().update()
        last = self._answer
        edits = self._own_session().statistics["edits"]
        if last is not None and (last.changes.since, last.changes.edits) == (since, edits):
            return last
        answer = self._say(frame)
        if (found := answer.changes.since) != since:
            raise OutOfStep(f"cluster: a shard tells changes from edit {found}, not {since}")
        return answer

    def _hold(self, name: str, *args: Any) -> Held:
        """Run a command that answers, and keep what is told for others to ask for."""
        return Held(getattr(self, f"_{name}")(*args).frame)

    def _last_answer(self) -> Answer:
        """The last answer once more, all of it."""
        if self._answer is None:
            raise OutOfStep("cluster: a shard has no answer to give again")
        return self._answer

    def _place_samples(self) -> None:
        ranges.place_samples(self._own_session())

    def _cast_direct(self, first: int, last: int) -> dict[str, np.ndarray]:
        return ranges.cast_direct(self._own_session(), first, last)

    def _number_rays(self, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
        return ranges.number_rays(self._own_session(), first, last)

    def _cast_gather_rays(
        self, first: int, last: int, aims: Mapping[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        return ranges.cast_gather_rays(self._own_session(), first, last, MemoryArchive(aims))

    def _segments_hash(self) -> np.ndarray:
        return ranges.segments_hash(self._own_session())

    def _gradient_sums(self) -> ranges.GradientSums:
        return ranges.gradient_sums(self._own_session())

    def _paths(self) -> list[BounceArrays]:
        return paths_of(ranges.saved_arrays(self._own_session()))

    def _figures(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Statistics and the balance of energy."""
        session = self._own_session()
        return session.statistics, session.energy
