# SPDX-License-Identifier: Apache-2.0
"""The only thread that uses the session, and how other threads ask for what it does."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from deltalux import threads
from deltalux.errors import Cancelled, Error, OptionError
from deltalux.memory import return_free_memory
from deltalux.server.drawn.geometry import Geometry
from deltalux.server.edits import state_of
from deltalux.server.protocol.told import FrameMessage
from deltalux.session import Session

from .bakes import Bakes
from .events import Event, Wanted
from .progress import TaskProgress
from .publishing import Publisher
from .remaking import Remake
from .state import State, Work, is_asked, next_work, pause, phase
from .tasks import Task
from .updates import Updates

log = logging.getLogger(__name__)


class Engine:
    """Owns a session and the thread that uses it: follows the newest wanted state, bakes, checks, exports.

    Parameters
    ----------
    session : Session
        Nobody else may use the session from `start` until `stop` has returned.
    tell : receives events, on the engine's thread
    shown : whether any page displays values, see `show`
    geometry : what pages draw at first; None: there are no pages
    """

    def __init__(
        self,
        session: Session,
        tell: Callable[[Event], None],
        shown: bool = True,
        geometry: Geometry | None = None,
    ) -> None:
        self._session, self._tell = session, tell
        self._own_progress = session.progress  # the user's callback, restored at the end
        # Edits and paths left from before the start are processed like a page's first request.
        self.first_revision = int(session.unfinished)
        self.state = State(Wanted(state_of(session), self.first_revision), shown)
        self._changed = threading.Condition()  # guards the state
        self._publisher = Publisher(session, self.state, tell, geometry)
        self._updates = Updates(session, self.state, self._publisher)
        self._bakes = Bakes(session, self.state, self._publisher, self._updates)
        self._works: dict[Work, Callable[[], None]] = {
            "follow": self._updates.follow,
            "show": self._publisher.show_again,
            "count": self._updates.count_unreached,
            "refine": lambda: self._publisher.refine(lambda: is_asked(self.state)),
        }
        self._thread = threading.Thread(target=self._run, name="deltalux-engine", daemon=True)

    # ---- for other threads --------------------------------------------------------------------

    def start(self) -> None:
        """Publish the session's light; bake first if it has none, or that of another build."""
        self._session.progress = None
        self._read_facts()
        self.state.tasks.add(Task("bake", self._bakes.begin))
        threads.start(self._thread)

    def stop(self) -> None:
        """Stop the present work and end the thread."""
        with self._changed:
            self.state.stopping = self.state.tasks.cancelled = True
            self._changed.notify()
        self._thread.join()
        self._session.progress = self._own_progress

    def want(self, wanted: Wanted) -> None:
        """Follow this state from now on; earlier states that were not reached yet are skipped."""
        with self._changed:
            self.state.wanted = wanted
            self._changed.notify()

    def show(self, shown: bool) -> None:
        """Set whether any page displays values; if not, none are encoded, which can outlast an update."""
        with self._changed:
            self.state.shown = shown
            self._changed.notify()

    def set_budget(self, milliseconds: float | None) -> None:
        """Set the time for one update during a drag; None = without limit."""
        self._updates.budget = milliseconds

    @property
    def budget(self) -> float | None:
        """Milliseconds for one update during a drag."""
        return self._updates.budget

    def bake(self) -> None:
        """Request a bake; OptionError while a bake or check runs, or another task waits."""
        self._admit(Task("bake", self._bakes.bake))

    def remake(self, remake: Remake) -> None:
        """Request a bake of another version of the scene; OptionError as for `bake`."""
        self._admit(Task("bake", lambda progress: self._bakes.remake(remake, progress)))

    def check(self) -> None:
        """Request a recompute and a comparison of digests; OptionError as for `bake`."""
        self._admit(Task("check", self._bakes.check))

    def export(self, work: Callable[[Session], None]) -> None:
        """Run `work` between updates; OptionError as for `bake`."""
        self._admit(Task("export", lambda progress: self._updates.export(work, progress)))

    def at_rest(
        self, work: Callable[[Session, int, FrameMessage | None], None], failed: Callable[[str], None]
    ) -> None:
        """Run `work` once the light belongs to the wanted state, after the tasks requested before.

        Parameters
        ----------
        work : receives the session, the revision of its light and the figures of the update that led to it
        failed : receives the reason if that is impossible
        """
        with self._changed:
            self.state.tasks.add(Task("read", lambda _: self._updates.read(work), failed))
            self._changed.notify()

    def cancel(self) -> None:
        """Stop the bake or check that runs or waits for its turn; OptionError if there is none."""
        with self._changed:
            self.state.tasks.cancel()

    def _admit(self, task: Task) -> None:
        with self._changed:
            self.state.tasks.refuse_if_busy(task.name)
            if task.name != "bake" and self._session.foreign_build is not None:
                raise OptionError(
                    f"{task.name}: found the light of another build, expected this one's; bake first"
                )
            self.state.tasks.add(task)
            self._changed.notify()

    # ---- the thread ---------------------------------------------------------------------------

    def _run(self) -> None:
        state = self.state
        while True:
            with self._changed:
                self._changed.wait_for(lambda: next_work(state))
                self._changed.wait_for(lambda: is_asked(state), pause(state))
                work = next_work(state)
                if work == "stop":
                    return
                task = state.tasks.begin() if work == "task" else None
            try:
                if task:
                    self._perform(task)
                elif work:  # none if it became needless during the pause
                    self._works[work]()
            except Cancelled:
                self._tell({"type": "cancelled", "task": task.name if task else "update"})
                if task and task.failed:
                    task.failed(f"{task.name}: the server is being stopped")
            except Exception as error:
                self._report(error, task)
            if task and task.name != "read":
                return_free_memory()
            with self._changed:
                state.tasks.end()
            self._session.progress = None
            self._read_facts()
            self._publisher.set_phase(phase(state))

    def _perform(self, task: Task) -> None:
        with TaskProgress(task.name, self._tell, lambda: self.state.tasks.cancelled) as progress:
            task.work(progress)

    def _read_facts(self) -> None:
        """Record what the table asks of the session, which only the thread's work changes."""
        session, state = self._session, self.state
        display = session.samples.display
        follows_shadows = display is not None and display.refinement is not None
        drawn = self._publisher.geometry is not None
        state.lit = session.baked and session.foreign_build is None
        state.pending = session.unfinished
        state.refinable = drawn and follows_shadows and session.options["gather"] != "off"

    def _report(self, error: Exception, task: Task | None) -> None:
        """Report an error to all pages, or to the one who waits for the task."""
        if task is None:
            self.state.give_up()
        if not isinstance(error, (Error, OSError, MemoryError)):
            log.error("the engine failed", exc_info=error)
        text = str(error) if isinstance(error, (Error, OSError)) else f"{type(error).__name__}: {error}"
        if task and task.failed:
            task.failed(text)
        else:
            self._tell({"type": "notice", "message": f"{task.name if task else 'update'} failed: {text}"})
