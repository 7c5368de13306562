# SPDX-License-Identifier: Apache-2.0
"""Light of a session at other places than its samples: any points, and vertices of its display mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from . import core_session, memory
from .calls import long_call
from .errors import Cancelled, OptionError
from .interpolation import Interpolator, Interpolators
from .samples import Samples
from .segments import Progress
from .session_facts import SessionFacts
from .shadow_detail import detail_length, refined_at_shadows
from .units import PHOTOPIC_WEIGHTS
from .vertex_light import add_detail

REFINE_STAGE = "refine shadows"
ASKED_TOGETHER = 1 << 13  # places between two looks at whether to go on


class SessionPlaces(SessionFacts):
    """Light at any places. `Session` computes that of the samples."""

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

    @long_call
    def refine(self, detail: float | str | None = None) -> int:
        """Refine the display mesh where shadows and pools of spots have edges in the present state.

        After an edit the mesh may still be fine where shadows lay, and coarse where they lie now. The
        samples, their light and the digest stay as they are; `samples` becomes another object, whose
        `display` is the refined mesh. Unlike `Samples.on_vertices` this counts movables, where they stand,
        and dimmed lights. Edits that wait are applied first.

        Parameters
        ----------
        detail : metres, edges are not halved below it; "auto": a quarter of the spacing; None: as the mesh
            was refined before, else "auto"

        Returns
        -------
        How many vertices refine shadows now.

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
        """Direct light (k, 3) of the present state, within half a per cent."""
        where, up = self._flat.points(points), normals.astype(np.float32)
        core = self._baked_session()
        return core.gather_at(where, up, 0, True, self._bytes_to_keep(), True, False, None)[0]

    def _bytes_to_keep(self) -> int:
        """What places may take in memory, so that an edit casts again only what it changed."""
        return 0 if self._options["memory_limit"] else memory.bytes_to_keep()

    def _beyond(self) -> np.ndarray | None:
        """By how much their direct light exceeds what they take from samples: a function of the state."""
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

        A session that gathers casts as many rays from a point as its noise now asks for. A sample keeps
        the number of the bake, so after edits the two may differ by the noise of their rays.

        Parameters
        ----------
        points, normals : (m, 3), world space, metres
        gradients : extrapolate each sample along its surface gradient (see `gradient`)
            Takes a pass over all stored segments; pays where samples are sparse and paths many.
            Of no use in a session that gathers.
        part : "all", "direct" or "indirect"
            Direct light, by shadow rays alone, is quickly had. Parts are those of a session that gathers.
        rays : how many to gather along, where noise asks for no other number; None = as the session does
        keep : keep what the points saw in memory, up to a gibibyte, so that the same points have their light
            sooner after an edit; of sessions that gather
        by_need : fewer shadow rays to lamps that bring little: sooner, direct light within half a per cent

        Returns
        -------
        (m, 3) float64
            Weights after Ward, Rubinstein & Clear (1988), gradients after Ward & Heckbert (1992)
            from the moments of the crossings. Samples that something hides from a point do not
            count; a point that no sample serves takes the nearest one of a like normal.
            Edits that wait are applied first.

        Raises
        ------
        OptionError
            Where a number is not finite or beyond 1e15 m, or a normal is zero; with gather="off" also
            where no sample is present, or a part is asked for.
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
        """Indirect irradiance (m, 3) at other points of a session that gathers, and (m,) how noisy it is.

        The second is the standard error of the channels' sum by the choice of rays alone, somewhat
        overrated; noise of the paths, which neighbours share, is not in it. With `keep` what the points
        saw is kept in memory, so that the same points after an edit have their light sooner, to the bit
        what it would be. The rest is as of `at`.
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
