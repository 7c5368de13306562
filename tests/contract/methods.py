# SPDX-License-Identifier: Apache-2.0
"""The methods under contract. A new one joins by one entry in the list of its kind.

DISC_METHODS sum over discs, exactly: all equal the first one. GATHER_METHODS take segments and samples,
SURFACE_METHODS also a scene: each equals its own slow reference.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import deltalux as dl
import numpy as np
from oracles import flat_floor, nearest_photons, nearest_segments, patches

# ---- sums over discs ----------------------------------------------------------------------------


def with_options(name, method, **options):
    """The method under other options than its defaults, as an entry of its own."""
    variant = functools.partial(method, **options)
    variant.__name__ = name
    return variant


DISC_METHODS = [
    dl.estimate.brute_force,
    dl.estimate.disc_index,
    dl.estimate.ray_map,
    dl.estimate.sphere_cache,
    with_options("sphere_cache_deep", dl.estimate.sphere_cache, min_rays=1, ratio=0.8),
    with_options("sphere_cache_lebesgue", dl.estimate.sphere_cache, min_rays=2, order="lebesgue"),
    with_options("sphere_cache_unordered", dl.estimate.sphere_cache, min_rays=2, order="none"),
    with_options("sphere_cache_nested", dl.estimate.sphere_cache, min_rays=1, containment="nested"),
]

# ---- gathering ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Method:
    """A method and its slow reference, as functions of segments and samples.

    Parameters
    ----------
    function : of `dl.estimate`, called with `options`
    reference : returns irradiance (n, 3) and the number of hits
    rtol : of the comparison; summing in another order costs 1e-9 at most
    """

    function: Callable[..., dl.Estimate]
    options: dict
    reference: Callable[..., tuple[np.ndarray, int]]
    rtol: float = 1e-9

    @property
    def name(self) -> str:
        return " ".join([self.function.__name__, *(f"{key}={value}" for key, value in self.options.items())])

    def estimate(self, segments: dl.Segments, samples: dl.Samples, **others) -> dl.Estimate:
        return self.function(segments, samples, **self.options, **others)


def gather_method(function, oracle, **options) -> Method:
    """With a reference that takes the same options."""
    return Method(function, options, functools.partial(oracle, **options))


ray_map = functools.partial(gather_method, dl.estimate.ray_map, nearest_segments.irradiance)
photon_map = functools.partial(gather_method, dl.estimate.photon_map, nearest_photons.irradiance)

GATHER_METHODS = [
    ray_map(metric="hit", k=5),
    ray_map(metric="crossing", k=5),
    ray_map(metric="crossing", k=3, unbiased=False, segment_end="second"),
    ray_map(metric="line", k=5),
    ray_map(metric="line", k=4, unbiased=False, segment_end="first"),
    photon_map(k=5),
    photon_map(k=3, unbiased=False),
    photon_map(k=8, kernel="cone"),
    photon_map(k=8, kernel="cone", unbiased=False, compression=5.0),
    photon_map(k=1000, kernel="epanechnikov"),
    photon_map(k=8, kernel="epanechnikov", unbiased=False),
]

# ---- on the surfaces of a scene -----------------------------------------------------------------


@dataclass(frozen=True)
class SurfaceMethod:
    """A method on surfaces and its slow reference.

    Parameters
    ----------
    function : of `dl.estimate`, which `estimate` calls
    estimate : of segments, samples and a scene
    reference : of segments, samples, the floor that `floor_scene` is, and what `estimate` returned
        Returns irradiance, one row for each of the estimate's, NaN where rounding decides; and the hits.
    rtol : of the comparison
    at_samples : bool
        Irradiance is that of the samples; else of patches that the method made itself.
    accumulator : of a scene; an object that segments are added to and removed from, if there is one
    """

    name: str
    function: Callable[..., dl.Estimate]
    estimate: Callable[..., dl.Estimate]
    reference: Callable[..., tuple[np.ndarray, int]]
    rtol: float
    at_samples: bool = True
    accumulator: Callable[[dl.Scene], dl.estimate.PatchSum] | None = None


def local_linear(kernel: str) -> SurfaceMethod:
    options = {"kernel": kernel, "bandwidth": 0.3}

    def reference(segments, samples, floor, found):
        return flat_floor.local_linear(segments, samples, floor, **options)

    estimate = functools.partial(dl.estimate.local_linear, **options)
    return SurfaceMethod(f"local_linear {kernel}", dl.estimate.local_linear, estimate, reference, rtol=1e-4)


def photon_map_by_surface(rtol: float, **options) -> SurfaceMethod:
    def estimate(segments, samples, scene, **others):
        return dl.estimate.photon_map(segments, samples, area="surface", scene=scene, **options, **others)

    def reference(segments, samples, floor, found):
        return flat_floor.photon_map(segments, samples, floor, **options)

    name = " ".join(["photon_map by surface", *(f"{key}={value}" for key, value in options.items())])
    return SurfaceMethod(name, dl.estimate.photon_map, estimate, reference, rtol)


def patch_sum(spacing: float) -> SurfaceMethod:
    def estimate(segments, samples, scene, **others):
        return dl.estimate.patch_sum(segments, scene, spacing=spacing, **others)

    def reference(segments, samples, floor, found):
        corners = found.display.points[found.display.triangles]
        quanta, hits, sure = patches.sums(segments, corners)
        return np.where(sure[:, None], quanta * segments.quantum / found.area[:, None], np.nan), hits

    return SurfaceMethod(
        f"patch_sum spacing={spacing}", dl.estimate.patch_sum, estimate, reference, rtol=1e-12,
        at_samples=False, accumulator=functools.partial(dl.estimate.PatchSum, spacing=spacing),
    )  # fmt: skip


SURFACE_METHODS = [
    local_linear("epanechnikov"),
    local_linear("constant"),
    # The constant kernel's area is exact; the others' integrals are those of an 8-point rule.
    photon_map_by_surface(k=5, rtol=1e-4),
    photon_map_by_surface(k=3, unbiased=False, rtol=1e-4),
    photon_map_by_surface(k=8, kernel="cone", rtol=1e-2),
    photon_map_by_surface(k=8, kernel="epanechnikov", unbiased=False, rtol=1e-2),
    patch_sum(spacing=0.5),
]
