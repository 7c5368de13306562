# SPDX-License-Identifier: Apache-2.0
"""Light of a session at the vertices of its display mesh, where shadows have detail of their own."""

from __future__ import annotations

import numpy as np

from .calls import long_call
from .errors import OptionError
from .session_facts import SessionFacts
from .vertex_light import add_detail


class SessionVertices(SessionFacts):
    """What vertices show. `Session` computes the light of the samples."""

    def _read_irradiance(self) -> np.ndarray:
        raise NotImplementedError

    @property
    @long_call
    def vertex_irradiance(self) -> np.ndarray:
        """(v, 3) float64: what `samples.display.at_vertices` makes of `irradiance`, with detailed shadows.

        Vertices that refine shadows (`display.detail`) have direct light of their own, found anew in the
        present state, in sessions that gather.

        Raises
        ------
        OptionError
            Where the samples are not on a display mesh.
        """
        display = self.samples.display
        if display is None:
            raise OptionError("vertex_irradiance: found other samples, expected Samples.on_vertices(scene)")
        shown = display.at_vertices(self._read_irradiance()).copy()
        return add_detail(shown, display, self._beyond())

    @long_call
    def direct_beyond_samples(self) -> np.ndarray | None:
        """(d, 3): what `vertex_irradiance` adds at `samples.display.detail`; None where it adds nothing."""
        return self._beyond()

    def _beyond(self) -> np.ndarray | None:
        """By how much their direct light exceeds what they take from samples: a function of the state."""
        display, core = self.samples.display, self._baked_session()
        if display is None or display.detail is None or self._options["gather"] == "off":
            return None
        own, _ = core.gather_at(
            self._flat.points(display.sample_points[display.detail]),
            display.normals[display.detail].astype(np.float32),
            0, True, True, False, None,
        )  # fmt: skip
        return own - display.at_vertices(core.read_direct())[display.detail]
