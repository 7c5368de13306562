# SPDX-License-Identifier: Apache-2.0
"""Cuts surfaces where others cross or touch them, so that no light is interpolated across a wall's foot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deltalux import _core
from deltalux.vectors import same_places, unit

from .contact_lines import contact_lines
from .contact_sides import open_sides
from .covered_places import Cover
from .line_splitting import CutMesh, split_along

# as a share of the spacing: triangles whose longest edge is shorter are not cut, because light is
# interpolated no farther inside them
SMALLEST = 0.5

# as a share of the spacing: least height of triangles that are cut; in others all lines coincide
NARROWEST = 0.08
# as a share of the spacing, as for covered places: a surface that ends this close to another touches it
GAP = 0.1
TOLERANCE = 0.02  # as a share of the spacing: tolerance of cuts
ASIDE = 0.04  # as a share of the spacing: distance from a line at which its sides are tested
SHORTEST = 0.25  # as a share of the spacing: shortest edge of three triangles that counts as a contact
MOST_ADDED = 0.5  # most points added, as a share of all points
FEW_ADDED = 20_000  # or this number of points, if it is larger


def cut_at_contacts(
    points: np.ndarray,
    triangles: np.ndarray,
    parent: np.ndarray,
    base: np.ndarray,
    body: np.ndarray,
    mesh: np.ndarray,
    spacing: float,
    max_points: int,
) -> CutMesh:
    """Cut refined triangles along the lines where other triangles of the same body meet them.

    Lines with both sides covered are ignored. Edges that three or more triangles share count as contacts.

    Parameters
    ----------
    points : (n, 3); each belongs to one body
    triangles : (m, 3), no edge longer than `spacing`
    parent : (m,) int64, the base triangle that each triangle is a part of
    base : (b, 3) int64, corners among `points`, counter-clockwise on a side that light may reach
    body : (b,) int64, what the triangle is rigidly joined to: where other bodies are may change
    mesh : (b,) int64
    spacing : metres
    max_points : cutting a body ends there, or after adding half of its points, or 20,000 if that is more
    """
    parts, count = [], len(points)
    for faces, rows in zip(_grouped(body), _grouped(body[parent]), strict=True):
        used = np.union1d(base[faces], triangles[rows])
        cut = _cut_body(
            points[used],
            np.searchsorted(used, triangles[rows]),
            np.searchsorted(faces, parent[rows]),
            np.searchsorted(used, base[faces]),
            mesh[faces],
            spacing,
            max_points - count + len(used),
        )
        added = cut.points[len(used) :]
        numbers = np.concatenate([used, count + np.arange(len(added))])
        count += len(added)
        parts.append(replace(cut, points=added, triangles=numbers[cut.triangles], source=rows[cut.source]))
    order = np.argsort(np.concatenate([part.source for part in parts]), kind="stable")
    names = ("triangles", "source", "parted", "beside")
    joined = {name: np.concatenate([getattr(part, name) for part in parts])[order] for name in names}
    return CutMesh(np.concatenate([points, *(part.points for part in parts)]), **joined)


def _grouped(numbers: np.ndarray) -> list[np.ndarray]:
    """The places of each number that occurs, ascending."""
    order = np.argsort(numbers, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(numbers[order])) + 1)


def _cut_body(
    points: np.ndarray,
    triangles: np.ndarray,
    parent: np.ndarray,
    faces: np.ndarray,
    mesh: np.ndarray,
    spacing: float,
    max_points: int,
) -> CutMesh:
    """`cut_at_contacts` of one body, whose base triangles are `faces`."""
    judged = np.asarray(_core.wide_triangles(points, triangles, SMALLEST * spacing, NARROWEST * spacing))
    own = np.flatnonzero(judged)
    tolerance = TOLERANCE * spacing
    looked_at = triangles[own]
    places = same_places(points[: faces.max() + 1])[faces]
    lines = contact_lines(points, looked_at, parent[own], faces, places, GAP * spacing, tolerance)
    normals = unit(np.asarray(_core.normals_by_area(points, looked_at[lines.triangle])))
    again = np.asarray(_core.repeated_triangles(places, len(points)))
    cover = Cover.of(points, faces, again, spacing)
    sides = open_sides(lines, normals, cover, ASIDE * spacing)
    kept = np.flatnonzero(sides.any(axis=1))
    lines = replace(lines.those(kept), triangle=own[lines.triangle[kept]])
    most = min(max_points, len(points) + max(FEW_ADDED, int(MOST_ADDED * len(points))))
    cut = split_along(points, triangles, mesh[parent], lines, sides[kept], tolerance, most)
    pieces = judged.astype(bool)[cut.source]
    places = same_places(cut.points)[cut.triangles[pieces]]
    cut.parted[pieces] |= np.asarray(_core.junctions(cut.points, places, SHORTEST * spacing))
    return cut
