# SPDX-License-Identifier: Apache-2.0
"""Direct and indirect irradiance of a session at places that a camera sees, with common progress."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from deltalux.errors import Cancelled
from deltalux.session import Session
from deltalux.session_options import RAY_COUNTS

from .seen import Seen
from .spread import Found


class LightAtPoints:
    """Asks a session for light at places where a camera ray hit a surface; elsewhere the light is 0.

    A stage may need many calls; the session's own progress callback sees the progress of the stage.
    """

    def __init__(self, session: Session, rays: int, keep: bool) -> None:
        self._session, self._rays, self._keep = session, rays, keep
        self._report = session.progress
        self._stage, self._steps, self._done = "", 1, 0

    def begin(self, stage: str, steps: int) -> None:
        """Begin a stage of at most `steps` calls."""
        self._stage, self._steps, self._done = stage, steps, 0
        self._tell()

    def direct(self, seen: Seen) -> Found:
        """Direct light (k, 3); its noise is unknown and counts as 0."""
        points, normals = seen.point[seen.hit], seen.normal[seen.hit]
        session, keep = self._session, self._keep
        return self._at(
            seen, lambda: (session.at(points, normals, part="direct", by_need=True, keep=keep), 0.0)
        )

    def indirect(self, seen: Seen, one_of: int = 1) -> Found:
        """Indirect light (k, 3), and noise of its channels' sum; with one ray in `one_of`, at least 8."""
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
