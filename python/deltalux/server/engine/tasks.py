# SPDX-License-Identifier: Apache-2.0
"""Tasks that were requested, in their order; the engine's lock guards them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

from deltalux.errors import Cancelled, OptionError
from deltalux.server.protocol.told import TaskName

from .progress import TaskProgress


@dataclass(frozen=True)
class Task:
    """Work that somebody requested, which reports progress."""

    name: TaskName
    work: Callable[[TaskProgress], None]
    failed: Callable[[str], None] | None = None  # receives the reason, if somebody waits for an answer

    @property
    def long(self) -> bool:
        """Whether further tasks are refused while this one runs; otherwise they wait."""
        return self.name in ("bake", "check")


class Tasks:
    """The task at work, and those that wait for their turn."""

    def __init__(self) -> None:
        self._waiting: deque[Task] = deque()
        self.at_work: Task | None = None
        self.cancelled = False  # whether the task at work is to stop

    def __bool__(self) -> bool:
        """Whether any task waits."""
        return bool(self._waiting)

    def add(self, task: Task) -> None:
        """Let `task` wait for its turn."""
        self._waiting.append(task)

    def refuse_if_busy(self, name: TaskName) -> None:
        """Raise OptionError if a bake or check runs, or a task other than a reading waits."""
        waiting = (other for other in self._waiting if other.name != "read")
        if busy := next(waiting, self._long_work()):
            raise OptionError(
                f"{name}: found the {busy.name} still at work, expected none; wait, or cancel it"
            )

    def cancel(self) -> None:
        """Stop the bake or check that runs or waits for its turn; OptionError if there is none."""
        if self._long_work() is not None:
            self.cancelled = True
            return
        waiting = next((place for place, task in enumerate(self._waiting) if task.long), None)
        if waiting is None:
            raise OptionError("cancel: found no bake and no check at work")
        self._waiting[waiting] = replace(self._waiting[waiting], work=_give_up)

    def begin(self) -> Task:
        """Take the next task to work."""
        self.at_work, self.cancelled = self._waiting.popleft(), False
        return self.at_work

    def end(self) -> None:
        """Nothing is at work any more."""
        self.at_work = None

    def _long_work(self) -> Task | None:
        """The running bake or check; other tasks are short, so new requests wait for them."""
        return self.at_work if self.at_work and self.at_work.long else None


def _give_up(_: TaskProgress) -> None:
    """Work of a task that was cancelled before its turn."""
    raise Cancelled("cancelled before it began")
