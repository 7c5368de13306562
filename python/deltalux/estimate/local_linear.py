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
EXPECTED_HITS = 100.0  # noise of some 12 % with the Epanechnikov kernel, sqrt(4 / 3 / hits)


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

    Hits are listed by surface (triangles that shade smoothly into each other). Around a sample a plane
    is fitted to their density under a kernel, which is clipped to the surface's polygons in the tangent
    plane, so that constant and linear irradiance come out without bias up to edges and corners.

    Parameters
    ----------
    segments : Segments
    samples : Samples on surfaces, in world space; radii do not count
    scene : Scene, with movables where they were when the segments were traced
    bandwidth : float or None
        Radius of the kernel, metres. None chooses one for each surface, such that a whole disc holds 100
        hits on the surface's average: h = sqrt(100 area / (pi hits)).
    kernel : "epanechnikov" or "constant"
    first_bounce : count flights from this bounce on; 1 leaves direct light out

    Returns
    -------
    Estimate
        Irradiance is not negative (fits below 0 become 0); 0 for samples that lie on no surface (farther
        off than 1 % of the scene's diagonal, or facing away) and on surfaces without hits. `stats`:
        hits (that entered estimates) and disc_tests.

    Raises
    ------
    OptionError
        For a bandwidth that is not positive, an unknown kernel, or no scene.
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
