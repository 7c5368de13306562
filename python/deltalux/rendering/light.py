# SPDX-License-Identifier: Apache-2.0
"""Direct and indirect irradiance of a session at places that a camera sees."""

from __future__ import annotations

import numpy as np

from deltalux.session import Session

from .seen import Seen


class PointLight:
    """Asks a session for light where something is hit; elsewhere it is dark."""

    def __init__(self, session: Session, rays: int | None) -> None:
        self._session, self._rays = session, rays

    def direct(self, seen: Seen) -> np.ndarray:
        """(k, 3)."""
        return self._at(seen, "direct", None)

    def indirect(self, seen: Seen) -> np.ndarray:
        """(k, 3)."""
        return self._at(seen, "indirect", self._rays)

    def _at(self, seen: Seen, part: str, rays: int | None) -> np.ndarray:
        values = np.zeros((len(seen), 3))
        if seen.hit.any():
            values[seen.hit] = self._session.at(
                seen.point[seen.hit], seen.normal[seen.hit], part=part, rays=rays, by_need=True
            )
        return values
