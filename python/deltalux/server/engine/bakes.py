# SPDX-License-Identifier: Apache-2.0
"""Computes the session's light from scratch: the first bake, another one, another scene's, a check."""

from __future__ import annotations

import time

from deltalux.errors import Cancelled
from deltalux.pace import Counts, Step, baking, counts_with, loading, recomputing, summing_up
from deltalux.planning import is_calibrated
from deltalux.session import Session

from .events import Remade
from .known import known_of
from .previews import preview_steps, previews
from .progress import TaskProgress
from .publishing import Publisher
from .remaking import Remake, samples_like
from .state import State
from .updates import Updates


class Bakes:
    """Long tasks; each hands over the edits to the wanted state first."""

    def __init__(self, session: Session, state: State, publisher: Publisher, updates: Updates) -> None:
        self._session, self._state = session, state
        self._publisher, self._updates = publisher, updates

    def begin(self, progress: TaskProgress) -> None:
        """Publish the light of a baked session, which precedes queued edits, or bake."""
        if self._session.baked:
            self._publisher.publish(0)
        if self._state.lit:
            self._updates.figures.read_methods(self._session)
        else:
            self.bake(progress)

    def bake(self, progress: TaskProgress) -> None:
        """Compute everything; if there is no light yet, publish coarse previews first."""
        self._publisher.set_phase("baking")
        wanted, _ = self._updates.hand_over()
        steps = _bake_steps(_counts(self._session))
        if self._session.baked:
            progress.expect(steps)
        else:
            progress.expect([*preview_steps(self._session), *steps])
            for coarse in previews(self._session, wanted.state, progress):
                self._publisher.publish(wanted.revision, coarse)
                self._publisher.set_phase("preview")
        self._session.progress = progress
        start = time.perf_counter()
        frame = self._session.bake()
        seconds = time.perf_counter() - start
        self._state.unfinished = False
        progress("sum up", 0.0)
        self._publisher.publish(wanted.revision)
        self._publisher.tell(self._updates.figures.of_bake(self._session, frame, wanted.revision, seconds))

    def remake(self, remake: Remake, progress: TaskProgress) -> None:
        """Bake another version of the scene in the wanted state; until then the light stays as it is."""
        self._publisher.set_phase("baking")
        wanted, _ = self._updates.hand_over()
        session = self._session
        counts = _counts(session)
        progress.expect([*loading(counts), *_bake_steps(counts)])
        progress("place samples", 0.0)
        scene = remake.make(session.scene)
        samples = samples_like(session.samples, scene)
        progress.expect(_bake_steps(counts_with(scene, samples, session.options)))
        if not progress("make session", 0.0):
            raise Cancelled("bake: cancelled")
        session.progress = progress
        start = time.perf_counter()
        frame = session.rebake(scene, samples)
        seconds = time.perf_counter() - start
        self._state.unfinished = False
        self._publisher.start_over()
        progress("sum up", 0.0)
        self._publisher.tell(Remade(known_of(session), self._publisher.geometry, remake))
        self._publisher.publish(wanted.revision)
        self._publisher.tell(self._updates.figures.of_bake(session, frame, wanted.revision, seconds))

    def check(self, progress: TaskProgress) -> None:
        """Recompute everything and compare the digests."""
        self._publisher.set_phase("checking")
        self._updates.hand_over()
        session = self._session
        progress.expect(recomputing(_counts(session)))
        session.progress = progress
        digest = session.digest()
        start = time.perf_counter()
        session.recompute()
        milliseconds = 1e3 * (time.perf_counter() - start)
        recomputed = session.digest()
        self._state.unfinished = False
        self._updates.figures.recompute_milliseconds = milliseconds
        self._publisher.publish(self._state.followed)
        self._publisher.tell(
            {
                "type": "checked",
                "same": digest == recomputed,
                "digest": digest,
                "recomputed": recomputed,
                "milliseconds": milliseconds,
            }
        )


def _counts(session: Session) -> Counts:
    return counts_with(session.scene, session.samples, session.options)


def _bake_steps(counts: Counts) -> list[Step]:
    """Steps of a bake and of publishing its values."""
    return [*baking(counts, is_calibrated()), *summing_up(counts)]
