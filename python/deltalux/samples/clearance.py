# SPDX-License-Identifier: Apache-2.0
"""Finds samples that are covered by other surfaces, and open places for them nearby."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.mesh.surfaces import Surfaces
from deltalux.scene import Scene

TOWARDS_MIDDLE = (0.5, 1.0)  # candidates for open places, from the vertex (0) to a triangle's centroid (1)
MAX_FACES = 8  # most triangles around a vertex that are tried


class Clearance:
    """Which vertices of a display mesh have covered samples, and open places for those samples.

    A sample under the side of a bookcase says nothing about the floor that is visible beside it. Static
    samples are tested against static surfaces, samples of a movable against that movable only: their places
    must not depend on the movables' poses.

    Parameters
    ----------
    scene : Scene
    display : DisplayMesh, of that scene
    threads : int, 0 = all

    Attributes
    ----------
    covered : (n,) bool, whether each vertex's sample is covered
    """

    def __init__(self, scene: Scene, display: DisplayMesh, threads: int = 0) -> None:
        poses = movables_apart(scene)
        self._surfaces = Surfaces(scene, display, poses, threads)
        self._vertices, _ = display.world(scene, poses)
        self.covered = covered_samples(self._surfaces)

    def cleared(self, display: DisplayMesh) -> DisplayMesh:
        """The display mesh with covered samples moved to open places in adjacent triangles, where possible.

        Parameters
        ----------
        display : the given mesh, or one that differs only in which vertices have a sample
        """
        samples = display.sample_points.copy()
        covered = display.sample_vertices[self.covered[display.sample_vertices]]
        asked = np.zeros(len(samples), dtype=bool)
        asked[covered] = True
        corners = display.triangles.ravel()
        around = np.flatnonzero(asked[corners])
        order = around[np.argsort(corners[around], kind="stable")]
        first = np.searchsorted(corners[order], np.arange(len(samples) + 1))
        for share, turn in product(TOWARDS_MIDDLE, range(MAX_FACES)):
            tried = covered[first[covered] + turn < first[covered + 1]]
            triangles = order[first[tried] + turn] // 3
            places = _inside(self._vertices, display, tried, triangles, share)
            is_open = ~self._surfaces.cover.covers(places, self._surfaces.normals[triangles])
            moved = tried[is_open]
            samples[moved] = _inside(display.points, display, moved, triangles[is_open], share)
            covered = np.setdiff1d(covered, moved, assume_unique=True)
        samples.setflags(write=False)
        return replace(display, sample_points=samples)


def movables_apart(scene: Scene) -> dict[str, np.ndarray]:
    """Poses at which no movable is near anything: in a row beside the static meshes.

    They do not depend on the movables' present poses, not even by rounding.
    """
    static = [m.world_vertices for m in scene.meshes if not m.movable]
    points = np.concatenate([*static, np.zeros((1, 3))])  # without static meshes: beside the origin
    gap = 0.1 * float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
    end, poses = float(points[:, 0].max()), {}
    for mesh in scene.meshes:
        if not mesh.movable:
            continue
        x = mesh.vertices[:, 0]
        poses[mesh.name] = np.eye(4)
        poses[mesh.name][0, 3] = end + gap - (x.min() if len(x) else 0.0)
        end += gap + (float(np.ptp(x)) if len(x) else 0.0)
    return poses


def _inside(
    points: np.ndarray, display: DisplayMesh, vertices: np.ndarray, triangles: np.ndarray, share: float
) -> np.ndarray:
    """A point of each triangle, between one of its vertices and its centroid."""
    middle = points[display.triangles[triangles]].mean(axis=1)
    return points[vertices] + share * (middle - points[vertices])


def covered_samples(surfaces: Surfaces) -> np.ndarray:
    """Find samples under a bookcase, behind a frame, inside a column.

    Returns
    -------
    (n,) bool: nearly every ray from the sample hits a surface nearby, or hits one from behind.
    """
    points, normals = surfaces.display.world(surfaces.scene, surfaces.poses, samples=True)
    return surfaces.cover.covers(points, normals)
