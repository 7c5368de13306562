# SPDX-License-Identifier: Apache-2.0
"""Density estimation on surfaces by locally fitted planes, without dark borders."""

from __future__ import annotations

import numpy as np

from deltalux import _core
from deltalux.errors import OptionError
from deltalux.results import Estimate
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import Progress, Segments

from .inputs import check_choice, check_world_points, select_segments
from .lit_surfaces import core_hits, core_surfaces

KERNELS = ("epanechnikov", "constant")
# expected hits per disc: noise of about 12 % with the Epanechnikov kernel, sqrt(4 / 3 / hits)
EXPECTED_HITS = 100.0


def local_linear(
    segments: Segments,
    samples: Samples,
    scene: Scene,
    *,
    bandwidth: float | None = None,
    kernel: str = "epanechnikov",
    first_bounce: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Estimate:
    """Local-linear density estimation (Walter, Hubbard, Shirley & Greenberg 1997).

    Hits are grouped by surface (triangles with smooth shading between them). Around a sample, a plane is
    fitted to their density under a kernel, which is clipped to the surface's polygons in the tangent plane,
    so that constant and linear irradiance is estimated without bias up to edges and corners.

    Parameters
    ----------
    segments : Segments
    samples : Samples on surfaces, in world space; radii are ignored
    scene : Scene, with movables in the poses in which the segments were traced
    bandwidth : float or None
        Radius of the kernel, metres. None chooses one per surface, such that a disc on the surface holds 100
        hits on average: h = sqrt(100 area / (pi hits)).
    kernel : "epanechnikov" or "constant"
    first_bounce : count segments from this bounce on; 1 excludes direct light

    Returns
    -------
    Estimate
        Irradiance is not negative (negative fits become 0); it is 0 for samples on no surface (farther away
        than 1 % of the scene's diagonal, or facing away) and on surfaces without hits. `stats`: hits (used in
        estimates) and disc_tests.

    Raises
    ------
    OptionError
        For a bandwidth that is not positive, an unknown kernel, or without a scene.
    """
    check_choice("kernel", kernel, KERNELS)
    if bandwidth is not None and not (np.isfinite(bandwidth) and bandwidth > 0):
        raise OptionError(f"bandwidth: found {bandwidth}, expected a positive number of metres, or None")
    check_world_points(samples)
    segments = select_segments(segments, first_bounce, threads)
    values, stats = _core.local_linear(
        core_surfaces(scene),
        core_hits(segments),
        np.ascontiguousarray(samples.points),
        np.ascontiguousarray(samples.normals),
        kernel,
        float(bandwidth or 0.0),
        EXPECTED_HITS,
        threads or 0,
        progress,
    )
    return Estimate(values * segments.quantum, None, segments.quantum, stats)
