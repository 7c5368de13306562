# SPDX-License-Identifier: Apache-2.0
"""Determines which sides of the triangles light reaches, and so which sides need samples.

A room's triangles may wind outward, and a curtain or a partition may be one sheet that is lit and visible
from both sides. A small pilot counts where light lands; connected surfaces share their counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from deltalux.mesh.display_mesh import BACK, BOTH, COPLANAR_ANGLE, FRONT, weld
from deltalux.mesh.smoothing import shared_edges, smoothing_groups
from deltalux.mesh.surfaces import NOTHING, core_caster
from deltalux.scene import Mesh, Scene, replace_scene
from deltalux.segments import landings, uniform_lines
from deltalux.vectors import normals_by_area

SEED = 20070612  # seed of the pilot alone; sessions may have any seed
PATHS_PER_TRIANGLE = 200
PATHS = (20_000, 200_000)  # bounds of the number of paths
BOUNCES = 16
LINES = 4096  # lines through a movable, each traced from both ends

LIT = 0.005  # a side with at least this share of a triangle's hits counts as lit
# a closed surface whose front is inside is a room only if at least this share of its hits is on the front
INSIDE_OUT = 0.1
FEWEST = 3  # least number of hits; one or two may have leaked through a crack
FRONT_HINT = 0.1  # hits on the front that are assumed where nothing is known

Counts = np.ndarray  # (m, 2): hits from the front and from the back


def lit_sides(scene: Scene) -> np.ndarray:
    """Choose for each triangle the side or sides that light reaches.

    Static triangles are judged by light paths among the static meshes alone, movables by the sides that are
    visible from all around: the places of samples must not depend on the movables' poses.
    A closed surface has one such side. Without light, the front is chosen.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    (triangles of all meshes,) int64: FRONT, BACK or BOTH, in the order of `scene.meshes`
    """
    sides = np.full(sum(len(m.triangles) for m in scene.meshes), FRONT)
    if len(sides) == 0:
        return sides
    _, triangles = weld(scene)
    # degenerate triangles have no sides
    kept = np.flatnonzero((triangles != triangles[:, (1, 2, 0)]).all(axis=1))
    if len(kept) == 0:
        return sides
    mesh = np.repeat(np.arange(len(scene.meshes)), [len(m.triangles) for m in scene.meshes])[kept]
    counts = _hits(scene)[kept]
    corners = np.concatenate([m.vertices[m.triangles] for m in scene.meshes])[kept]
    sides[kept] = _decide(scene, mesh, triangles[kept], corners, counts)
    return sides


# ---- hits ------------------------------------------------------------------------------------------


def _hits(scene: Scene) -> Counts:
    """Hits of each triangle, front and back, of all meshes."""
    per_mesh = [np.zeros((len(m.triangles), 2)) for m in scene.meshes]
    static = [i for i, m in enumerate(scene.meshes) if not m.movable]
    lit = _hits_by_light(scene) if static else np.zeros((0, 2))
    ends = np.cumsum([len(scene.meshes[i].triangles) for i in static])
    for i, end in zip(static, ends, strict=True):
        per_mesh[i] = lit[end - len(scene.meshes[i].triangles) : end]
    for i, movable in enumerate(scene.meshes):
        if movable.movable and len(movable.triangles):
            per_mesh[i] = _hits_from_outside(movable)
    return np.concatenate(per_mesh)


def _hits_by_light(scene: Scene) -> Counts:
    """Light paths that land on static triangles, in the scene without movables and their lights."""
    meshes = [m for m in scene.meshes if not m.movable]
    lights = [light for light in scene.lights if light.attached_to is None]
    static = replace_scene(scene, meshes=meshes, lights=lights)
    triangles = sum(len(m.triangles) for m in meshes)
    if triangles == 0 or not static.groups:
        return np.zeros((triangles, 2))
    paths = int(np.clip(PATHS_PER_TRIANGLE * triangles, *PATHS))
    triangle, direction = landings(static, paths, SEED, BOUNCES)
    corners = np.concatenate([m.world_vertices[m.triangles] for m in meshes])
    return _counted(triangle, direction, corners)


def _hits_from_outside(mesh: Mesh) -> Counts:
    """First hits of uniform lines from all directions on the mesh alone."""
    used = mesh.vertices[mesh.triangles.ravel()]
    low, high = used.min(axis=0), used.max(axis=0)
    reach = 0.51 * np.linalg.norm(high - low)
    lines = uniform_lines(LINES, SEED)
    start = lines.origin * reach
    end = start + lines.direction * (lines.length[:, None] * reach)
    origins = np.concatenate([start, end])
    directions = np.concatenate([lines.direction, -lines.direction])
    around = (mesh.vertices - 0.5 * (low + high)).astype(np.float32)
    caster = core_caster(around, mesh.triangles.astype(np.uint32), 0)
    _, triangle, _, _ = caster.intersect(origins.astype(np.float32), directions.astype(np.float32))
    return _counted(triangle, directions, mesh.vertices[mesh.triangles])


def _counted(triangle: np.ndarray, direction: np.ndarray, corners: np.ndarray) -> Counts:
    hit = triangle != NOTHING
    triangle = triangle[hit].astype(np.int64)
    back = np.einsum("ij,ij->i", direction[hit], normals_by_area(corners)[triangle]) > 0
    return np.bincount(2 * triangle + back, minlength=2 * len(corners)).reshape(-1, 2).astype(float)


# ---- decision --------------------------------------------------------------------------------------


def _decide(
    scene: Scene, mesh: np.ndarray, triangles: np.ndarray, corners: np.ndarray, counts: Counts
) -> np.ndarray:
    one, two = shared_edges(triangles, int(triangles.max()) + 1)
    apex = np.roll(triangles, -2, axis=1).ravel()
    # of a triangle with both windings, it is arbitrary which one a ray hits
    doubled = apex[one] == apex[two]
    second, at = np.unique(two[doubled] // 3, return_index=True)
    counts = counts.copy()
    np.add.at(counts, one[doubled][at] // 3, counts[second][:, ::-1])
    counts[second] = 0
    one, two = one[~doubled], two[~doubled]

    count = len(triangles)
    component = smoothing_groups((one // 3, two // 3), count)
    patch = smoothing_groups(_smooth(scene, mesh, corners, one // 3, two // 3), count)
    pooled = [_pooled(counts, labels) for labels in (mesh, component, patch)] + [counts]
    hits = _evidence(pooled)
    lit_back = _share(hits, 1) >= LIT
    dark_front = _share(hits, 0) < LIT

    # The inside of a closed surface is not visible from outside. Lamps that are partly inside a beam do light
    # its inside, though; therefore one side is chosen for the whole surface.
    closed = _closed(one, two, component)
    whole = _evidence(pooled[:2])
    doubted = np.where(_inward(component, corners), INSIDE_OUT, LIT)
    dark_front[closed] = (_share(whole, 0) < doubted)[closed]
    lit_back[closed] = dark_front[closed]
    hits[closed] = whole[closed]

    sides = np.where(dark_front & ~_needs_front(scene, mesh), BACK, BOTH)
    sides[~lit_back | (hits[:, 1] < FEWEST)] = FRONT
    sides[second] = FRONT
    return sides


def _share(hits: Counts, side: int) -> np.ndarray:
    return hits[:, side] / hits.sum(axis=1)


def _smooth(
    scene: Scene, mesh: np.ndarray, corners: np.ndarray, one: np.ndarray, two: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Those pairs of neighbours that continue each other without a crease."""
    normals = normals_by_area(corners)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    angles = np.array([max(m.smooth_angle, COPLANAR_ANGLE) for m in scene.meshes])
    smooth = np.einsum("ij,ij->i", normals[one], normals[two]) >= np.cos(np.radians(angles))[mesh[one]]
    return one[smooth], two[smooth]


def _closed(one: np.ndarray, two: np.ndarray, component: np.ndarray) -> np.ndarray:
    """(m,) bool: the triangle belongs to a component without open or unequally shared edges."""
    partners = np.bincount(np.concatenate([one, two]), minlength=3 * len(component))
    is_open = (partners == 0).reshape(-1, 3).any(axis=1)
    is_open[one[partners[one] != partners[two]] // 3] = True
    return np.bincount(component, is_open)[component] == 0


def _inward(component: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(m,) bool: the front of a closed surface is inside: a room, or an object with inverted winding."""
    near = corners[np.unique(component, return_index=True)[1][component], 0]
    volumes = np.einsum("ij,ij->i", corners[:, 0] - near, normals_by_area(corners))
    return np.bincount(component, volumes)[component] < 0


def _pooled(counts: Counts, labels: np.ndarray) -> Counts:
    """Sums of the triangles with the same label."""
    return np.stack([np.bincount(labels, column)[labels] for column in counts.T], axis=1)


def _evidence(pooled: Sequence[Counts]) -> Counts:
    """Hits of each triangle together with its surroundings, from the widest to the narrowest.

    A triangle with many hits is judged by them alone. Hits taken over from the surroundings count at most
    as much as the hits that just suffice for a decision.
    """
    hits = np.tile((FRONT_HINT, 0.0), (len(pooled[0]), 1))
    for wider, narrower in pairwise([*pooled, np.zeros_like(hits)]):
        total = hits.sum(axis=1, keepdims=True)
        hits *= np.minimum(1.0, FEWEST / LIT / total)
        hits += wider - narrower
    return hits


def _needs_front(scene: Scene, mesh: np.ndarray) -> np.ndarray:
    """(m,) bool: the front gets samples even if the pilot finds it dark."""
    luminous = np.array([any(scene.material(n).emissive for n in m.material) for m in scene.meshes])
    movable = np.array([m.movable for m in scene.meshes])
    if (luminous & movable).any() or any(light.attached_to for light in scene.lights):
        return np.full(len(mesh), True)  # light that the pilot does not include may reach it
    return luminous[mesh]
