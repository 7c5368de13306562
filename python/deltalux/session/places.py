# SPDX-License-Identifier: Apache-2.0
"""Light of a session at places other than its samples: any points, and display mesh vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from deltalux import core_session, memory
from deltalux.errors import Cancelled, OptionError
from deltalux.mesh.shadow_detail import detail_length, refined_at_shadows
from deltalux.mesh.vertex_light import add_detail
from deltalux.samples import Samples
from deltalux.samples.interpolation import Interpolator, Interpolators
from deltalux.segments import Progress
from deltalux.units import PHOTOPIC_WEIGHTS

from .calls import long_call
from .facts import SessionFacts

REFINE_STAGE = "refine shadows"
ASKED_TOGETHER = 1 << 13  # places between two calls of the progress callback


class SessionPlaces(SessionFacts):
    """Light at any places; `Session` adds the light of the samples."""

    _interpolators: Interpolators
    progress: Progress | None

    def _read_irradiance(self) -> np.ndarray:
        raise NotImplementedError

    def _gradient(self) -> np.ndarray:
        raise NotImplementedError

    def _finish(self) -> None:
        raise NotImplementedError

    @property
    @long_call
    def vertex_irradiance(self) -> np.ndarray:
        """(v, 3) float64: `irradiance` at the vertices of `samples.display`, with detailed shadows.

        In a session that gathers, vertices that refine shadows (`display.detail`) have direct light computed
        there in the present state.

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
        """(d, 3): what `vertex_irradiance` adds at vertices `samples.display.detail`; None if nothing."""
        return self._beyond()

    @long_call
    def refine(self, detail: float | str | None = None) -> int:
        """Refine the display mesh at the edges of shadows and of spots' pools of light in the present state.

        After an edit the mesh may still be fine where shadows were, and coarse where they are now. The
        samples, their light and the digest do not change; `samples` becomes another object, whose `display`
        is the refined mesh. Unlike `Samples.on_vertices` this takes movables, in their present poses, and
        dim factors into account. Queued edits are applied first.

        Parameters
        ----------
        detail : metres; edges shorter than this are not halved; "auto": a quarter of the spacing; None: the
            value of the last refinement, else "auto"

        Returns
        -------
        How many vertices now refine shadows.

        Raises
        ------
        OptionError
            Where the samples are not on a display mesh, or the session does not gather.
        Cancelled
            Where `progress` asked to stop.
        """
        display = self.samples.display
        if display is None:
            raise OptionError("refine: found other samples, expected Samples.on_vertices(scene)")
        if self._options["gather"] == "off":
            raise OptionError('refine: found a session of gather="off", expected one that gathers')
        self._finish()
        length = detail_length(display, detail or display.detail_length or "auto")

        def light(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
            found = np.zeros(len(points))
            for first in range(0, len(points), ASKED_TOGETHER):
                if self.progress and self.progress(REFINE_STAGE, 0.0) is False:
                    raise Cancelled("refine: cancelled; the mesh is as it was")
                own = slice(first, first + ASKED_TOGETHER)
                found[own] = self._direct_at(points[own], normals[own]) @ PHOTOPIC_WEIGHTS
            return found

        refined = refined_at_shadows(self.scene, display.without_detail(), light, length)
        self.samples = self.samples.shown_on(refined)
        assert refined.refinement is not None
        return len(refined.refinement.vertices)

    def _direct_at(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Direct light (k, 3) of the present state, to within half a per cent."""
        where, up = self._flat.points(points), normals.astype(np.float32)
        core = self._baked_session()
        return core.gather_at(where, up, 0, True, self._bytes_to_keep(), True, False, None)[0]

    def _bytes_to_keep(self) -> int:
        """Memory in which the core may keep points' rays, so that an edit recasts only those it changed."""
        return 0 if self._options["memory_limit"] else memory.bytes_to_keep()

    def _beyond(self) -> np.ndarray | None:
        """(d, 3) by which direct light at detail vertices exceeds the light interpolated from samples."""
        display, core = self.samples.display, self._baked_session()
        if display is None or display.detail is None or self._options["gather"] == "off":
            return None
        places, normals = display.sample_points[display.detail], display.normals[display.detail]
        own = self._direct_at(places, normals)
        return own - display.at_vertices(core.read_direct())[display.detail]

    @long_call
    def at(
        self,
        points: ArrayLike,
        normals: ArrayLike,
        *,
        gradients: bool = False,
        part: str = "all",
        rays: int | None = None,
        by_need: bool = False,
        keep: bool = False,
    ) -> np.ndarray:
        """Irradiance at other surface points: gathered there, or interpolated from the samples nearby.

        In a session that gathers, each point casts as many rays as its present noise requires. A sample keeps
        the number of rays from the bake, so after edits the two may differ by the noise of their rays.

        Parameters
        ----------
        points, normals : (m, 3), world space, metres
        gradients : extrapolate each sample along its surface gradient (see `gradient`)
            Takes a pass over all stored segments; worthwhile with sparse samples and many paths.
            Has no effect in a session that gathers.
        part : "all", "direct" or "indirect"
            Direct light, by shadow rays alone, is fast. Only a session that gathers has parts.
        rays : how many to gather along, unless noise requires another number; None = as the session does
        keep : keep the points' rays and hits in memory, up to a gibibyte, so that the same points get their
            light faster after an edit; in sessions that gather
        by_need : cast fewer shadow rays to lamps that contribute little: faster, and direct light is right
            within half a per cent

        Returns
        -------
        (m, 3) float64
            Weights after Ward, Rubinstein & Clear (1988), gradients after Ward & Heckbert (1992)
            from the moments of the crossings. Samples that are occluded from a point do not count; a
            point without any valid sample takes the nearest sample with a similar normal.
            Queued edits are applied first.

        Raises
        ------
        OptionError
            For a number that is not finite or beyond 1e15 m, and for a zero normal; with gather="off" also
            if no sample is present, or `part` or `rays` is given.
        """
        asked = Samples(points, normals, radius=1.0)
        core_session.check_asked(part, rays, self._options["gather"])
        self._finish()
        session = self._baked_session()
        if self._options["gather"] != "off":
            return self._gathered(asked, part, rays, by_need, keep)[0]
        present, interpolator = self._interpolation()

        def visible(a: np.ndarray, b: np.ndarray) -> np.ndarray:
            return session.visible(self._flat.points(a), self._flat.points(b)).astype(bool)

        slopes = self._gradient()[present] if gradients else None
        values = self._read_irradiance()[present]
        return interpolator(asked.points, asked.normals, values, slopes, visible)

    @long_call
    def indirect_at(
        self, points: ArrayLike, normals: ArrayLike, rays: int | None = None, keep: bool = False
    ) -> tuple:
        """Indirect irradiance (m, 3) at other points of a session that gathers, and its noise (m,).

        The noise is the standard error of the channels' sum due to the choice of rays alone, somewhat
        overestimated; noise of the paths, which neighbours share, is not included. `keep` keeps the points'
        rays and hits in memory, so that the same points get their light faster after an edit, with the same
        bits.
        Everything else is as in `at`.
        """
        asked = Samples(points, normals, radius=1.0)
        core_session.check_asked("indirect", rays, self._options["gather"])
        self._finish()
        return self._gathered(asked, "indirect", rays, False, keep)

    def _gathered(self, asked: Samples, part: str, rays: int | None, by_need: bool, keep: bool) -> tuple:
        keep_bytes = self._bytes_to_keep() if keep else 0
        return self._baked_session().gather_at(
            self._flat.points(asked.points), asked.normals.astype(np.float32), rays or 0, by_need, keep_bytes,
            part != "indirect", part != "direct", self.progress,
        )  # fmt: skip

    def _interpolation(self) -> tuple[np.ndarray, Interpolator]:
        own = self.samples
        return self._interpolators.over(own.points, own.normals, own.attached, self.poses)
