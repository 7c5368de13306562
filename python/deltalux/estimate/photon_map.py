# SPDX-License-Identifier: Apache-2.0
"""Photon map: irradiance from the k hits nearest to a sample."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux import _core
from deltalux.errors import OptionError
from deltalux.results import Estimate
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import Progress, Segments, check_threads

from .inputs import check_choice, check_world_points, select_segments
from .lit_surfaces import core_hits, core_surfaces

KERNELS = ("constant", "cone", "epanechnikov")
AREAS = ("disc", "surface")


def photon_map(
    segments: Segments,
    samples: Samples,
    *,
    k: int = 50,
    kernel: str = "constant",
    unbiased: bool = True,
    area: str = "disc",
    scene: Scene | None = None,
    compression: float = 1.0,
    cone: float = 1.1,
    first_bounce: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Estimate:
    """Irradiance from the k nearest hits (Jensen 1996, "Global illumination using photon maps").

    Hits are the ends of segments that arrive at a sample's front (direction · normal < 0), wherever
    they lie; segments of infinite length, or that leave the scene, have no hit.

    Parameters
    ----------
    segments : Segments
    samples : Samples in world space; radii are ignored
    k : number of hits, at least 2
        If fewer arrive, all of them are used, as with a smaller k; if none arrives, or only one (in the
        unbiased form), or if all lie at the sample itself, the result is 0.
    kernel : "constant", "cone" or "epanechnikov"
        Weight of a hit at distance d of the k-th one's distance r: 1, 1 - d / (cone r), or 1 - d² / r²;
        divided by its integral over the disc, pi r² times 1, 1 - 2 / (3 cone), or 1/2.
    unbiased : bool
        Exclude the k-th hit, which defines r. If it is included, the constant kernel overestimates by
        k / (k - 1) (García et al. 2012); Epanechnikov's gives it no weight.
    area : "disc" or "surface"
        "surface" divides by the integral over the real surfaces in the search region (Hey & Purgathofer
        2002, "Advanced radiance estimation for photon map global illumination"), and takes only hits on
        them: lit sides of triangles turned less than 45° from the sample's plane. The area is exact;
        the other kernels are integrated by an 8-point quadrature over the radius.
    scene : Scene or None
        Required by area="surface", with movables in the poses in which the segments were traced.
    compression : float, at least 1
        Factor on distances along the sample's normal: the search region becomes an ellipsoid flattened
        along the normal, which excludes hits on other surfaces. 1, the default, is a sphere.
    cone : float, at least 1, Jensen's filter constant
    first_bounce : count segments from this bounce on; 1 excludes direct light

    Returns
    -------
    Estimate
        Does not depend on threads or on the order of segments. `stats`: hits, those that were weighted, and
        disc_tests, hits tested (which may depend on the order of segments).

    Raises
    ------
    OptionError
        For options out of range, or area="surface" without a scene.
    """
    check_threads(threads)
    core = core_map(samples, k, kernel, unbiased, area, scene, compression, cone)
    segments = select_segments(segments, first_bounce, threads)
    values, stats = core.estimate(core_hits(segments), threads or 0, progress)
    return Estimate(values * segments.quantum, None, segments.quantum, stats)


def core_map(
    samples: Samples,
    k: Any,
    kernel: str,
    unbiased: bool,
    area: str,
    scene: Scene | None,
    compression: float,
    cone: float,
    rows: np.ndarray | slice = slice(None),
) -> _core.PhotonMap:
    """The core's method for these rows of the samples; for the options see `photon_map`."""
    check_choice("kernel", kernel, KERNELS)
    check_choice("area", area, AREAS)
    if not isinstance(k, (int, np.integer)) or isinstance(k, bool) or not 2 <= k < 2**32:
        raise OptionError(f"k: found {k!r}, expected an integer number of hits, at least 2")
    for name, value in (("compression", compression), ("cone", cone)):
        if not (np.isfinite(value) and value >= 1):
            raise OptionError(f"{name}: found {value}, expected a number of at least 1")
    if area == "surface" and scene is None:
        raise OptionError('scene: found None, expected a scene; area="surface" measures its surfaces')
    check_world_points(samples)
    return _core.PhotonMap(
        np.ascontiguousarray(samples.points[rows]),
        np.ascontiguousarray(samples.normals[rows]),
        int(k),
        kernel,
        bool(unbiased),
        float(compression),
        float(cone),
        core_surfaces(scene) if area == "surface" else None,
    )
