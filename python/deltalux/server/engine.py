# SPDX-License-Identifier: Apache-2.0
"""The only thread that uses the session: follows the newest wanted state, bakes, checks and exports."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from deltalux import threads
from deltalux.errors import Cancelled, Error, OptionError
from deltalux.memory import return_free_memory
from deltalux.pace import Counts, Step, baking, counts_with, loading, recomputing, summing_up
from deltalux.planning import is_calibrated
from deltalux.session import Session

from .edits import differences, queue_edit, state_of
from .events import Event, Phase, Refined, Refused, Remade, Wanted
from .figures import Figures
from .geometry import Geometry, refined_geometry, remade_geometry
from .known import known_of
from .previews import preview_steps, previews
from .progress import TaskProgress
from .remaking import Remake, samples_like
from .told import FrameMessage, PhaseName, TaskName
from .values import Encoder, VertexFill, fill_of

BUDGET = 50.0  # milliseconds for one update during a drag, until a page sets another number
# milliseconds at rest; after each update the pages show its result, and newer edits can start
REST_BUDGET = 250.0
# seconds to wait for the next pose of a drag, before continuing with the present one
GRACE = 0.02
# seconds at rest before the drawn mesh is refined where shadows lie now
CALM = 0.5

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Task:
    name: TaskName
    work: Callable[[TaskProgress], None]
    failed: Callable[[str], None] | None = None  # receives the reason, if somebody waits for an answer

    @property
    def long(self) -> bool:
        """Whether further tasks are refused while this one runs; otherwise they wait."""
        return self.name in ("bake", "check")


class Engine:
    """Owns a session and the thread that uses it.

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
        self._session, self._tell, self._shown = session, tell, shown
        # revision whose values were not sent, because no page displayed them
        self._unpublished: int | None = None
        self._figure: FrameMessage | None = None  # figures of the last update
        self._own_progress = session.progress  # the user's callback, restored at the end
        self._changed = threading.Condition()
        # Edits and paths left from before the start are processed like a page's first request.
        self.first_revision = int(session.unfinished)
        self._wanted = Wanted(state_of(session), self.first_revision)
        self._budget: float | None = BUDGET
        self._followed = 0  # revision whose edits were handed to the session
        # edits handed over are not fully published, and the engine may continue with them now
        self._unfinished = False
        self._failed = False  # whether the last update, or publishing it, failed
        self._tasks: deque[_Task] = deque()
        self._at_work: _Task | None = None
        self._cancelled = self._stopping = False
        self._phase = ""
        self._counted = -1  # last revision whose number of unreached samples was reported
        self._figures = Figures()
        self._fill: VertexFill | None = None
        self._encoder: Encoder | None = None
        self._errors: np.ndarray | None = None  # standard errors that the pages display
        self._geometry = geometry
        # revision whose shadows the drawn mesh was refined for
        self._refined: int | None = None
        self._thread = threading.Thread(target=self._run, name="deltalux-engine", daemon=True)

    # ---- for other threads --------------------------------------------------------------------

    def start(self) -> None:
        """Publish the session's light; bake first if it has none, or that of another build."""
        self._session.progress = None
        self._tasks.append(_Task("bake", self._begin))
        threads.start(self._thread)

    def stop(self) -> None:
        """Stop the present work and end the thread."""
        with self._changed:
            self._stopping = self._cancelled = True
            self._changed.notify()
        self._thread.join()
        self._session.progress = self._own_progress

    def want(self, wanted: Wanted) -> None:
        """Follow this state from now on; earlier states that were not reached yet are skipped."""
        with self._changed:
            self._wanted = wanted
            self._changed.notify()

    def show(self, shown: bool) -> None:
        """Set whether any page displays values; if not, none are encoded, which can outlast an update."""
        with self._changed:
            self._shown = shown
            self._changed.notify()

    def set_budget(self, milliseconds: float | None) -> None:
        """Set the time for one update during a drag; None = without limit."""
        with self._changed:
            self._budget = milliseconds

    @property
    def budget(self) -> float | None:
        """Milliseconds for one update during a drag."""
        return self._budget

    def bake(self) -> None:
        """Request a bake; OptionError while a bake or check runs, or another task waits."""
        self._admit(_Task("bake", self._bake))

    def remake(self, remake: Remake) -> None:
        """Request a bake of another version of the scene; OptionError as for `bake`."""
        self._admit(_Task("bake", lambda progress: self._remake(remake, progress)))

    def check(self) -> None:
        """Request a recompute and a comparison of digests; OptionError as for `bake`."""
        self._admit(_Task("check", self._check))

    def export(self, work: Callable[[Session], None]) -> None:
        """Run `work` between updates; OptionError as for `bake`."""
        self._admit(_Task("export", lambda progress: self._export(work, progress)))

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
            self._tasks.append(_Task("read", lambda _: self._read(work), failed))
            self._changed.notify()

    def cancel(self) -> None:
        """Stop the bake or check that runs or waits for its turn; OptionError if there is none."""
        with self._changed:
            if self._long_work() is not None:
                self._cancelled = True
                return
            waiting = next((place for place, task in enumerate(self._tasks) if task.long), None)
            if waiting is None:
                raise OptionError("cancel: found no bake and no check at work")
            self._tasks[waiting] = replace(self._tasks[waiting], work=_give_up)

    def _long_work(self) -> _Task | None:
        """The running bake or check; other tasks are short, so new requests wait for them."""
        return self._at_work if self._at_work and self._at_work.long else None

    def _admit(self, task: _Task) -> None:
        with self._changed:
            waiting = (other for other in self._tasks if other.name != "read")
            if busy := next(waiting, self._long_work()):
                raise OptionError(
                    f"{task.name}: found the {busy.name} still at work, expected none; wait, or cancel it"
                )
            if task.name != "bake" and self._session.foreign_build is not None:
                raise OptionError(
                    f"{task.name}: found the light of another build, expected this one's; bake first"
                )
            self._tasks.append(task)
            self._changed.notify()

    # ---- the thread ---------------------------------------------------------------------------

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(self._has_work)
                # if an update started now, the drag's next pose would have to wait for its end
                if self._wanted.dragging:
                    self._changed.wait_for(self._is_asked, GRACE)
                elif self._only_coarse():
                    self._changed.wait_for(self._is_asked, CALM)
                if self._stopping:
                    return
                self._at_work = self._tasks.popleft() if self._tasks else None
                self._cancelled = False
            try:
                if self._at_work:
                    with self._progress(self._at_work.name) as progress:
                        self._at_work.work(progress)
                elif self._lit() and self._behind():
                    self._follow()
                elif self._unseen():
                    self._show_again()
                elif self._only_coarse():
                    self._refine()
            except Cancelled:
                task = self._at_work
                self._tell({"type": "cancelled", "task": task.name if task else "update"})
                if task and task.failed:
                    task.failed(f"{task.name}: the server is being stopped")
            except Exception as error:
                self._report(error)
            if self._at_work and self._at_work.name != "read":
                return_free_memory()
            with self._changed:
                self._at_work = None
            self._session.progress = None
            self._set_phase(self._resting_phase())
            with suppress(Error, MemoryError):  # this number is not essential
                self._tell_unreached()

    def _lit(self) -> bool:
        """Whether updates are possible: the session has light, and this build computed it."""
        return self._session.baked and self._session.foreign_build is None

    def _has_work(self) -> bool:
        return self._is_asked() or self._only_coarse() or (self._lit() and (self._behind() or self._unseen()))

    def _is_asked(self) -> bool:
        """Whether there is a new request."""
        news = self._lit() and self._wanted.revision != self._followed
        return self._stopping or bool(self._tasks) or news

    def _behind(self) -> bool:
        return self._unfinished or self._wanted.revision != self._followed

    def _unseen(self) -> bool:
        """Whether a page now displays values that were not sent."""
        return self._shown and self._unpublished is not None

    def _only_coarse(self) -> bool:
        """Whether nothing is left to do but to refine what is drawn where shadows lie now."""
        if self._geometry is None or not self._shown or self._is_asked() or not self._lit():
            return False
        if self._wanted.dragging or self._behind() or self._unseen() or self._failed:
            return False
        display = self._session.samples.display
        refines = display is not None and display.refinement is not None
        return refines and self._session.options["gather"] != "off" and self._refined != self._followed

    def _resting_phase(self) -> PhaseName:
        if not self._lit():
            return "empty"
        if self._behind():
            return "updating"
        return "failed" if self._failed or self._session.unfinished else "ready"

    def _set_phase(self, name: PhaseName) -> None:
        if name != self._phase:
            self._phase = name
            self._tell(Phase(name))

    def _progress(self, task: TaskName) -> TaskProgress:
        return TaskProgress(task, self._tell, lambda: self._cancelled)

    def _report(self, error: Exception) -> None:
        """Report an error to all pages; a failed update is retried with the next edit, not earlier."""
        if self._at_work is None:
            self._failed, self._unfinished = True, False
            self._followed = self._wanted.revision
        if not isinstance(error, (Error, OSError, MemoryError)):
            log.error("the engine failed", exc_info=error)
        text = str(error) if isinstance(error, (Error, OSError)) else f"{type(error).__name__}: {error}"
        task = self._at_work.name if self._at_work else "update"
        if self._at_work and self._at_work.failed:
            self._at_work.failed(text)
        else:
            self._tell({"type": "notice", "message": f"{task} failed: {text}"})

    def _publish(self, revision: int, session: Session | None = None, *, errors: bool = True) -> None:
        """Send the values of the engine's session, or of `session`, the temporary session of a preview.

        Without `errors` the standard errors that were sent last are sent again.
        """
        if not self._shown:
            self._unpublished, self._failed = revision, False
            return
        self._unpublished = None
        if self._fill is None or self._encoder is None:
            self._fill = fill_of(self._session, self._geometry.drawn if self._geometry else None)
            self._encoder = Encoder(self._fill)
        rest = errors and session is None and not self._wanted.dragging
        errors = errors or self._errors is None
        shown = session or self._session
        values = shown.read_packed() if errors else shown.glance()
        if errors:
            self._errors = values[:, 3].copy()
            # During a drag, shadows keep the detail that they had at rest.
            beyond = None if session else shown.direct_beyond_samples()
            self._encoder.use(replace(self._fill, beyond=beyond))
        else:
            values[:, 3] = self._errors
        self._tell(self._encoder.encode(values, revision, preview=session is not None, rest=rest))
        self._failed = False

    def _show_again(self) -> None:
        """Send values that no page displayed when they were new; a failed update stays marked as failed."""
        failed = self._failed
        self._publish(self._unpublished or 0)
        self._failed = failed

    def _tell_unreached(self) -> None:
        """At rest, report how many samples no path reached; in a drag, counting would delay the next pose."""
        wanted = self._wanted
        at_rest = self._phase == "ready" and wanted.revision == self._followed and not wanted.dragging
        if at_rest and self._counted != self._followed:
            self._counted = self._followed
            samples = self._session.unreached
            self._tell({"type": "unreached", "revision": self._counted, "samples": samples})

    # ---- what it does -------------------------------------------------------------------------

    def _hand_over(self) -> tuple[Wanted, bool]:
        """Queue the edits to the wanted state; return that state, and whether there were any edits."""
        with self._changed:
            wanted = self._wanted
        edits = differences(self._session, wanted.state)
        for key, value in edits.items():
            try:
                queue_edit(self._session, key, value)
            except OptionError as error:
                self._tell(Refused(key, state_of(self._session)[key], str(error)))
        self._followed = wanted.revision
        self._unfinished = self._unfinished or bool(edits)  # until published, even if the work is cancelled
        return wanted, bool(edits)

    def _follow(self) -> None:
        """Make one update towards the newest wanted state."""
        self._set_phase("updating")
        self._go_on(*self._hand_over())

    def _go_on(self, wanted: Wanted, fresh: bool) -> None:
        """Run one update within the budget, then publish its values and figures."""
        frame = self._session.update(self._budget if wanted.dragging else REST_BUDGET)
        self._unfinished = frame.done < 1
        start = time.perf_counter()
        self._publish(wanted.revision, errors=not wanted.dragging and not self._unfinished)
        end = time.perf_counter()
        self._figure = self._figures.of_update(
            self._session,
            frame,
            wanted.revision,
            fresh=fresh,
            publishing=1e3 * (end - start),
            latency=1e3 * (end - wanted.arrival) if fresh else None,
        )
        self._tell(self._figure)

    def _finish(self) -> None:
        """Bring the light to the state that is wanted now, even if newer states are wanted meanwhile."""
        before = self._followed
        wanted, fresh = self._hand_over()
        if self._session.unfinished or self._unfinished or self._followed != before:
            self._set_phase("updating")
            self._go_on(wanted, fresh)
        while self._unfinished:
            if self._stopping:
                raise Cancelled("update: the server is being stopped")
            self._go_on(wanted, False)

    def _begin(self, progress: TaskProgress) -> None:
        """Publish the light of a baked session, which precedes queued edits, or bake."""
        if self._session.baked:
            self._publish(0)
        if self._lit():
            self._figures.read_methods(self._session)
        else:
            self._bake(progress)

    def _refine(self) -> None:
        """Refine the mesh that is drawn where shadows lie now; given up once somebody wants something."""
        revision, before = self._followed, self._session.samples
        assert before.display is not None and self._geometry is not None
        self._session.progress = lambda *_: not self._is_asked()
        try:
            self._session.refine()
            display = self._session.samples.display
            assert display is not None
            geometry = fill = None
            if not display.same_triangles(before.display):
                geometry = refined_geometry(self._geometry, self._session)
                fill = fill_of(self._session, geometry.drawn)
        except Cancelled:
            return
        except (Error, MemoryError) as error:
            self._session.samples = before  # that of the mesh that pages go on to draw
            self._refined = revision
            log.warning("shadows stay as coarse as they are drawn: %s", error)
            return
        self._refined = revision
        if geometry and fill:
            self._geometry, self._fill, self._encoder = geometry, fill, Encoder(fill)
            self._tell(Refined(geometry))
            self._publish(revision)
            return_free_memory()

    def _bake(self, progress: TaskProgress) -> None:
        """Compute everything; if there is no light yet, publish coarse previews first."""
        self._set_phase("baking")
        wanted, _ = self._hand_over()
        steps = _bake_steps(_counts(self._session))
        if self._session.baked:
            progress.expect(steps)
        else:
            progress.expect([*preview_steps(self._session), *steps])
            for coarse in previews(self._session, wanted.state, progress):
                self._publish(wanted.revision, coarse)
                self._set_phase("preview")
        self._session.progress = progress
        start = time.perf_counter()
        frame = self._session.bake()
        seconds = time.perf_counter() - start
        self._unfinished = False
        progress("sum up", 0.0)
        self._publish(wanted.revision)
        self._tell(self._figures.of_bake(self._session, frame, wanted.revision, seconds))

    def _remake(self, remake: Remake, progress: TaskProgress) -> None:
        """Bake another version of the scene in the wanted state; until then the light stays as it is."""
        self._set_phase("baking")
        wanted, _ = self._hand_over()
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
        self._unfinished, self._refined, self._unpublished = False, None, None
        self._fill = self._encoder = self._errors = None
        if self._geometry is not None:
            self._geometry = remade_geometry(self._geometry, session)
        progress("sum up", 0.0)
        self._tell(Remade(known_of(session), self._geometry, remake))
        self._publish(wanted.revision)
        self._tell(self._figures.of_bake(session, frame, wanted.revision, seconds))

    def _check(self, progress: TaskProgress) -> None:
        """Recompute everything and compare the digests."""
        self._set_phase("checking")
        self._hand_over()
        session = self._session
        progress.expect(recomputing(_counts(session)))
        session.progress = progress
        digest = self._session.digest()
        start = time.perf_counter()
        self._session.recompute()
        milliseconds = 1e3 * (time.perf_counter() - start)
        recomputed = self._session.digest()
        self._unfinished = False
        self._figures.recompute_milliseconds = milliseconds
        self._publish(self._followed)
        self._tell(
            {
                "type": "checked",
                "same": digest == recomputed,
                "digest": digest,
                "recomputed": recomputed,
                "milliseconds": milliseconds,
            }
        )

    def _export(self, work: Callable[[Session], None], progress: TaskProgress) -> None:
        progress("export", 0.0)
        if self._session.baked:
            self._finish()
        work(self._session)

    def _read(self, work: Callable[[Session, int, FrameMessage | None], None]) -> None:
        if not self._lit():
            raise OptionError("read: found no light yet, expected some; bake first")
        self._finish()
        work(self._session, self._followed, self._figure)


def _give_up(_: TaskProgress) -> None:
    """Work of a task that was cancelled before its turn."""
    raise Cancelled("cancelled before it began")


def _counts(session: Session) -> Counts:
    return counts_with(session.scene, session.samples, session.options)


def _bake_steps(counts: Counts) -> list[Step]:
    """Steps of a bake and of publishing its values."""
    return [*baking(counts, is_calibrated()), *summing_up(counts)]
