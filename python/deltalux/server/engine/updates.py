# SPDX-License-Identifier: Apache-2.0
"""Brings the session's light to the wanted state, step by step or to the end."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

from deltalux.errors import Cancelled, Error, OptionError
from deltalux.server.edits import differences, queue_edit, state_of
from deltalux.server.protocol.told import FrameMessage
from deltalux.session import Session

from .events import Refused, Wanted
from .figures import Figures
from .progress import TaskProgress
from .publishing import Publisher
from .state import State

BUDGET = 50.0  # milliseconds for one update during a drag, until a page sets another number
# milliseconds at rest; after each update the pages show its result, and newer edits can start
REST_BUDGET = 250.0


class Updates:
    """Edits of the session, and what was told of the last ones."""

    def __init__(self, session: Session, state: State, publisher: Publisher) -> None:
        self._session, self._state, self._publisher = session, state, publisher
        self.budget: float | None = BUDGET
        self.figures = Figures()
        self._figure: FrameMessage | None = None  # figures of the last update

    def hand_over(self) -> tuple[Wanted, bool]:
        """Queue the edits to the wanted state; return that state, and whether there were any edits."""
        wanted = self._state.wanted
        edits = differences(self._session, wanted.state)
        for key, value in edits.items():
            try:
                queue_edit(self._session, key, value)
            except OptionError as error:
                self._publisher.tell(Refused(key, state_of(self._session)[key], str(error)))
        self._state.handed_over(wanted, bool(edits))
        return wanted, bool(edits)

    def follow(self) -> None:
        """Make one update towards the newest wanted state."""
        self._publisher.set_phase("updating")
        self._go_on(*self.hand_over())

    def count_unreached(self) -> None:
        """Report how many samples no path reached."""
        self._state.counted = self._state.followed
        with suppress(Error, MemoryError):  # this number is not essential
            samples = self._session.unreached
            self._publisher.tell({"type": "unreached", "revision": self._state.counted, "samples": samples})

    def export(self, work: Callable[[Session], None], progress: TaskProgress) -> None:
        """Let `work` write the light of the wanted state, or a session without light."""
        progress("export", 0.0)
        if self._session.baked:
            self._finish()
        work(self._session)

    def read(self, work: Callable[[Session, int, FrameMessage | None], None]) -> None:
        """Let `work` read the light of the wanted state."""
        if not self._state.lit:
            raise OptionError("read: found no light yet, expected some; bake first")
        self._finish()
        work(self._session, self._state.followed, self._figure)

    def _finish(self) -> None:
        """Bring the light to the state that is wanted now, even if newer states are wanted meanwhile."""
        before = self._state.followed
        wanted, fresh = self.hand_over()
        if self._session.unfinished or self._state.unfinished or self._state.followed != before:
            self._publisher.set_phase("updating")
            self._go_on(wanted, fresh)
        while self._state.unfinished:
            if self._state.stopping:
                raise Cancelled("update: the server is being stopped")
            self._go_on(wanted, False)

    def _go_on(self, wanted: Wanted, fresh: bool) -> None:
        """Run one update within the budget, then publish its values and figures."""
        frame = self._session.update(self.budget if wanted.dragging else REST_BUDGET)
        self._state.unfinished = frame.done < 1
        start = time.perf_counter()
        self._publisher.publish(wanted.revision, errors=not wanted.dragging and not self._state.unfinished)
        end = time.perf_counter()
        self._figure = self.figures.of_update(
            self._session,
            frame,
            wanted.revision,
            fresh=fresh,
            publishing=1e3 * (end - start),
            latency=1e3 * (end - wanted.arrival) if fresh else None,
        )
        self._publisher.tell(self._figure)
