# SPDX-License-Identifier: Apache-2.0
"""Progress of a long task for pages: one fraction and a remaining time, a few times a second."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from types import TracebackType

from deltalux import threads
from deltalux.pace import Overall, Step
from deltalux.server.protocol.told import ProgressMessage, TaskName

INTERVAL = 0.1  # seconds between two messages


class TaskProgress:
    """Progress callback of one task; returns False to stop the work.

    While it is entered, pages are told the estimate ten times a second, even while the work reports nothing.

    Parameters
    ----------
    task : "bake", "check", "export" or "read"
    tell : receives each message, on a thread of its own
    stopped : whether the task was cancelled
    """

    def __init__(
        self, task: TaskName, tell: Callable[[ProgressMessage], None], stopped: Callable[[], bool]
    ) -> None:
        self._task, self._tell, self._stopped = task, tell, stopped
        self._overall = Overall()
        self._stage = ""  # that was reported last
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._tell_often, name="deltalux-progress", daemon=True)

    def __enter__(self) -> TaskProgress:
        threads.start(self._thread)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()

    def expect(self, steps: Iterable[Step]) -> None:
        """Set the steps that follow, with their forecasts."""
        self._overall.expect(steps)

    @property
    def unforeseen(self) -> list[str]:
        """Reported stages that belong to no expected step."""
        return self._overall.unforeseen

    def __call__(self, stage: str, fraction: float) -> bool:
        """Record progress; return whether to continue."""
        self._stage = stage or self._stage
        self._overall(stage, fraction)
        return not self._stopped()

    def _tell_often(self) -> None:
        while not self._ended.wait(INTERVAL):
            if not self._stage:
                continue
            now = self._overall.state()
            self._tell(
                {
                    "type": "progress",
                    "task": self._task,
                    "stage": self._stage,
                    "fraction": now.share,
                    "eta": now.remaining,
                }
            )
