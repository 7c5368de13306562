# SPDX-License-Identifier: Apache-2.0
"""Surfaces cut where others cross them or stand on them: no light is interpolated past a wall's foot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deltalux import _core
from deltalux.vectors import same_places, unit

from .contact_lines import contact_lines
from .contact_sides import open_sides
from .covered_places import Cover
from .line_splitting import CutMesh, split_along

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
    wide = _core.wide_triangles(points, triangles[own], SMALLEST * spacing, NARROWEST * spacing)
    own = own[np.asarray(wide)]
    tolerance = TOLERANCE * spacing
    number = np.cumsum(static) - 1
    faces, looked_at = base[static], triangles[own]
    places = same_places(points[: base.max() + 1])[faces]
    lines = contact_lines(points, looked_at, number[parent[own]], faces, places, GAP * spacing, tolerance)
    normals = unit(np.asarray(_core.normals_by_area(points, looked_at[lines.triangle])))
    again = np.asarray(_core.repeated_triangles(places, len(points)))
    cover = Cover.of(points, faces, again, spacing)
    sides = open_sides(lines, normals, cover, ASIDE * spacing)
    kept = np.flatnonzero(sides.any(axis=1))
    lines = replace(lines.those(kept), triangle=own[lines.triangle[kept]])
    most = min(max_points, len(points) + max(FEW_ADDED, int(MOST_ADDED * len(points))))
    cut = split_along(points, triangles, mesh[parent], lines, sides[kept], tolerance, most)
    judged = np.zeros(len(triangles), dtype=bool)
    judged[own] = True
    pieces = judged[cut.source]
    places = same_places(cut.points)[cut.triangles[pieces]]
    cut.parted[pieces] |= np.asarray(_core.junctions(cut.points, places, SHORTEST * spacing))
    return cut
