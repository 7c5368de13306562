# SPDX-License-Identifier: Apache-2.0
"""Patch accumulation: divides the power that lands on each triangle of the display mesh by its area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux import _core
from deltalux.errors import OptionError
from deltalux.mesh.display_mesh import DisplayMesh, Poses
from deltalux.results import Estimate
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import Progress, Segments, check_threads
from deltalux.vectors import triangle_areas

from .inputs import select_segments
from .lit_surfaces import core_hits


@dataclass(frozen=True, eq=False)
class PatchEstimate(Estimate):
    """Irradiance of patches and of their vertices.

    Attributes
    ----------
    irradiance : (m, 3) float64, of the patches, which are the triangles of `display`
    sums : (m, 3) int64, power per patch in quanta
    vertex_irradiance : (n, 3) float64
        Of the vertices of `display`: total power on the adjacent patches over their total area, which is the
        mean of their irradiance weighted by area.
    area : (m,) float64, square metres
    display : DisplayMesh
    """

    vertex_irradiance: np.ndarray = None  # type: ignore[assignment]  # always given
    area: np.ndarray = None  # type: ignore[assignment]
    display: DisplayMesh = None  # type: ignore[assignment]


class PatchSum:
    """Patches of a scene, to which power can be added and exactly removed again.

    Parameters
    ----------
    scene : Scene
    spacing : metres, longest edge of a patch; None chooses from the scene's area
    display : display mesh that gives the patches; None = `Samples.on_vertices(scene, spacing, share=False)`
    threads : number of threads, None = all; results do not depend on it

    Raises
    ------
    OptionError
        For a spacing that is not positive or needs too many patches.
    """

    def __init__(
        self,
        scene: Scene,
        spacing: float | None = None,
        *,
        display: DisplayMesh | None = None,
        threads: int | None = None,
    ) -> None:
        if not isinstance(scene, Scene):
            raise OptionError(
                f"scene: found {scene!r:.40}, expected the scene that the segments were traced in"
            )
        check_threads(threads)
        self._scene, self._threads = scene, threads or 0
        chosen = Samples.on_vertices(scene, spacing, share=False).display if display is None else display
        assert chosen is not None  # on_vertices always makes one
        self.display = chosen
        self._sums = np.zeros((len(chosen.triangles), 3), np.int64)
        self._quantum: float | None = None
        self._hits = self._lost = self._tests = 0

    def add(
        self, segments: Segments, *, poses: Poses | None = None, progress: Progress | None = None
    ) -> None:
        """Add the power of segments to the patches where they end on the sampled side.

        Parameters
        ----------
        segments : Segments
        poses : poses of movables when the segments were traced, 4x4 by name; None = as loaded

        Raises
        ------
        OptionError
            If the segments' quantum differs from the earlier ones'.
        Cancelled
            If cancelled; nothing was added then.
        """
        self._accumulate(segments, 1, poses, progress)

    def remove(
        self, segments: Segments, *, poses: Poses | None = None, progress: Progress | None = None
    ) -> None:
        """Remove exactly what `add` added for the same segments with the same poses."""
        self._accumulate(segments, -1, poses, progress)

    def _accumulate(
        self, segments: Segments, sign: int, poses: Poses | None, progress: Progress | None
    ) -> None:
        if self._quantum not in (None, segments.quantum):
            raise OptionError(
                f"segments: found a quantum of {segments.quantum:g}, expected {self._quantum:g} as before; "
                "add only segments of the same lights"
            )
        corners, number, _ = self._placed(poses)
        tree = _core.SurfaceTree(corners.reshape(-1, 9), np.zeros(len(corners), np.uint32))
        sums, hits, tests = _core.patch_sum(tree, core_hits(segments), sign, self._threads, progress)
        self._quantum = segments.quantum
        self._sums[number] += sums
        self._hits += sign * hits
        self._tests += sign * tests
        self._lost += sign * (len(segments) - hits)

    def _placed(self, poses: Poses | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Corners of the present patches, (k, 3, 3), their numbers and areas."""
        points, _ = self.display.world(self._scene, poses)
        corners = points[self.display.triangles]
        area = triangle_areas(corners)
        number = np.flatnonzero(self.display.present(self._scene, poses) & (area > 0))
        return np.ascontiguousarray(corners[number]), number, area

    @property
    def estimate(self) -> PatchEstimate:
        """Irradiance from the segments that were added and not removed.

        `stats`: hits; `elsewhere`, segments that ended on no patch: on a side without samples, on a
        removed movable, in free space; `triangle_tests`, triangles tested to find the patches of segments.
        """
        quantum = 1.0 if self._quantum is None else self._quantum
        _, _, area = self._placed(None)
        power = self._sums * quantum
        corner = self.display.triangles.ravel()
        count = len(self.display.points)
        around = np.bincount(corner, np.repeat(area, 3), count)
        total = np.stack([np.bincount(corner, np.repeat(power[:, c], 3), count) for c in range(3)], axis=1)
        return PatchEstimate(
            _over(power, area),
            self._sums.copy(),
            quantum,
            {"hits": self._hits, "elsewhere": self._lost, "triangle_tests": self._tests},
            _over(total, around),
            area,
            self.display,
        )


def _over(power: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Power per area; 0 where there is no area."""
    safe = np.where(area > 0, area, 1.0)[:, None]
    return np.where(area[:, None] > 0, power / safe, 0.0)


def patch_sum(
    segments: Segments,
    scene: Scene,
    *,
    spacing: float | None = None,
    first_bounce: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> PatchEstimate:
    """Irradiance of patches: the power of the hits on each patch over its area.

    After Arvo 1986 ("Backward ray tracing") and Pattanaik & Mudur 1992 ("Computation of global
    illumination by Monte Carlo simulation of the particle model of light").

    Parameters
    ----------
    segments : Segments
    scene : Scene, with movables in the poses in which the segments were traced
    spacing : metres, longest edge of a patch; None chooses from the scene's area
    first_bounce : count segments from this bounce on; 1 excludes direct light

    Returns
    -------
    PatchEstimate
        Per patch and per vertex of the display mesh of `Samples.on_vertices(scene, spacing, share=False)`.
        `sums` are exact: they do not depend on threads or on the order of segments.

    Raises
    ------
    OptionError
        For a spacing that is not positive or needs too many patches.
    """
    patches = PatchSum(scene, spacing, threads=threads)
    patches.add(select_segments(segments, first_bounce, threads), progress=progress)
    return patches.estimate
