# SPDX-License-Identifier: Apache-2.0
"""What is asked of the engine and how far its work is; a table answers what comes next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from deltalux.server.protocol.told import PhaseName

from .events import Wanted
from .tasks import Tasks

# seconds to wait for the next pose of a drag, before continuing with the present one
GRACE = 0.02
# seconds at rest before the drawn mesh is refined where shadows lie now
CALM = 0.5

Work = Literal["stop", "task", "follow", "show", "count", "refine"]


@dataclass
class State:
    """Requests of other threads, facts of the session, and how far the light follows; knows no thread."""

    # ---- requests
    wanted: Wanted
    shown: bool = True  # whether any page displays values
    stopping: bool = False
    tasks: Tasks = field(default_factory=Tasks)

    # ---- facts of the session, read between two pieces of work
    lit: bool = False  # it has light, and this build computed it
    pending: bool = False  # it has edits or paths to process
    refinable: bool = False  # pages draw a mesh that follows shadows

    # ---- how far the light is
    followed: int = 0  # revision whose edits were handed to the session
    unfinished: bool = False  # edits handed over are not fully published
    failed: bool = False  # the last update, or publishing it, failed
    unpublished: int | None = None  # revision whose values were not sent, because no page displayed them
    counted: int = -1  # last revision whose number of unreached samples was reported
    refined: int | None = None  # revision whose shadows the drawn mesh was refined for

    @property
    def news(self) -> bool:
        """Whether a state is wanted that was not handed to the session."""
        return self.wanted.revision != self.followed

    def handed_over(self, wanted: Wanted, edits: bool) -> None:
        """The session has this state; `edits`: whether there were any.

        They count as unfinished until they are published, even if the work is cancelled.
        """
        self.followed = wanted.revision
        self.unfinished = self.unfinished or edits

    def kept_back(self, revision: int) -> None:
        """There are values that no page displays yet."""
        self.unpublished, self.failed = revision, False

    def give_up(self) -> None:
        """The light stays as it is; a failed update is retried with the next edit, not earlier."""
        self.failed, self.unfinished = True, False
        self.followed = self.wanted.revision


class Row(NamedTuple):
    """What to do in states for which no earlier row holds."""

    holds: Callable[[State], bool]
    work: Work | None  # None: wait for a request
    asked: bool = False  # somebody waits for it, so it starts at once
    phase: PhaseName | None = None  # told before it starts; None: that of a later row


TABLE = (
    Row(lambda s: s.stopping, "stop", asked=True),
    Row(lambda s: bool(s.tasks), "task", asked=True),
    Row(lambda s: not s.lit, None, phase="empty"),
    Row(lambda s: s.news, "follow", asked=True, phase="updating"),
    Row(lambda s: s.unfinished, "follow", phase="updating"),
    Row(lambda s: s.shown and s.unpublished is not None, "show"),
    Row(lambda s: s.failed or s.pending, None, phase="failed"),
    Row(
        lambda s: s.wanted.dragging, None, phase="ready"
    ),  # the next pose would have to wait for what follows
    Row(lambda s: s.counted != s.followed, "count", phase="ready"),
    Row(lambda s: s.shown and s.refinable and s.refined != s.followed, "refine", phase="ready"),
    Row(lambda _: True, None, phase="ready"),
)


def next_work(state: State) -> Work | None:
    """The next piece of work; None: there is none until somebody requests something."""
    return _row(state).work


def is_asked(state: State) -> bool:
    """Whether there is a request that was not begun."""
    return _row(state).asked


def pause(state: State) -> float:
    """Seconds to wait for a request before the next piece of work starts.

    If an update started at once, the drag's next pose would have to wait for its end.
    """
    row = _row(state)
    if row.asked:
        return 0.0
    if state.wanted.dragging:
        return GRACE
    return CALM if row.work == "refine" else 0.0


def phase(state: State) -> PhaseName:
    """What pages are told between two pieces of work; tasks tell more when they begin."""
    return next(row.phase for row in TABLE if row.phase and row.holds(state))


def _row(state: State) -> Row:
    return next(row for row in TABLE if row.holds(state))
