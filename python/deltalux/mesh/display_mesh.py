# SPDX-License-Identifier: Apache-2.0
"""Display mesh: the scene's triangles refined to a spacing; its vertices are the default samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from deltalux import _core
from deltalux.errors import OptionError, SceneError
from deltalux.scene import Scene
from deltalux.units import FARTHEST
from deltalux.vectors import barycentric

from .contact_cuts import cut_at_contacts
from .sharing import Sharing
from .smoothing import smooth_vertices
from .subdivision import TooManyPoints, count_halved_edges, split_long_edges

FRONT, BACK, BOTH = 1, 2, 3

DEFAULT_ADDED_SAMPLES = 50_000  # number of vertices that refinement adds if no spacing is given
MAX_SAMPLES = 2_000_000
VERTICES_PER_SQUARED_SPACING = 2.5  # measured on rooms: between 1.4 and 3 per area / spacing²
WELD_TOLERANCE = 2.0**-20  # as a share of the mesh's largest coordinate; float32 has 24 bits
COPLANAR_ANGLE = 0.5  # degrees; float32 positions alone make the normals of flat surfaces differ by this much

PER_VERTEX = ("points", "sample_points", "normals", "vertex_mesh", "attached")
PER_TRIANGLE = ("triangle_material", "triangle_mesh", "source_triangle", "reversed")

Poses = Mapping[str, Any]  # movable's name -> 4x4 pose, or None where it was removed


@dataclass(frozen=True, eq=False)
class Refinement:
    """Vertices added to a display mesh at edges of shadows, and the mesh without them.

    Parameters
    ----------
    vertices : (d,) int64, added vertices; they have no samples
    length : metres; edges shorter than this were not halved
    plain_triangles : (p, 3) int64, the triangles before refinement, over the present vertices
    plain_triangle : (m,) int64, for each triangle the plain triangle that contains it
    """

    vertices: np.ndarray
    length: float
    plain_triangles: np.ndarray
    plain_triangle: np.ndarray


@dataclass(frozen=True, eq=False)
class DisplayMesh:
    """Refined triangles of a scene, and the points where irradiance is estimated.

    Vertices of static meshes are in world space, those of movables in the movable's own space.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices; equal positions are one vertex inside a smoothing group of a mesh.
    sample_points : (n, 3) float64
        Where irradiance is estimated: the vertex, or, on creases and borders, a point slightly inside the
        adjacent faces, so that a disc's centre does not lie inside a neighbouring wall.
    normals : (n, 3) float64
        Angle-weighted mean of the face normals around the vertex, on the sampled side.
    triangles : (m, 3) int64
        Ordered by mesh, then by source triangle; counter-clockwise on the sampled side.
    triangle_material : (m,) int32, index into `scene.materials`
    triangle_mesh, vertex_mesh : (m,) and (n,) int32, index into `scene.meshes`
    source_triangle : (m,) int64, index into that mesh's triangles
    reversed : (m,) bool
        The sampled side is the source triangle's back.
    attached : (n,) int32
        Index of the movable mesh that a vertex moves with, -1 on static meshes.
    spacing : float
        No edge is longer than this, metres.
    sharing : Sharing or None
        Sharing of samples between vertices: only some vertices have a sample, and the others are
        interpolated from them; None: each vertex has its own sample, of the same number.
    refinement : Refinement or None
        Refinement at edges of shadows.
    """

    points: np.ndarray
    sample_points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    triangle_material: np.ndarray
    triangle_mesh: np.ndarray
    vertex_mesh: np.ndarray
    source_triangle: np.ndarray
    reversed: np.ndarray
    attached: np.ndarray
    spacing: float
    sharing: Sharing | None = None
    refinement: Refinement | None = None

    def misfit(self, scene: Scene) -> str | None:
        """What tells that this is no mesh of the scene's triangles; None if it may be."""
        sizes = np.array([len(mesh.triangles) for mesh in scene.meshes])
        moving = np.array([*(mesh.movable for mesh in scene.meshes), True])  # -1: attached to no movable

        def beyond(name: str, least: int, end: Any) -> str | None:
            values = getattr(self, name)
            bad = np.flatnonzero(~((values >= least) & (values < end)))
            if not len(bad):
                return None
            return f'"display/{name}": found {values.flat[bad[0]]} at entry {bad[0]}, beyond what there is'

        misfit = (
            beyond("triangles", 0, len(self.points))
            or beyond("triangle_material", 0, len(scene.materials))
            or beyond("triangle_mesh", 0, len(sizes))
            or beyond("vertex_mesh", 0, len(sizes))
            or beyond("attached", -1, len(sizes))
        )
        if misfit := misfit or beyond("source_triangle", 0, sizes[self.triangle_mesh]):
            return misfit
        if not moving[self.attached].all():
            return '"display/attached": found a static mesh, expected movable ones'
        return None

    @property
    def detail(self) -> np.ndarray | None:
        """(d,) int64: vertices added at edges of shadows; samples give them indirect light only."""
        return None if self.refinement is None else self.refinement.vertices

    @property
    def detail_length(self) -> float | None:
        """Metres: edges shorter than this were not halved at edges of shadows."""
        return None if self.refinement is None else self.refinement.length

    @property
    def sample_vertices(self) -> np.ndarray:
        """(s,) number of the vertex of each sample, in the order of the samples."""
        return np.arange(len(self.points)) if self.sharing is None else self.sharing.vertices

    def at_vertices(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) or (n, c) at the vertices, from values (s,) or (s, c) of the samples."""
        return values if self.sharing is None else self.sharing.at_vertices(values)

    def sample_areas(self) -> np.ndarray:
        """(s,) square metres that each sample represents: a third of the triangles around its vertices."""
        areas = self.vertex_areas()
        return areas if self.sharing is None else self.sharing.of_samples(areas)

    def same_triangles(self, other: DisplayMesh) -> bool:
        """Whether both are refined alike: meshes of one scene, whose plain triangles are the same."""
        mine, others = (self.points, self.triangles), (other.points, other.triangles)
        return all(map(np.array_equal, mine, others))

    def detail_in_plain(self) -> tuple[np.ndarray, np.ndarray]:
        """Where vertices of `detail` lie: three corners (d, 3) of a plain triangle, and weights (d, 3)."""
        own = self.refinement
        if own is None or len(own.vertices) == 0:
            return np.zeros((0, 3), np.int64), np.zeros((0, 3))
        part = np.zeros(len(self.points), np.int64)  # a triangle of each vertex
        part[self.triangles.ravel()] = np.repeat(np.arange(len(self.triangles)), 3)
        corners = own.plain_triangles[own.plain_triangle[part[own.vertices]]]
        return corners, barycentric(self.points[own.vertices], self.points[corners])

    def without_detail(self) -> DisplayMesh:
        """The mesh before refinement at edges of shadows; itself if there was no such refinement."""
        if self.refinement is None:
            return self
        kept = np.ones(len(self.points), dtype=bool)
        kept[self.refinement.vertices] = False
        number = np.cumsum(kept) - 1
        _, part = np.unique(self.refinement.plain_triangle, return_index=True)
        arrays = {name: getattr(self, name)[kept] for name in PER_VERTEX}
        arrays |= {name: getattr(self, name)[part] for name in PER_TRIANGLE}
        arrays["triangles"] = number[self.refinement.plain_triangles]
        for array in arrays.values():
            array.setflags(write=False)
        return replace(self, **arrays, sharing=self._sharing_of(kept, number), refinement=None)

    def _sharing_of(self, kept: np.ndarray, number: np.ndarray) -> Sharing | None:
        """The sharing of the vertices that are `kept` (n,), renumbered by `number` (n,)."""
        own = self.sharing
        if own is None or len(own.vertices) == np.count_nonzero(kept):  # each has its own sample
            return None
        return Sharing(number[own.vertices], own.samples[kept], own.weights[kept])

    def world(
        self, scene: Scene, poses: Poses | None = None, samples: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (or their sample points) and normals in world space, movables at `poses`, else as loaded.

        Both are (n, 3).
        """
        present = {i: pose for i, pose in movable_poses(scene, poses).items() if pose is not None}
        points = self.sample_points if samples else self.points
        return in_world(points, self.normals, self.attached, present)

    def vertex_areas(self) -> np.ndarray:
        """(n,) square metres: a third of the triangles around each vertex."""
        thirds = np.repeat(np.asarray(_core.areas(self.points, self.triangles)) / 3, 3)
        return np.bincount(self.triangles.ravel(), thirds, minlength=len(self.points))

    def present(self, scene: Scene, poses: Poses | None = None) -> np.ndarray:
        """(m,) bool: triangles that are not part of a removed movable."""
        removed = [i for i, pose in movable_poses(scene, poses).items() if pose is None]
        return ~np.isin(self.triangle_mesh, removed)


def movable_poses(scene: Scene, poses: Poses | None) -> dict[int, np.ndarray | None]:
    """Pose of each movable by mesh index: from `poses`, else as loaded; None if removed."""
    given = poses or {}
    unknown = set(given) - set(scene.movable)
    if unknown:
        raise OptionError(f"poses: found {sorted(unknown)}, expected movables; the scene has {scene.movable}")
    return {i: given.get(m.name, m.pose) for i, m in enumerate(scene.meshes) if m.movable}


def in_world(
    points: np.ndarray, normals: np.ndarray, attached: np.ndarray, poses: Mapping[Any, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Copies, each (n, 3), with the points `attached` (n,) to a movable transformed by its pose (4, 4).

    `attached` and `poses` name movables; points attached to none of `poses` stay unchanged.
    """
    points, normals = points.copy(), normals.copy()
    for movable, pose in poses.items():
        own = attached == movable
        points[own] = points[own] @ pose[:3, :3].T + pose[:3, 3]
        normals[own] = normals[own] @ pose[:3, :3].T
    return points, normals


def refine(
    scene: Scene, spacing: float | None = None, max_samples: int = MAX_SAMPLES, sides: Any = None
) -> DisplayMesh:
    """Refine the scene's triangles until no edge is longer than `spacing`.

    Degenerate triangles (without area) are dropped.

    Parameters
    ----------
    scene : Scene
    spacing : float or None
        Metres; None chooses one that adds some 50,000 samples to the scene's own vertices.
    max_samples : int
        Raise an error rather than make more vertices than this.
    sides : (triangles of all meshes,) int array or None
        Side of each triangle to sample, in the order of `scene.meshes`: `FRONT` (1), `BACK` (2)
        or `BOTH` (3); None = front everywhere. A triangle that is sampled on both sides appears
        twice, once with reversed winding.

    Raises
    ------
    OptionError
        If the spacing is not positive, or needs more than `max_samples` vertices; the message then
        gives a spacing that fits.
    """
    base = _welded(scene, _checked_sides(scene, sides))
    if spacing is None:
        spacing = _automatic_spacing(base)
    elif not 0 < spacing <= FARTHEST:
        raise OptionError(
            f"spacing: found {spacing}, expected a positive number of metres, at most {FARTHEST:g}"
        )
    # otherwise far too many vertices would result, and refinement is not tried
    if _area(base) <= 2 * max_samples * spacing**2:
        try:
            return _refined(scene, base, float(spacing), max_samples)
        except TooManyPoints:
            pass
    fits = _fitting_spacing(scene, base, spacing, max_samples)
    if fits is None:
        remedy = "the scene's own vertices are more than that; give a larger max_samples"
    else:
        remedy = f"a spacing of {fits:g} m fits, or give a larger max_samples"
    raise OptionError(f"spacing: found {spacing:g} m, which needs more than {max_samples} samples; {remedy}")


@dataclass(frozen=True, eq=False)
class _Base:
    """The scene's triangles over positions welded per mesh, before refinement."""

    points: np.ndarray  # (n, 3)
    point_mesh: np.ndarray  # (n,)
    triangles: np.ndarray  # (m, 3)
    mesh: np.ndarray  # (m,)
    material: np.ndarray  # (m,)
    source: np.ndarray  # (m,)
    reversed: np.ndarray  # (m,)


def _checked_sides(scene: Scene, sides: Any) -> np.ndarray:
    count = sum(len(m.triangles) for m in scene.meshes)
    if sides is None:
        return np.full(count, FRONT)
    array = np.asarray(sides)
    if array.shape != (count,) or not np.isin(array, (FRONT, BACK, BOTH)).all():
        raise OptionError(
            f"sides: found shape {array.shape} with values {np.unique(array)[:5]}, "
            f"expected ({count},) of 1 (front), 2 (back) or 3 (both)"
        )
    return array


def _welded(scene: Scene, sides: np.ndarray) -> _Base:
    if not any(len(m.triangles) for m in scene.meshes):
        raise SceneError("display mesh: found a scene without triangles, expected at least one")
    representative, triangles = weld(scene)
    points = np.concatenate([m.vertices if m.movable else m.world_vertices for m in scene.meshes])
    triangle_counts = [len(m.triangles) for m in scene.meshes]
    point_mesh = np.repeat(np.arange(len(scene.meshes)), [len(m.vertices) for m in scene.meshes])
    material_of = {m.name: i for i, m in enumerate(scene.materials)}
    material = np.concatenate(
        [np.array([material_of[name] for name in m.material])[m.material_index] for m in scene.meshes]
    )
    mesh = np.repeat(np.arange(len(scene.meshes)), triangle_counts)
    source = np.concatenate([np.arange(n) for n in triangle_counts])

    # Both sides of a triangle stay adjacent, so that triangles remain ordered by source.
    order = np.repeat(np.arange(len(triangles)), np.where(sides == BOTH, 2, 1))
    second = np.r_[False, order[1:] == order[:-1]]
    backward = (sides[order] == BACK) | second
    triangles = triangles[order]
    triangles[backward] = triangles[backward][:, (0, 2, 1)]
    base = _Base(
        points[representative],
        point_mesh[representative],
        triangles,
        mesh[order],
        material[order],
        source[order],
        backward,
    )
    return _without(base, np.asarray(_core.without_area(base.points, base.triangles)))


def _without(base: _Base, dropped: np.ndarray) -> _Base:
    if dropped.all():
        raise SceneError("display mesh: found no triangle with an area, expected at least one")
    keep = ~dropped
    return _Base(
        base.points,
        base.point_mesh,
        base.triangles[keep],
        base.mesh[keep],
        base.material[keep],
        base.source[keep],
        base.reversed[keep],
    )


def weld(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Merge vertices of a mesh whose positions differ by rounding only.

    Returns
    -------
    representative : (k,) for each merged vertex, the number of one of the original vertices
    triangles : (m, 3), the triangles of all meshes over the merged vertices
    """
    first = np.cumsum([0, *(len(m.vertices) for m in scene.meshes)])
    points = np.concatenate([m.vertices for m in scene.meshes])
    representative, position = _core.welded_points(points, first, WELD_TOLERANCE)
    ends = zip(scene.meshes, first[:-1], strict=True)
    return representative, position[np.concatenate([m.triangles + k for m, k in ends])]


def _area(base: _Base) -> float:
    return float(np.asarray(_core.areas(base.points, base.triangles)).sum())


def _automatic_spacing(base: _Base) -> float:
    """Spacing that adds about DEFAULT_ADDED_SAMPLES vertices, to two digits."""
    spacing = np.sqrt(VERTICES_PER_SQUARED_SPACING * _area(base) / DEFAULT_ADDED_SAMPLES)
    for _ in range(4):
        spacing = float(f"{spacing:.2g}")
        # Long thin triangles need more vertices than their area suggests.
        added = _added_points(base, spacing, 8 * DEFAULT_ADDED_SAMPLES)
        ratio = added / DEFAULT_ADDED_SAMPLES
        if ratio <= 1.2:
            break
        spacing *= np.sqrt(ratio)
    return float(f"{spacing:.2g}")


def _added_points(base: _Base, spacing: float, at_most: int) -> int:
    limit = len(base.points) + at_most
    try:
        return count_halved_edges(base.points, base.triangles, spacing, limit)
    except TooManyPoints:
        return at_most


def _fitting_spacing(scene: Scene, base: _Base, spacing: float, max_samples: int) -> float | None:
    diagonal = float(np.linalg.norm(np.ptp(base.points, axis=0)))
    likely = float(np.sqrt(4 * VERTICES_PER_SQUARED_SPACING * _area(base) / max_samples))
    trial = max(spacing, likely)
    while trial < 2 * diagonal:
        trial = float(f"{1.25 * trial:.2g}")
        try:
            _refined(scene, base, trial, max_samples)
        except TooManyPoints:
            continue
        return trial
    return None


def _refined(scene: Scene, base: _Base, spacing: float, max_samples: int) -> DisplayMesh:
    points, triangles, parent = split_long_edges(base.points, base.triangles, spacing, max_samples)
    movable = np.array([m.movable for m in scene.meshes])
    body = np.where(movable[base.mesh], base.mesh, -1)  # the static meshes are one body
    cut = cut_at_contacts(points, triangles, parent, base.triangles, body, base.mesh, spacing, max_samples)
    # Cuts through slivers leave pieces whose corners coincide; they have no normal.
    kept = ~np.asarray(_core.without_area(cut.points, cut.triangles))
    points, triangles, parent = cut.points, cut.triangles[kept], parent[cut.source[kept]]
    parted, beside = cut.parted[kept], cut.beside[kept]
    mesh = base.mesh[parent]
    angles = np.array([max(m.smooth_angle, COPLANAR_ANGLE) for m in scene.meshes])
    cosine = np.cos(np.radians(angles))[mesh]
    vertices = smooth_vertices(points, triangles, cosine, parted, beside, spacing, max_samples)
    if vertices is None:
        raise TooManyPoints
    vertex_points = points[triangles.ravel()[vertices.corner]]
    vertex_mesh = mesh[vertices.corner // 3]
    arrays = {
        "points": vertex_points,
        "sample_points": vertex_points + vertices.insets,
        "normals": vertices.normals,
        "triangles": vertices.triangles,
        "triangle_material": base.material[parent].astype(np.int32),
        "triangle_mesh": mesh.astype(np.int32),
        "vertex_mesh": vertex_mesh.astype(np.int32),
        "source_triangle": base.source[parent],
        "reversed": base.reversed[parent],
        "attached": np.where(movable[vertex_mesh], vertex_mesh, -1).astype(np.int32),
    }
    for array in arrays.values():
        array.setflags(write=False)
    return DisplayMesh(**arrays, spacing=spacing)
