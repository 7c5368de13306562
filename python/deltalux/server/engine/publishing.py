# SPDX-License-Identifier: Apache-2.0
"""Sends pages the session's light, and the mesh that it is drawn on."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from deltalux.errors import Cancelled, Error
from deltalux.memory import return_free_memory
from deltalux.server.drawn.geometry import Geometry, refined_geometry, remade_geometry
from deltalux.server.drawn.values import Encoder, VertexFill, fill_of
from deltalux.server.protocol.told import PhaseName
from deltalux.session import Session

from .events import Event, Phase, Refined
from .state import State

log = logging.getLogger(__name__)


class Publisher:
    """What pages display of the session.

    Parameters
    ----------
    tell : receives events
    geometry : what pages draw at first; None: there are no pages
    """

    def __init__(
        self, session: Session, state: State, tell: Callable[[Event], None], geometry: Geometry | None
    ) -> None:
        self._session, self._state, self.tell = session, state, tell
        self.geometry = geometry
        self._phase = ""
        self._fill: VertexFill | None = None
        self._encoder: Encoder | None = None
        self._errors: np.ndarray | None = None  # standard errors that the pages display

    def set_phase(self, name: PhaseName) -> None:
        """Tell what the engine is doing, unless pages know it."""
        if name != self._phase:
            self._phase = name
            self.tell(Phase(name))

    def publish(self, revision: int, preview: Session | None = None, *, errors: bool = True) -> None:
        """Send the values of the session, or of `preview`, a temporary one.

        Without `errors` the standard errors that were sent last are sent again.
        """
        if not self._state.shown:
            self._state.kept_back(revision)
            return
        self._state.unpublished = None  # also if reading fails: the next edit tries again
        if self._fill is None or self._encoder is None:
            self._fill = fill_of(self._session, self.geometry.drawn if self.geometry else None)
            self._encoder = Encoder(self._fill)
        rest = errors and preview is None and not self._state.wanted.dragging
        errors = errors or self._errors is None
        shown = preview or self._session
        values = shown.read_packed() if errors else shown.glance()
        if errors:
            self._errors = values[:, 3].copy()
            # During a drag, shadows keep the detail that they had at rest.
            beyond = None if preview else shown.direct_beyond_samples()
            self._encoder.use(replace(self._fill, beyond=beyond))
        else:
            values[:, 3] = self._errors
        self.tell(self._encoder.encode(values, revision, preview=preview is not None, rest=rest))
        self._state.failed = False

    def show_again(self) -> None:
        """Send values that no page displayed when they were new; a failed update stays marked as failed."""
        failed = self._state.failed
        self.publish(self._state.unpublished or 0)
        self._state.failed = failed

    def start_over(self) -> None:
        """Describe another version of the scene, which the session now has; its light is sent later."""
        self._state.refined = self._state.unpublished = None
        self._fill = self._encoder = self._errors = None
        if self.geometry is not None:
            self.geometry = remade_geometry(self.geometry, self._session)

    def refine(self, stopped: Callable[[], bool]) -> None:
        """Refine the mesh that is drawn where shadows lie now, unless `stopped` meanwhile."""
        session, revision, before = self._session, self._state.followed, self._session.samples
        assert before.display is not None and self.geometry is not None
        session.progress = lambda *_: not stopped()
        try:
            session.refine()
            display = session.samples.display
            assert display is not None
            geometry = fill = None
            if not display.same_triangles(before.display):
                geometry = refined_geometry(self.geometry, session)
                fill = fill_of(session, geometry.drawn)
        except Cancelled:
            return
        except (Error, MemoryError) as error:
            session.samples = before  # that of the mesh that pages go on to draw
            self._state.refined = revision
            log.warning("shadows stay as coarse as they are drawn: %s", error)
            return
        self._state.refined = revision
        if geometry and fill:
            self.geometry, self._fill, self._encoder = geometry, fill, Encoder(fill)
            self.tell(Refined(geometry))
            self.publish(revision)
            return_free_memory()
