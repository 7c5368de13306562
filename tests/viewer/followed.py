# SPDX-License-Identifier: Apache-2.0
"""An engine and what it tells, for tests without pages."""

from __future__ import annotations

import queue
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import deltalux as dl
import numpy as np
import pytest
from deltalux.server.drawn.geometry import Geometry
from deltalux.server.drawn.values import Values, fill_of
from deltalux.server.edits import pose_numbers, state_of
from deltalux.server.engine import Engine
from deltalux.server.engine.events import Event, Phase, Wanted

from viewer.page_client import TIMEOUT, decoded


class Followed:
    """An engine at work on a session, and what it has told so far."""

    def __init__(self, session: dl.Session, geometry: Geometry | None = None) -> None:
        self.session = session
        self.events: queue.Queue[Event] = queue.Queue()
        self.seen: list[Event] = []
        self.state = state_of(session)
        self.engine = Engine(session, self.events.put, geometry=geometry)
        self.revision = self.engine.first_revision

    def __enter__(self) -> Followed:
        self.engine.start()
        return self

    def __exit__(self, *_: Any) -> None:
        self.engine.stop()

    def until(self, wanted: Callable[[Event], bool]) -> Event:
        """Take events up to the first one that `wanted` likes."""
        while True:
            event = self.events.get(timeout=TIMEOUT)
            self.seen.append(event)
            if wanted(event):
                return event

    def until_phase(self, name: str) -> None:
        """Take events up to this phase."""
        self.until(lambda e: e == Phase(name))

    def want(self, dragging: bool = False, **changes: np.ndarray) -> None:
        """Poses by the movable's name."""
        for name, pose in changes.items():
            self.state["pose", name] = pose_numbers(pose)
        self.revision += 1
        self.engine.want(Wanted(dict(self.state), self.revision, dragging))

    def rest(self) -> None:
        """Wait until the present revision is done."""
        self.until(lambda e: is_message(e, "frame") and (e["revision"], e["done"]) == (self.revision, 1))
        self.until_phase("ready")

    def of(self, kind: type) -> list[Any]:
        """The events of a type."""
        return [e for e in self.seen if isinstance(e, kind)]

    @property
    def phases(self) -> list[str]:
        """The phases so far."""
        return [e.name for e in self.of(Phase)]


def is_message(event: Event, kind: str) -> bool:
    """Whether it is a message of that type."""
    return isinstance(event, dict) and event["type"] == kind


def assert_shown(session: dl.Session, values: Values) -> None:
    """The values are the light of the session, which must be at rest."""
    fill = replace(fill_of(session), beyond=session.direct_beyond_samples())
    expected = fill(session.irradiance)
    found = decoded(values.rows, values.scale)[:, :3]
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-4 * expected.max())
