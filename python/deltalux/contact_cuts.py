# SPDX-License-Identifier: Apache-2.0
"""Surfaces cut where others cross them or stand on them: no light is interpolated past a wall's foot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .contact_lines import contact_lines
from .contact_sides import open_sides
from .covered_places import Cover
from .line_splitting import CutMesh, split_along
from .vectors import normals_by_area, same_places, triangle_areas, unit

SMALLEST = 0.5  # of the spacing, longest edge of triangles that are cut; light reaches no farther in others

NARROWEST = 0.08  # of the spacing, height of triangles that are cut; on others all lines are one
GAP = 0.1  # of the spacing, as of covered places: what ends so close to a surface stands on it
TOLERANCE = 0.02  # of the spacing; how far cuts may be off
ASIDE = 0.04  # of the spacing, how far beside a line is asked whether it is open
SHORTEST = 0.25  # of the spacing, edges of three triangles at which light is parted
MOST_ADDED = 0.5  # of the points, where they are many
FEW_ADDED = 20_000  # points, where they are few


def cut_at_contacts(
    points: np.ndarray,
    triangles: np.ndarray,
    parent: np.ndarray,
    base: np.ndarray,
    static: np.ndarray,
    mesh: np.ndarray,
    spacing: float,
    max_points: int,
) -> CutMesh:
    """Cut refined triangles of static meshes along the lines where others of them meet them.

    Not where both sides of a line are covered. Edges that three triangles and more share are such lines.

    Parameters
    ----------
    points : (n, 3)
    triangles : (m, 3), no edge longer than `spacing`
    parent : (m,) int64, the base triangle that each is a part of
    base : (b, 3) int64, corners among `points`, counter-clockwise on a side that light may reach
    static : (b,) bool, of meshes that never move
    mesh : (b,) int64
    spacing : metres
    max_points : cuts end there, or where they have added half of the points, or 20,000
    """
    own = np.flatnonzero(static[parent])
    corners = points[triangles[own]]
    worth = _worth_cutting(corners, spacing)
    own, corners = own[worth], corners[worth]
    faces = points[base[static]]
    tolerance = TOLERANCE * spacing
    number = np.cumsum(static) - 1
    places = same_places(points[: base.max() + 1])[base[static]]
    lines = contact_lines(corners, number[parent[own]], faces, places, GAP * spacing, tolerance)
    normals = unit(normals_by_area(corners))[lines.triangle]
    cover = Cover.of(points, base[static], _again(places), spacing)
    sides = open_sides(lines, normals, cover, ASIDE * spacing)
    kept = np.flatnonzero(sides.any(axis=1))
    lines = replace(lines.those(kept), triangle=own[lines.triangle[kept]])
    most = min(max_points, len(points) + max(FEW_ADDED, int(MOST_ADDED * len(points))))
    cut = split_along(points, triangles, mesh[parent], lines, sides[kept], tolerance, most)
    judged = np.zeros(len(triangles), dtype=bool)
    judged[own] = True
    pieces = judged[cut.source]
    places = same_places(cut.points)[cut.triangles[pieces]]
    cut.parted[pieces] |= _junctions(cut.points, places, SHORTEST * spacing)
    return cut


def _worth_cutting(corners: np.ndarray, spacing: float) -> np.ndarray:
    """(m,) bool: triangles so large, and not too narrow."""
    edges = corners - corners[:, (1, 2, 0)]
    longest = np.sqrt(np.einsum("kci,kci->kc", edges, edges).max(axis=1, initial=0.0))
    return (longest >= SMALLEST * spacing) & (2 * triangle_areas(corners) >= NARROWEST * spacing * longest)


def _again(triangles: np.ndarray) -> np.ndarray:
    """(m,) bool: triangles whose corners are those of an earlier one, in whatever order."""
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    again = np.ones(len(triangles), dtype=bool)
    again[first] = False
    return again


def _junctions(points: np.ndarray, triangles: np.ndarray, shortest: float) -> np.ndarray:
    """(m, 3) bool: edges that belong to three triangles and more; both windings of one count once."""
    ends = np.sort(np.stack([triangles, triangles[:, (1, 2, 0)]], axis=-1), axis=-1).reshape(-1, 2)
    long = np.flatnonzero(np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1) >= shortest)
    edge = ends[long, 0] * len(points) + ends[long, 1]
    apex = triangles[:, (2, 0, 1)].ravel()[long]
    order = np.lexsort((apex, edge))
    edge, apex = edge[order], apex[order]
    new = np.ones(len(edge), dtype=bool)
    new[1:] = edge[1:] != edge[:-1]
    another = new.copy()
    another[1:] |= apex[1:] != apex[:-1]
    number = np.cumsum(new) - 1
    found = np.zeros(triangles.size, dtype=bool)
    found[long[order]] = (np.bincount(number, another) > 2)[number]
    return found.reshape(-1, 3)
