# SPDX-License-Identifier: Apache-2.0
"""Refines display meshes at edges of shadows and of spots' pools of light, where samples are too sparse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from deltalux import _core
from deltalux.errors import OptionError
from deltalux.scene import Scene, replace_scene
from deltalux.scene.flatten import flatten
from deltalux.units import FARTHEST, PHOTOPIC_WEIGHTS
from deltalux.vectors import same_places, unit

from .display_mesh import DisplayMesh, Refinement
from .sharing import NEIGHBOURS, Sharing
from .smoothing import INSET_OF_SPACING
from .subdivision import split_marked

SEED = 20070613  # seed of the shadow rays that decide on refinement; sessions may have any seed
OF_SPACING = 0.25  # default of the smallest detail, as a share of the spacing
MOST_ADDED = 1.0  # most vertices added, as a share of the present number
ROUNDS = 6
# most tests of a place against an emitting triangle or lamp in one refinement; a round that would exceed them
# is not begun
MOST_TESTS = 100_000_000
CHANGE = 0.1  # tolerated error of interpolated light, as a share of the light plus DIM times the mean light
DIM = 0.5  # share of the mean over lit places; see CHANGE

SHORTEST = 1e-200  # metres; a multiple of less may be beyond float64

Light = Callable[[np.ndarray, np.ndarray], np.ndarray]


def with_detail(scene: Scene, display: DisplayMesh, detail: float | str | None) -> DisplayMesh:
    """The display mesh, refined by `refined_at_shadows` at edges of shadows among static lights and meshes.

    The result does not depend on the movables' poses. None leaves the mesh unchanged.

    Raises
    ------
    OptionError
    """
    if detail is None:
        return display
    length = detail_length(display, detail)
    light = _static_light(scene)
    return display if light is None else refined_at_shadows(scene, display, light, length)


def detail_length(display: DisplayMesh, detail: float | str) -> float:
    """Metres: the given length, or a quarter of the spacing for "auto".

    Raises
    ------
    OptionError
    """
    length = OF_SPACING * display.spacing if detail == "auto" else detail
    if isinstance(length, str) or not 0 < length <= FARTHEST:
        raise OptionError(f'detail: found {detail!r}, expected metres up to {FARTHEST:g}, "auto" or None')
    return float(length)


def refined_at_shadows(scene: Scene, display: DisplayMesh, light: Light, detail: float) -> DisplayMesh:
    """The display mesh with static triangles refined where direct light is not linear inside them.

    Added vertices have no samples; they share those of the triangle that they lie in.

    Parameters
    ----------
    display : without detail
    light : photopic direct light at places (k, 3) in world space with normals (k, 3)
    detail : metres; edges shorter than this are not halved
    """
    most_asked = MOST_TESTS // max(1, _emitters(scene))
    return _Refinement(display, light, detail, most_asked).finished()


def _emitters(scene: Scene) -> int:
    emissive = {m.name for m in scene.materials if m.emissive}
    shining = (np.isin(m.material, list(emissive))[m.material_index].sum() for m in scene.meshes)
    return len(scene.lights) + int(sum(shining))


def _static_light(scene: Scene) -> Light | None:
    """Photopic direct light at places with normals; None if the scene has no light."""
    meshes = [m for m in scene.meshes if not m.movable]
    lights = [light for light in scene.lights if light.attached_to is None]
    static = replace_scene(scene, meshes=meshes, lights=lights)
    if not static.groups or not any(len(m.triangles) for m in meshes):
        return None
    flat = flatten(static)
    core = _core.DirectAt(flat.core, SEED, 0, None)

    def light(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        where = np.ascontiguousarray(flat.points(points), np.float32)
        return np.asarray(core.at(where, np.ascontiguousarray(normals, np.float32), None)) @ PHOTOPIC_WEIGHTS

    return light


class _Refinement:
    """The mesh during refinement; added vertices follow the given ones."""

    def __init__(self, display: DisplayMesh, light: Light, detail: float, most_asked: int) -> None:
        self.display, self.detail, self._light_at = display, detail, light
        self.may_ask = most_asked
        self.points, self.normals = display.points, display.normals
        self.samples = display.sample_points  # where light is evaluated
        self.mesh = display.vertex_mesh
        self.shares = _shares(display)
        count = len(self.points)
        still = (display.attached[display.triangles] < 0).all(axis=1)
        # Movables are excluded: no two of their places ever count as equal.
        self.place = np.arange(count)
        static = np.flatnonzero(display.attached < 0)
        self.place[static] = static[same_places(self.points[static])]
        large = still & (self._lengths(display.triangles).max(axis=1) > detail)
        touched = np.zeros(count, dtype=bool)
        touched[self.place[display.triangles[large]]] = True
        beside = still & (touched[self.place[display.triangles]].sum(axis=1) >= 2)
        self.source = np.flatnonzero(beside)
        self.triangles = display.triangles[beside]
        self.open = large[beside]
        self.light = np.full(count, np.nan)  # NaN: not evaluated yet
        if np.count_nonzero(self.open) > self.may_ask:
            self.open[:] = False
        self._learn_light()
        bright = self.light[self.light > 0]
        self.dim = DIM * float(bright.mean()) if len(bright) else 0.0
        self.most = count + int(MOST_ADDED * count)
        if self.dim > 0:
            for _ in range(ROUNDS):
                if not self._halve_where_needed():
                    break

    def _learn_light(self) -> None:
        """Evaluate light at all corners of open triangles."""
        corners = np.unique(self.triangles[self.open])
        corners = corners[np.isnan(self.light[corners])]
        self.light[corners] = self._light_at(self.samples[corners], self.normals[corners])

    def _lengths(self, triangles: np.ndarray) -> np.ndarray:
        corners = self.points[triangles]
        return np.linalg.norm(corners - corners[:, (1, 2, 0)], axis=2)

    def _halve_where_needed(self) -> bool:
        ends = _ends(self.triangles)
        long = self._lengths(self.triangles) > self.detail
        self.open &= long.any(axis=1)
        rows = np.flatnonzero(self.open)
        # estimate of the places per triangle: corners, edge midpoints and centre
        self.may_ask -= 2 * len(rows)
        if len(rows) == 0 or len(self.points) >= self.most or self.may_ask < 0:
            return False
        self._learn_light()
        corners = self.triangles[rows]
        centre = self._light_at(self.samples[corners].mean(axis=1), unit(self.normals[corners].mean(axis=1)))
        spots = np.column_stack([self.light[corners], centre])
        # Edges are evaluated only if light differs between the four spots; a small detail away from all four
        # is missed.
        uneven = self._excess(np.ptp(spots, axis=1), *spots.T) > 1
        rows, corners, centre = rows[uneven], corners[uneven], centre[uneven]
        if len(rows) == 0:
            return False
        keys = ends[..., 0] * len(self.points) + ends[..., 1]
        wanted = np.zeros(len(self.triangles), dtype=bool)
        wanted[rows] = True
        asked = np.unique(keys[wanted[:, None] & long])
        a, b = np.divmod(asked, len(self.points))
        middle = self._middles(a, b)
        light = self._light_at(middle[1], middle[2])
        off = self._excess(light - 0.5 * (self.light[a] + self.light[b]), light, self.light[a], self.light[b])

        within = self._excess(centre - self.light[corners].mean(axis=1), centre, *self.light[corners].T)
        excess = np.zeros(self.triangles.shape)
        at = np.minimum(np.searchsorted(asked, keys), len(asked) - 1)
        known = asked[at] == keys
        excess[known] = off[at[known]]
        longest = self._lengths(corners).argmax(axis=1)
        np.maximum.at(excess, (rows, longest), within)
        excess[~long] = 0.0
        self.open[:] = False
        return self._split(ends, keys, excess, {"asked": asked, "light": light})

    def _excess(self, off: np.ndarray, *light: np.ndarray) -> np.ndarray:
        """Error `off` of interpolated light in units of the tolerance."""
        brightest = np.maximum.reduce(light)
        return np.abs(off) / (CHANGE * (brightest + self.dim))

    def _split(self, ends: np.ndarray, keys: np.ndarray, excess: np.ndarray, known: dict) -> bool:
        """Halve the edges with the largest errors, as many as allowed, and their triangles' longest edges."""
        place = np.sort(self.place[ends], axis=-1)
        count = len(self.points)
        edge = place[..., 0] * count + place[..., 1]
        # Of equally long edges, all triangles choose the same one.
        lengths = self._lengths(self.triangles) / max(self.detail, SHORTEST)
        longest = (lengths.round(6) + 1e-7 * (edge / edge.max())).argmax(axis=1)
        own = np.arange(len(edge))
        limit = 1.0
        worst = excess.max(axis=1)
        while True:
            needed = np.unique(edge[excess > limit])
            marked = np.isin(edge, needed)
            # the longest edge is halved first, otherwise triangles become slivers
            while True:
                more = marked.any(axis=1) & ~marked[own, longest]
                if not more.any():
                    break
                needed = np.union1d(needed, edge[own, longest][more])
                marked = np.isin(edge, needed)
            new = np.unique(keys[marked])
            if count + len(new) <= self.most:
                break
            above = worst[worst > limit]
            limit = float(np.median(above)) if np.median(above) > limit else float(above.max(initial=limit))
        if len(new) == 0:
            return False
        self._add(new, count, known)
        middle = np.full(keys.shape, -1, dtype=np.int64)
        middle[marked] = count + np.searchsorted(new, keys[marked])
        touched = marked.any(axis=1)
        rows, whole = np.flatnonzero(touched), np.flatnonzero(~touched)
        parts, source = split_marked(self.points, self.triangles[rows], rows, marked[rows], middle[rows])
        origin = np.concatenate([whole, source])
        self.triangles = np.concatenate([self.triangles[whole], parts])
        self.source = self.source[origin]
        self.open = np.concatenate([np.zeros(len(whole), dtype=bool), np.ones(len(parts), dtype=bool)])
        return True

    def _middles(self, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Midpoints, points where light is evaluated, and normals; inset if both ends are."""
        points = 0.5 * (self.points[a] + self.points[b])
        inset_a, inset_b = self.samples[a] - self.points[a], self.samples[b] - self.points[b]
        inset = 0.5 * (inset_a + inset_b)
        inset[~(inset_a.any(axis=1) & inset_b.any(axis=1))] = 0.0
        length = np.linalg.norm(inset, axis=1, keepdims=True)
        most = INSET_OF_SPACING * self.display.spacing
        inset *= np.divide(most, length, out=np.ones_like(length), where=length > most)
        return points, points + inset, unit(self.normals[a] + self.normals[b])

    def _add(self, new: np.ndarray, count: int, known: dict) -> None:
        a, b = np.divmod(new, count)
        points, samples, normals = self._middles(a, b)
        light = np.zeros(len(new))
        at = np.minimum(np.searchsorted(known["asked"], new), len(known["asked"]) - 1)
        found = known["asked"][at] == new
        light[found] = known["light"][at[found]]
        light[~found] = self._light_at(samples[~found], normals[~found])
        low, high = np.sort(self.place[np.stack([a, b])], axis=0)
        _, first, place = np.unique(low * count + high, return_index=True, return_inverse=True)
        self.place = np.concatenate([self.place, count + first[place]])
        self.points = np.concatenate([self.points, points])
        self.samples = np.concatenate([self.samples, samples])
        self.normals = np.concatenate([self.normals, normals])
        self.light = np.concatenate([self.light, light])
        self.mesh = np.concatenate([self.mesh, self.mesh[a]])
        samples, weights = _mixed(self.shares, a, b)
        self.shares = np.concatenate([self.shares[0], samples]), np.concatenate([self.shares[1], weights])

    def finished(self) -> DisplayMesh:
        given, count = self.display, len(self.display.points)
        if len(self.points) == count:
            none, own = np.zeros(0, np.int64), np.arange(len(given.triangles))
            return replace(given, refinement=_refinement(none, self.detail, given.triangles, own))
        # Vertices are ordered mesh by mesh, triangles by their source triangles.
        order = np.argsort(self.mesh, kind="stable")
        number = np.argsort(order)
        others = np.ones(len(given.triangles), dtype=bool)
        others[self.source] = False
        others_kept = np.flatnonzero(others)
        source = np.concatenate([others_kept, self.source])
        by_source = np.argsort(source, kind="stable")
        triangles = np.concatenate([given.triangles[others_kept], self.triangles])[by_source]
        source = source[by_source]
        attached = np.concatenate([given.attached, np.full(len(self.points) - count, -1, np.int32)])
        samples, weights = self.shares
        arrays = {
            "points": self.points[order],
            "sample_points": self.samples[order],
            "normals": self.normals[order],
            "triangles": number[triangles],
            "triangle_material": given.triangle_material[source],
            "triangle_mesh": given.triangle_mesh[source],
            "vertex_mesh": self.mesh[order],
            "source_triangle": given.source_triangle[source],
            "reversed": given.reversed[source],
            "attached": attached[order],
        }
        sharing = Sharing(number[given.sample_vertices], samples[order], (weights[order]).astype(np.float32))
        for array in (*arrays.values(), sharing.vertices, sharing.samples, sharing.weights):
            array.setflags(write=False)
        refinement = _refinement(np.sort(number[count:]), self.detail, number[given.triangles], source)
        return replace(given, **arrays, sharing=sharing, refinement=refinement)


def _refinement(vertices: np.ndarray, length: float, plain: np.ndarray, of_plain: np.ndarray) -> Refinement:
    for array in (vertices, plain, of_plain):
        array.setflags(write=False)
    return Refinement(vertices, length, plain, of_plain)


def _ends(triangles: np.ndarray) -> np.ndarray:
    """(m, 3, 2) ends of all edges, the smaller number first."""
    return np.sort(np.stack([triangles, triangles[:, (1, 2, 0)]], axis=-1), axis=-1)


def _shares(display: DisplayMesh) -> tuple[np.ndarray, np.ndarray]:
    """Samples and weights, both (n, 4), of each vertex."""
    if display.sharing is not None:
        return display.sharing.samples, display.sharing.weights.astype(np.float64)
    count = len(display.points)
    samples, weights = np.zeros((count, NEIGHBOURS), np.int32), np.zeros((count, NEIGHBOURS))
    samples[:, 0], weights[:, 0] = np.arange(count), 1.0
    return samples, weights


def _mixed(
    shares: tuple[np.ndarray, np.ndarray], a: np.ndarray, b: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Half the weights of vertices `a` plus half of those of `b`; the samples of largest weight."""
    samples = np.concatenate([shares[0][a], shares[0][b]], axis=1)
    weights = 0.5 * np.concatenate([shares[1][a], shares[1][b]], axis=1)
    same = np.argsort(samples, axis=1, kind="stable")
    samples, weights = np.take_along_axis(samples, same, 1), np.take_along_axis(weights, same, 1)
    for k in range(1, samples.shape[1]):  # of equal samples, the last one gets the whole weight
        equal = samples[:, k] == samples[:, k - 1]
        weights[equal, k] += weights[equal, k - 1]
        weights[equal, k - 1] = 0.0
    most = np.argsort(-weights, axis=1, kind="stable")[:, :NEIGHBOURS]
    samples, weights = np.take_along_axis(samples, most, 1), np.take_along_axis(weights, most, 1)
    samples[weights == 0] = 0
    return samples, weights / weights.sum(axis=1, keepdims=True)
