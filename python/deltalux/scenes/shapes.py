# SPDX-License-Identifier: Apache-2.0
"""Mesh-building primitives of the demonstration scenes: closed, outward-wound, vertices shared.

Every solid stands on y = 0, centred on the y axis, unless its docstring says otherwise; place it with
`Shape.moved` and `Shape.turned`. Solids that touch are either pushed into each other or kept apart by
`GAP`, so that no two faces coincide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from deltalux.scene import Mesh

GAP = 1e-3  # metres between an object and what it stands on or hangs from


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangles with a material name each, before they become a `Mesh`."""

    vertices: np.ndarray
    triangles: np.ndarray
    materials: tuple[str, ...]
    material_index: np.ndarray

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Shape:
        """A translated copy."""
        return replace(self, vertices=self.vertices + np.array([x, y, z], np.float64))

    def turned(self, degrees: float, axis: str = "y") -> Shape:
        """A copy rotated about a coordinate axis, right-handed."""
        i = "xyz".index(axis)
        j, k = (i + 1) % 3, (i + 2) % 3
        cos, sin = _cos_sin(degrees)
        vertices = self.vertices.copy()
        vertices[:, j] = cos * self.vertices[:, j] - sin * self.vertices[:, k]
        vertices[:, k] = sin * self.vertices[:, j] + cos * self.vertices[:, k]
        return replace(self, vertices=vertices)

    def scaled(self, factor: float) -> Shape:
        """A copy scaled uniformly about the origin."""
        return replace(self, vertices=self.vertices * factor)

    def flipped(self) -> Shape:
        """A copy with front and back exchanged."""
        return replace(self, triangles=self.triangles[:, ::-1])

    @property
    def diameter(self) -> float:
        """Diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    def mesh(
        self, name: str, *, at: Sequence[float] | None = None, degrees: float = 0.0, movable: bool = False
    ) -> Mesh:
        """A `Mesh`; with `at`, its pose places it there, rotated by `degrees` about +y."""
        pose = np.eye(4)
        if at is not None:
            cos, sin = _cos_sin(degrees)
            pose[:3, :3] = np.array([(cos, 0, sin), (0, 1, 0), (-sin, 0, cos)])
            pose[:3, 3] = np.asarray(at)
        return Mesh(name, self.vertices, self.triangles, self.materials, self.material_index, pose, movable)


def _cos_sin(degrees: float) -> tuple[float, float]:
    """Cosine and sine, exact at multiples of 90 degrees, so that right angles stay right."""
    quarter = round(degrees / 90)
    if degrees == 90 * quarter:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarter % 4]
    angle = np.radians(degrees)
    return float(np.cos(angle)), float(np.sin(angle))


def shape(vertices: Any, triangles: Any, material: str | Sequence[str]) -> Shape:
    """A shape of one material, or of one material name per triangle."""
    triangles = np.asarray(triangles, np.int64).reshape(-1, 3)
    vertices = np.asarray(vertices, np.float64).reshape(-1, 3)
    if isinstance(material, str):
        return Shape(vertices, triangles, (material,), np.zeros(len(triangles), np.int64))
    names = tuple(dict.fromkeys(material))
    number = {name: i for i, name in enumerate(names)}
    return Shape(vertices, triangles, names, np.array([number[m] for m in material], np.int64))


def merge(shapes: Iterable[Shape]) -> Shape:
    """One shape of many; vertices are not welded."""
    shapes = list(shapes)
    names = tuple(dict.fromkeys(name for s in shapes for name in s.materials))
    number = {name: i for i, name in enumerate(names)}
    starts = np.cumsum([0] + [len(s.vertices) for s in shapes])
    return Shape(
        np.concatenate([s.vertices for s in shapes]),
        np.concatenate([s.triangles + start for s, start in zip(shapes, starts[:-1], strict=True)]),
        names,
        np.concatenate([np.array([number[n] for n in s.materials])[s.material_index] for s in shapes]),
    )


def circle(radius: float, count: int) -> np.ndarray:
    """(count, 2) points, counter-clockwise."""
    angle = 2 * np.pi * np.arange(count) / count
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def rounded_rectangle(width: float, height: float, radius: float, per_corner: int) -> np.ndarray:
    """(4 * per_corner, 2) points, counter-clockwise, about the origin."""
    angle = np.linspace(0, np.pi / 2, per_corner)
    corners = []
    for i, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        centre = np.array([sx * (width / 2 - radius), sy * (height / 2 - radius)])
        turned = angle + i * np.pi / 2
        corners.append(centre + radius * np.stack([np.cos(turned), np.sin(turned)], axis=1))
    return np.concatenate(corners)


def loft(rings: Any, start: Any, end: Any, material: str | Sequence[str]) -> Shape:
    """Closed skin over rings of points, each end closed by a fan.

    Parameters
    ----------
    rings : (k, n, 3); seen against the direction from first to last ring, counter-clockwise
    start, end : (3,) centres of the two fans
    material : one name, or k + 1 names: start fan, the k - 1 strips, end fan
    """
    rings = np.asarray(rings, np.float64)
    k, n, _ = rings.shape
    this, following = np.arange(n), (np.arange(n) + 1) % n
    a = (np.arange(k - 1)[:, None] * n + this).ravel()
    b = (np.arange(k - 1)[:, None] * n + following).ravel()
    sides = np.stack([a, b, b + n, a, b + n, a + n], axis=1).reshape(-1, 3)
    last = (k - 1) * n
    fan0 = np.stack([np.full(n, k * n), following, this], axis=1)
    fan1 = np.stack([np.full(n, k * n + 1), last + this, last + following], axis=1)
    vertices = np.concatenate([rings.reshape(-1, 3), [start], [end]])
    names = (
        material
        if isinstance(material, str)
        else [*[material[0]] * n, *np.repeat(np.array(material[1:-1], object), 2 * n), *[material[-1]] * n]
    )
    return shape(vertices, np.concatenate([fan0, sides, fan1]), names)


def prism(polygon: Any, height: float, material: str, bevel: float = 0.0) -> Shape:
    """Polygon in (x, z), star-shaped about the origin, extruded upwards; edges optionally bevelled."""
    outline = np.asarray(polygon, np.float64)
    levels = (
        [(0.0, 1), (height, 1)] if bevel == 0 else [(0.0, 0), (bevel, 1), (height - bevel, 1), (height, 0)]
    )
    inner = outline * (1 - bevel / np.linalg.norm(outline, axis=1, keepdims=True))
    rings = [np.insert(outline if full else inner, 1, y, axis=1)[::-1] for y, full in levels]
    return loft(rings, (0, 0, 0), (0, height, 0), material)


def box(width: float, height: float, depth: float, material: str) -> Shape:
    """Cuboid: eight vertices, twelve triangles."""
    x, z = width / 2, depth / 2
    vertices = [(sx * x, y, sz * z) for y in (0.0, height) for sz in (-1, 1) for sx in (-1, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (2, 3, 7, 6), (1, 0, 4, 5), (0, 2, 6, 4), (3, 1, 5, 7)]
    return shape(vertices, _split(quads), material)


def block(width: float, height: float, depth: float, material: str, bevel: float = 0.004) -> Shape:
    """Cuboid with all edges bevelled at 45 degrees: 24 vertices, 44 triangles."""
    half = np.array([width, height, depth]) / 2
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corner = {tuple(s): 3 * i for i, s in enumerate(signs.tolist())}
    vertices = np.repeat(signs * (half - bevel), 3, axis=0)
    vertices += np.tile(np.eye(3) * bevel, (8, 1)) * np.repeat(signs, 3, axis=0)
    polygons = []
    for axis in range(3):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        for s in (-1, 1):
            around = [(s, -1, -1), (s, 1, -1), (s, 1, 1), (s, -1, 1)][::s]
            polygons.append([corner[_signs(axis, j, k, p)] + axis for p in around])
            for t in (-1, 1):  # the bevel between the faces `axis` = s and j = t
                low, high = (corner[_signs(axis, j, k, (s, t, u))] for u in (-1, 1))
                polygons.append([low + axis, low + j, high + j, high + axis][:: s * t])
    tips = [[3 * i, 3 * i + 1, 3 * i + 2][:: int(np.prod(s))] for i, s in enumerate(signs)]
    vertices[:, 1] += half[1]
    return shape(vertices, np.concatenate([_split(polygons), tips]), material)


def _signs(axis: int, j: int, k: int, values: Sequence[int]) -> tuple[int, ...]:
    out = [0, 0, 0]
    out[axis], out[j], out[k] = values
    return tuple(out)


def _split(quads: Any) -> np.ndarray:
    quads = np.asarray(quads)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def lathe(profile: Any, segments: int, material: str | Sequence[str]) -> Shape:
    """Solid of revolution about y.

    Parameters
    ----------
    profile : (k, 2) of (radius, y) along the surface, solid to the left going up; the ends are
        closed at the axis
    material : one name, or one per profile edge including the two to the axis
    """
    profile = [tuple(map(float, p)) for p in profile]
    start, end = profile[0], profile[-1]
    inner = [p for i, p in enumerate(profile) if p[0] > 0 or 0 < i < len(profile) - 1]
    turn = circle(1.0, segments)[::-1]
    rings = [np.stack([r * turn[:, 0], np.full(segments, y), r * turn[:, 1]], axis=1) for r, y in inner]
    return loft(rings, (0, start[1], 0), (0, end[1], 0), material)


def cylinder(radius: float, height: float, segments: int, material: str) -> Shape:
    """Round cylinder."""
    return lathe([(radius, 0), (radius, height)], segments, material)


def sphere(radius: float, segments: int, material: str) -> Shape:
    """Sphere about the origin."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, segments // 2 + 1)
    profile = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius
    profile[[0, -1], 0] = 0.0
    return lathe(profile, segments, material)


def tube(path: Any, radius: Any, sides: int, material: str, section: np.ndarray | None = None) -> Shape:
    """Pipe along a polyline in place; `section` (sides, 2) replaces the unit circle.

    `radius` is one number or one per point of the path. The section's axes follow the path by
    parallel transport; the first axis starts horizontal.
    """
    points = np.asarray(path, np.float64)
    across, other = _frames(points, np.gradient(points, axis=0))
    unit = circle(1.0, sides) if section is None else section
    return loft(_sections(points, radius, unit, across, other), points[0], points[-1], material)


def closed_tube(path: Any, radius: float, sides: int, material: str) -> Shape:
    """Round pipe along a closed polyline, whose first point is not repeated."""
    points = np.asarray(path, np.float64)
    tangents = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    around = np.concatenate([points, points[:1]])
    across, other = _frames(around, np.concatenate([tangents, tangents[:1]]))
    # Parallel transport around a loop rotates the frame; the path spreads the rotation to close the skin.
    turn = np.arctan2(across[-1] @ other[0], across[-1] @ across[0])
    angle = -turn * np.linspace(0, 1, len(around))[:-1, None]
    a, b = across[:-1], other[:-1]
    a, b = np.cos(angle) * a + np.sin(angle) * b, np.cos(angle) * b - np.sin(angle) * a
    return closed_loft(_sections(points, radius, circle(1.0, sides), a, b), material)


def closed_loft(rings: np.ndarray, material: str) -> Shape:
    """Skin over rings (k, n, 3), ordered as for `loft`, of which the last joins the first."""
    k, n, _ = rings.shape
    index = np.arange(k * n).reshape(k, n)
    ahead, side = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    quads = np.stack([index, side, np.roll(side, -1, axis=0), ahead], axis=-1)
    return shape(rings, _split(quads.reshape(-1, 4)), material)


def _frames(points: np.ndarray, tangents: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit axes across the path at each point, by parallel transport."""
    tangents = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
    axis = np.cross(tangents[0], (0.0, 1.0, 0.0))
    if np.linalg.norm(axis) < 1e-6:
        axis = np.array([1.0, 0.0, 0.0])
    across = np.zeros_like(points)
    for i, tangent in enumerate(tangents):
        axis = axis - tangent * (axis @ tangent)
        axis /= np.linalg.norm(axis)
        across[i] = axis
    return across, np.cross(tangents, across)


def _sections(
    points: np.ndarray, radius: Any, unit: np.ndarray, across: np.ndarray, other: np.ndarray
) -> np.ndarray:
    """(k, n, 3) copies of the section `unit`, each in the plane of its point."""
    scale = np.broadcast_to(radius, len(points))[:, None, None]
    offset = unit[None, :, :1] * across[:, None] + unit[None, :, 1:] * other[:, None]
    return points[:, None] + scale * offset


def shell(front: np.ndarray, back: np.ndarray, material: str) -> Shape:
    """Closed sheet between two grids of points (nu, nv, 3); `front` faces u x v."""
    nu, nv, _ = front.shape
    index = np.arange(nu * nv).reshape(nu, nv)
    faces = grid_triangles(nu, nv)
    rim = np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
    after = np.roll(rim, -1)
    behind = nu * nv
    quads = np.stack([rim, rim + behind, after + behind, after], axis=1)
    triangles = np.concatenate([faces, faces[:, ::-1] + behind, _split(quads)])
    return shape(np.concatenate([front.reshape(-1, 3), back.reshape(-1, 3)]), triangles, material)


def grid_triangles(nu: int, nv: int) -> np.ndarray:
    """(m, 3) triangles of an nu x nv grid of vertices, numbered v fastest, facing u x v."""
    index = np.arange(nu * nv).reshape(nu, nv)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)
    return _split(quads.reshape(-1, 4))


def sheet(corners: Any, material: str) -> Shape:
    """One rectangle, corners counter-clockwise."""
    return shape(corners, [(0, 1, 2), (0, 2, 3)], material)


def tiles(xs: Any, zs: Any, name: Callable[[int, int], str]) -> Shape:
    """Level sheet at y = 0 facing up, cut at `xs` and `zs`; `name(i, j)` is a cell's material."""
    xs, zs = np.asarray(xs, np.float64), np.asarray(zs, np.float64)
    z, x = np.meshgrid(zs, xs, indexing="ij")
    vertices = np.stack([x, np.zeros_like(x), z], axis=-1)
    names = [name(i, j) for j in range(len(zs) - 1) for i in range(len(xs) - 1)]
    return shape(vertices, grid_triangles(len(zs), len(xs)), names * 2)


def room(width: float, height: float, depth: float, sides: Sequence[str | None]) -> Shape:
    """The inside of a cuboid, faces looking inwards.

    `sides` are the materials of floor, ceiling, and the walls at +z, -z, -x, +x; None leaves one out.
    """
    inside = box(width, height, depth, "").flipped()
    names = [*sides] * 2  # `box` lists the first halves of its six faces, then the second halves
    kept = [i for i, name in enumerate(names) if name is not None]
    return shape(inside.vertices, inside.triangles[kept], [name for name in names if name is not None])


def panel_lamp(width: float, height: float, depth: float, rim: float, body: str, lamp: str) -> Shape:
    """Box whose lower face, within a rim, is the lamp and looks down; hangs below y = `height`."""
    housing = box(width, height, depth, body)
    x, z = width / 2 - rim, depth / 2 - rim
    vertices = np.concatenate([housing.vertices, [(-x, 0, -z), (x, 0, -z), (-x, 0, z), (x, 0, z)]])
    below = (housing.vertices[housing.triangles][:, :, 1] == 0).all(axis=1)
    ring = [(0, 1, 9, 8), (1, 3, 11, 9), (3, 2, 10, 11), (2, 0, 8, 10)]
    lit = _split([(8, 9, 11, 10)])
    rest = np.concatenate([housing.triangles[~below], _split(ring)])
    return shape(vertices, np.concatenate([rest, lit]), [body] * len(rest) + [lamp] * len(lit))


def skyline(heights: Any, widths: Any, depth: float, materials: Sequence[str]) -> Shape:
    """A row of books: columns of different heights as one solid, starting at x = 0."""
    edges = np.concatenate([[0.0], np.cumsum(widths)])
    tall = np.array([0.0, *heights, 0.0])
    triangles: list[tuple[int, int, int]] = []
    names: list[str] = []
    number: dict[tuple[float, float, float], int] = {}

    def polygon(points: list[tuple[float, float, float]], material: str) -> None:
        """A fan about the centroid, since a fan about a corner fails with points on an edge."""
        ids = [number.setdefault(p, len(number)) for p in points]
        opposite = points[len(points) // 2]
        x, y, z = ((a + b) / 2 for a, b in zip(points[0], opposite, strict=True))
        hub = number.setdefault((x, y, z), len(number))
        for a, b in zip(ids, [*ids[1:], ids[0]], strict=True):
            triangles.append((hub, a, b))
            names.append(material)

    near, far = depth / 2, -depth / 2
    for i, material in enumerate(materials):
        x0, x1, top = float(edges[i]), float(edges[i + 1]), float(tall[i + 1])
        right = [float(tall[i + 2])] if 0 < tall[i + 2] < top else []
        left = [float(tall[i])] if 0 < tall[i] < top else []
        outline = [
            (x0, 0.0),
            (x1, 0.0),
            *((x1, y) for y in right),
            (x1, top),
            (x0, top),
            *((x0, y) for y in left),
        ]
        polygon([(x, y, near) for x, y in outline], material)
        polygon([(x, y, far) for x, y in outline[::-1]], material)
        polygon([(x0, top, near), (x1, top, near), (x1, top, far), (x0, top, far)], material)
        polygon([(x0, 0.0, far), (x1, 0.0, far), (x1, 0.0, near), (x0, 0.0, near)], material)
    for i in range(len(edges)):
        low, high = sorted((float(tall[i]), float(tall[i + 1])))
        if high > low:
            x, outward = float(edges[i]), tall[i] > tall[i + 1]
            side = [(x, low, near), (x, low, far), (x, high, far), (x, high, near)]
            polygon(side if outward else side[::-1], materials[min(max(i - outward, 0), len(materials) - 1)])
    return shape(list(number), triangles, names)
