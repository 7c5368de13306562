# SPDX-License-Identifier: Apache-2.0
"""Progress of a long task for pages: one fraction and a remaining time, a few times a second."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from .told import ProgressMessage, TaskName

INTERVAL = 0.1  # seconds between two messages
FORESEEABLE = 0.02  # share of the task; before it, the remaining time cannot be estimated

# Share of each stage in the total time, measured on the bundled scenes at default settings.
_OF_DISCS = {
    "bake": {"disc radii": 0.02, "discs": 0.52, "trace paths": 0.38, "direct light": 0.08},
    "check": {"trace paths": 0.87, "direct light": 0.13},
}
_OF_RAYS = {
    "bake": {
        "disc radii": 0.04,
        "discs": 0.04,
        "trace paths": 0.03,
        "direct light": 0.15,
        "share rays": 0.01,
        "look around": 0.73,
    },
    "check": {"trace paths": 0.04, "direct light": 0.16, "look around": 0.8},
}


def shares_of(task: str, options: Mapping[str, Any]) -> Mapping[str, float]:
    """Share of each stage in the time of a "bake" or a "check" of a session with these options."""
    return (_OF_DISCS if options["gather"] == "off" else _OF_RAYS)[task]


class TaskProgress:
    """Progress callback of one task; returns False to stop the work.

    Parameters
    ----------
    task : "bake", "check" or "export"
    tell : receives each message
    stopped : whether the task was cancelled
    """

    def __init__(
        self, task: TaskName, tell: Callable[[ProgressMessage], None], stopped: Callable[[], bool]
    ) -> None:
        self._task, self._tell, self._stopped = task, tell, stopped
        self._start = time.monotonic()
        self._next = 0.0
        self._low, self._high = 0.0, 1.0
        self._shares: Mapping[str, float] = {}
        self._fraction = 0.0

    def part(self, low: float, high: float, shares: Mapping[str, float]) -> None:
        """Set the range of progress that the next work covers, and the shares of its stages."""
        self._low, self._high, self._shares = low, high, shares

    def __call__(self, stage: str, fraction: float) -> bool:
        """Report progress; return whether to continue."""
        now = time.monotonic()
        if now >= self._next and stage:
            self._next = now + INTERVAL
            self._fraction = max(self._fraction, self._total(stage, fraction))
            elapsed = now - self._start
            known = self._fraction >= FORESEEABLE
            eta = elapsed * (1 - self._fraction) / self._fraction if known else None
            self._tell(
                {
                    "type": "progress",
                    "task": self._task,
                    "stage": stage,
                    "fraction": self._fraction,
                    "eta": eta,
                }
            )
        return not self._stopped()

    def _total(self, stage: str, fraction: float) -> float:
        """Share of the task that is done; stages without a share count as taking no time."""
        before = 0.0
        for name, share in self._shares.items():
            if name == stage:
                return self._low + (self._high - self._low) * (before + share * min(fraction, 1.0))
            before += share
        return self._fraction
