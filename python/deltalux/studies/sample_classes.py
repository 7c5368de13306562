# SPDX-License-Identifier: Apache-2.0
"""Classes of samples by place: inside a surface, near its edge, on a small or a very small surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.scene import Scene
from deltalux.vectors import triangle_areas

CLASSES = ("inside", "edge", "small", "very small")
VERY_SMALL = 0.1  # share of the area that holds k hits
EDGE_STEPS = 8  # points on a length of edge of one gather radius


@dataclass(frozen=True, eq=False)
class SampleClasses:
    """Classes of the vertices of a display mesh.

    Attributes
    ----------
    number : (n,) int, index into `CLASSES`
    gather_area : mean area over all sampled surfaces that holds k hits, m²
    """

    number: np.ndarray
    gather_area: float

    @property
    def gather_radius(self) -> float:
        """Radius of a disc of area `gather_area`, metres."""
        return float(np.sqrt(self.gather_area / np.pi))


def classify(scene: Scene, display: DisplayMesh, k: int, hits: int) -> SampleClasses:
    """Classify the vertices of a display mesh by the surface around them that a search for k hits covers.

    A surface is one side of a smoothly shaded part. It is small if k hits need more area than it has,
    very small if they need ten times as much. On other surfaces, a sample is at an edge if the surface
    ends within the radius of a disc that holds k hits.

    Parameters
    ----------
    scene : Scene, movables as loaded
    display : DisplayMesh
    k : number of hits that a search collects
    hits : number of hits on all surfaces
    """
    points, _ = display.world(scene)
    area = triangle_areas(points[display.triangles])
    edges = np.sort(display.triangles[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
    graph = coo_matrix((np.ones(len(edges)), edges.T), shape=(len(points),) * 2)
    count, surface = connected_components(graph, directed=False)
    surface_area = np.bincount(surface[display.triangles[:, 0]], area, count)

    gather_area = k * float(area.sum()) / max(hits, 1)
    own = surface_area[surface]
    number = np.where(own < VERY_SMALL * gather_area, 3, np.where(own < gather_area, 2, 0))
    classes = SampleClasses(number, gather_area)
    large = np.flatnonzero(number == 0)
    near = _edge_distance(points, edges, surface, large, classes.gather_radius) < classes.gather_radius
    number[large[near]] = 1
    return classes


def _edge_distance(
    points: np.ndarray, edges: np.ndarray, surface: np.ndarray, rows: np.ndarray, radius: float
) -> np.ndarray:
    """Distance from each of these vertices to the border of its surface, metres; inf beyond 2 `radius`."""
    single, uses = np.unique(edges, axis=0, return_counts=True)
    border = single[(uses == 1) & np.isin(surface[single[:, 0]], surface[rows])]
    if not len(border) or not len(rows):
        return np.full(len(rows), np.inf)
    start, way = points[border[:, 0]], points[border[:, 1]] - points[border[:, 0]]
    steps = 1 + np.ceil(EDGE_STEPS * np.linalg.norm(way, axis=1) / radius).astype(np.int64)
    index = np.repeat(np.arange(len(border)), steps)
    within = np.arange(len(index)) - np.repeat(np.cumsum(steps) - steps, steps)
    along = start[index] + (within / np.maximum(steps - 1, 1)[index])[:, None] * way[index]
    # A fourth coordinate separates surfaces by more than the search radius.
    apart = 4 * radius
    tree = cKDTree(np.c_[along, apart * surface[border[index, 0]]])
    return tree.query(np.c_[points[rows], apart * surface[rows]], distance_upper_bound=2 * radius)[0]
