# SPDX-License-Identifier: Apache-2.0
"""Direct and indirect irradiance of a session at places that a camera sees, with progress of all asked."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from deltalux.core_session import RAY_COUNTS
from deltalux.errors import Cancelled
from deltalux.session import Session

from .seen import Seen
from .spread import Found


class PointLight:
    """Asks a session for light where something is hit; elsewhere it is dark.

    The session's own callback hears of stages that many calls make up.
    """

    def __init__(self, session: Session, rays: int, keep: bool) -> None:
        self._session, self._rays, self._keep = session, rays, keep
        self._report = session.progress
        self._stage, self._steps, self._done = "", 1, 0

    def begin(self, stage: str, steps: int) -> None:
        """What follows is a stage of at most so many calls."""
        self._stage, self._steps, self._done = stage, steps, 0
        self._tell()

    def direct(self, seen: Seen) -> Found:
        """Light (k, 3) without noise that is known."""
        points, normals = seen.point[seen.hit], seen.normal[seen.hit]
        session, keep = self._session, self._keep
        return self._at(
            seen, lambda: (session.at(points, normals, part="direct", by_need=True, keep=keep), 0.0)
        )

    def indirect(self, seen: Seen, one_of: int = 1) -> Found:
        """Light (k, 3), and noise of the sum of its channels; by fewer rays for one of several places."""
        points, normals = seen.point[seen.hit], seen.normal[seen.hit]
        rays = max(RAY_COUNTS[0], self._rays // one_of)
        return self._at(seen, lambda: self._session.indirect_at(points, normals, rays, self._keep))

    def _at(self, seen: Seen, ask: Callable[[], tuple[np.ndarray, np.ndarray | float]]) -> Found:
        values, noise = np.zeros((len(seen), 3)), np.zeros(len(seen))
        if seen.hit.any():
            self._session.progress = self._heard if self._report else None
            try:
                values[seen.hit], noise[seen.hit] = ask()
            finally:
                self._session.progress = self._report
        self._done += 1
        self._tell()
        return values, noise

    def _heard(self, _: str, fraction: float) -> bool:
        report = self._report
        return report is None or report(self._stage, min(1.0, (self._done + fraction) / self._steps))

    def _tell(self) -> None:
        if not self._heard("", 0.0):
            raise Cancelled("render: cancelled; the session is as it was")
