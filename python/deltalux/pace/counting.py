# SPDX-License-Identifier: Apache-2.0
"""Counts of a job from its scene and samples."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.session_options import default_paths, resolved_gather

from .steps import POINT, Counts


def counts_of(
    scene: Scene, samples: Samples, paths: int | None, gather: str | int, threads: int | None
) -> Counts:
    """Counts of a session before it is made."""
    rays = resolved_gather(gather, len(samples), "first", "reachable")
    lights = scene.info()["lights"]
    return Counts(
        triangles=sum(len(mesh.triangles) for mesh in scene.meshes),
        samples=len(samples),
        pixels=Counts.pixels if samples.display else 0,
        paths=default_paths(rays) if paths is None else int(paths),
        rays=0 if rays == "off" else int(rays),
        lights=sum(1 if light["kind"] == "area" else POINT for light in lights),
        suns=sum(light.place is None for light in scene.lights),
        threads=threads or os.cpu_count() or 1,
    )


def counts_with(scene: Scene, samples: Samples, options: Mapping[str, Any]) -> Counts:
    """Counts of a session of `scene` and `samples` with these options."""
    return counts_of(scene, samples, options["paths"], options["gather"], options["threads"])
