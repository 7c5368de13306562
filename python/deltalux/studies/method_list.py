# SPDX-License-Identifier: Apache-2.0
"""Every method that a comparison runs, as one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from deltalux import estimate
from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import Progress, Segments

DISC, LOSSY, NEAREST, SURFACE = "disc", "disc, lossy", "k nearest", "surface"


@dataclass(frozen=True, eq=False)
class Inputs:
    """Inputs of all methods.

    Attributes
    ----------
    scene, segments : scene as loaded, and segments traced in it
    display : mesh whose vertices are the samples
    k : number of neighbours for the k-nearest methods
    threads : None = all
    """

    scene: Scene
    segments: Segments
    display: DisplayMesh
    k: int
    threads: int | None


@dataclass(frozen=True, eq=False)
class Answer:
    """Irradiance (n, 3) of the requested samples, exact sums (n, 3) or None, and counts."""

    irradiance: np.ndarray
    sums: np.ndarray | None = None
    stats: Mapping[str, Any] = field(default_factory=dict)


Run = Callable[[Inputs, Samples, np.ndarray, Progress | None], Answer]


@dataclass(frozen=True)
class Method:
    """A method with fixed options.

    Attributes
    ----------
    name : identifier in CSV and JSON
    label : name for readers
    kind : "disc" (exact sums over discs), "disc, lossy", "k nearest" or "surface"
    run : function of inputs, samples in world space, their rows in the display mesh, and a progress callback
    at_most : largest number of samples; slow methods run on fewer
    """

    name: str
    label: str
    kind: str
    run: Run
    at_most: int = 10**9


def _plain(
    function: Callable[..., Any], wants_scene: bool = False, wants_k: bool = False, **options: Any
) -> Run:
    """Adapt an estimator of segments and samples, with these options."""

    def run(inputs: Inputs, samples: Samples, rows: np.ndarray, progress: Progress | None) -> Answer:
        given = dict(options)
        if wants_scene:
            given["scene"] = inputs.scene
        if wants_k:
            given["k"] = inputs.k
        found = function(inputs.segments, samples, threads=inputs.threads, progress=progress, **given)
        return Answer(found.irradiance, found.sums, found.stats)

    return run


def _patches(inputs: Inputs, samples: Samples, rows: np.ndarray, progress: Progress | None) -> Answer:
    """Patch sums at the vertices; all patches are summed, whichever rows are requested."""
    patches = estimate.PatchSum(inputs.scene, display=inputs.display, threads=inputs.threads)
    patches.add(inputs.segments, progress=progress)
    found = patches.estimate
    return Answer(found.vertex_irradiance[rows], None, found.stats)


def _photons(**options: Any) -> Run:
    return _plain(estimate.photon_map, wants_k=True, **options)


def _photons_on_surfaces() -> Run:
    return _plain(estimate.photon_map, wants_scene=True, wants_k=True, area="surface")


def _cache(containment: str) -> Run:
    return _plain(estimate.sphere_cache, containment=containment)


def _rays(metric: str) -> Run:
    return _plain(estimate.ray_map, wants_k=True, metric=metric)


INDEX = "disc_index"
METHODS = (
    Method(INDEX, "disc index", DISC, _plain(estimate.disc_index)),
    Method("brute_force", "brute force", DISC, _plain(estimate.brute_force), at_most=1_000),
    Method("sphere_cache_all", "sphere cache, all", DISC, _cache("all")),
    Method("sphere_cache_nested", "sphere cache, nested", DISC, _cache("nested")),
    Method("sphere_cache_literal", "sphere cache, literal (lossy)", LOSSY, _cache("literal")),
    Method("ray_map_disc", "ray map, discs", DISC, _plain(estimate.ray_map)),
    Method("ray_map_crossing", "ray map, k nearest crossings", NEAREST, _rays("crossing")),
    Method("ray_map_line", "ray map, k nearest lines", NEAREST, _rays("line")),
    Method("ray_map_hit", "ray map, k nearest hits", NEAREST, _rays("hit")),
    Method("photon_map", "photon map", NEAREST, _photons()),
    Method("photon_map_plain", "photon map, plain form", NEAREST, _photons(unbiased=False)),
    Method("photon_map_cone", "photon map, cone", NEAREST, _photons(kernel="cone")),
    Method("photon_map_epanechnikov", "photon map, Epanechnikov", NEAREST, _photons(kernel="epanechnikov")),
    Method("photon_map_surface", "photon map, surface area", NEAREST, _photons_on_surfaces()),
    Method("patch_sum", "patch sum", SURFACE, _patches),
    Method("local_linear", "local linear", SURFACE, _plain(estimate.local_linear, wants_scene=True)),
)


def method(name: str) -> Method:
    """The method of that name."""
    return next(m for m in METHODS if m.name == name)
