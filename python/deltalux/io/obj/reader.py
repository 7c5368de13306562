# SPDX-License-Identifier: Apache-2.0
"""Wavefront OBJ to Scene: polygons of every object, with the materials of its MTL files."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from deltalux.errors import OptionError, SceneError
from deltalux.io.diagnostics import ALL_NAMES, MISSING_REFLECTANCE, Notes, clean_name, malformed
from deltalux.io.files import read_regular_file
from deltalux.io.glass import LITERAL
from deltalux.io.scene_size import require_memory_for_triangles
from deltalux.scene import Mesh, Node, Scene
from deltalux.scene.adding import NO_LIGHT
from deltalux.scene.naming import candidates, chosen
from deltalux.units import WATTS_PER_SQUARE_METRE

from .mtl import MaterialLibrary
from .polygons import cut

MOVABLE_PREFIX = "MOVE_"
MOST_COORDINATE = 1e30
IGNORED = {"g", "vn", "s", "vp", "lod", "bevel", "c_interp", "d_interp", "mg"}


@dataclass
class _Object:
    """Corners of the triangles of one object, as indexes into the file's vertices."""

    corners: list[int] = field(default_factory=list)
    materials: list[str] = field(default_factory=list)
    # For each face that needs texture coordinates: its first corner, and indexes into the file's coordinates.
    coordinates: list[tuple[int, list[int]]] = field(default_factory=list)


@dataclass
class _Reading:
    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    coordinates: array[float] = field(default_factory=lambda: array("f"))  # u and v alternate
    objects: dict[str, _Object] = field(default_factory=dict)


def load_obj(
    path: Path,
    movable: Sequence[str] = (),
    light_units: str = "spec",
    space: np.ndarray | None = None,
    groups: str = "auto",
    *,
    glass: str = LITERAL,
    reflectance: float = MISSING_REFLECTANCE,
) -> Scene:
    """Read an OBJ file and its MTL files; see `deltalux.load`.

    Each object ("o", or each group "g" in files without objects) becomes one Mesh; the origin of a
    movable one is the centre of its bounds. Polygons may be of any shape. Kd is the reflectance, Ke the
    radiance, W/(sr m2), from the front; results are in W/m2. OBJ has no lamps, so `light_units` has no
    effect; each object with a luminous material is a light group, so `groups` has none either.
    """
    notes = Notes()
    library = MaterialLibrary(path.parent, notes, glass, reflectance)
    reading = _read(read_regular_file(path, "file"), library, notes)
    library.note_transparent()
    objects = reading.objects
    if not objects:
        raise SceneError("scene: found no faces, expected some surface to light")
    moving = _moving(list(objects), movable)
    triangles = sum(len(o.materials) for o in objects.values())
    require_memory_for_triangles(triangles, len(reading.vertices))
    vertices = np.array(reading.vertices, np.float64)
    if space is not None:
        vertices = vertices @ space[:3, :3].T
    coordinates = np.array(reading.coordinates, np.float32).reshape(-1, 2) * (1, -1) + (0, 1)
    meshes = [_mesh(name, found, vertices, coordinates, name in moving) for name, found in objects.items()]
    meshes = [replace(mesh, material=_materials(mesh, library)) for mesh in meshes]
    materials = library.materials
    if not any(material.emissive for material in materials):
        notes.add(NO_LIGHT)
    nodes = [Node(m.name, -1, m.pose, ((m.name, 0, len(m.triangles)),)) for m in meshes]
    return Scene(
        meshes,
        materials,
        unit=WATTS_PER_SQUARE_METRE,
        nodes=nodes,
        warnings=notes.lines(),
        source=str(path.absolute()),
        files=[str(each.absolute()) for each in (path, *library.files)],
    )


def _moving(objects: list[str], movable: Sequence[str]) -> set[str]:
    moving = {name for name in objects if name.startswith(MOVABLE_PREFIX)}
    for word in movable:
        found = chosen(word, objects)
        if not found:
            raise OptionError(
                f'movable "{word}": found no such object, expected one of: {candidates(word, objects)}; '
                f"{ALL_NAMES}"
            )
        moving.update(found)
    return moving


def _mesh(name: str, found: _Object, vertices: np.ndarray, coordinates: np.ndarray, movable: bool) -> Mesh:
    used, triangles = np.unique(found.corners, return_inverse=True)
    points = vertices[used]
    pose = np.eye(4)
    if movable:
        pose[:3, 3] = (points.min(axis=0) + points.max(axis=0)) / 2
    names = tuple(dict.fromkeys(found.materials))
    index = {material: i for i, material in enumerate(names)}
    return Mesh(
        name,
        points - pose[:3, 3],
        triangles.reshape(-1, 3),
        names,
        [index[m] for m in found.materials],
        pose,
        movable,
        coordinates=_coordinates(found, coordinates),
    )


def _materials(mesh: Mesh, library: MaterialLibrary) -> tuple[str, ...]:
    """Names of the mesh's materials, by the texels that it uses of their textures."""
    areas, names = mesh.triangle_areas(), []
    for number, name in enumerate(mesh.material):
        own = mesh.material_index == number
        coordinates = None if mesh.coordinates is None else mesh.coordinates[own]
        names.append(library.material(name, mesh.name, coordinates, areas[own]))
    return tuple(names)


def _coordinates(found: _Object, values: np.ndarray) -> np.ndarray | None:
    """(m, 3, 2) of an object's triangles, NaN where absent; None if absent from all."""
    if not found.coordinates:
        return None
    result = np.full((len(found.corners), 2), np.nan, np.float32)
    for first, indexes in found.coordinates:
        result[first : first + len(indexes)] = values[indexes]
    return result.reshape(-1, 3, 2)


def _lines(data: bytes) -> Iterator[tuple[int, list[str]]]:
    """(line number, words) of each statement; a backslash continues a line."""
    start, held = 0, list[str]()
    for number, line in enumerate(data.decode("utf-8", "replace").split("\n"), 1):
        start = start if held else number
        part = line.split("#", 1)[0].rstrip()
        held.append(part.removesuffix("\\"))
        if part.endswith("\\"):
            continue
        if words := " ".join(held).split():
            yield start, words
        held.clear()


def _read(data: bytes, library: MaterialLibrary, notes: Notes) -> _Reading:
    reading = _Reading()
    naming = "o" if re.search(rb"^[ \t]*o\s", data, re.MULTILINE) else "g"  # \s* would match line breaks
    material, name = "default", "object"
    for number, (key, *rest) in _lines(data):
        where = f"line {number}"
        if key == "v":
            reading.vertices.append(_point(rest, where))
            if len(rest) >= 6:
                notes.add("vertex colours are not honoured")
        elif key == "vt":
            reading.coordinates.extend(_texel(rest))
        elif key == "f":
            corners = _face(rest, len(reading.vertices), where)
            if library.leaves_out(material):
                continue
            order, simple = cut([reading.vertices[corner] for corner in corners])
            if not simple:
                notes.add("polygons that cross themselves: what they cover is a guess", where)
            found = reading.objects.setdefault(name, _Object())
            if library.textured(material):
                texels = _face_texels(rest, len(reading.coordinates) // 2)
                if texels is not None:
                    found.coordinates.append((len(found.corners), [texels[i] for i in order]))
            found.corners.extend([corners[i] for i in order])
            found.materials.extend([material] * (len(order) // 3))
        elif key == naming:
            name = clean_name(" ".join(rest)) or "object"
        elif key == "usemtl":
            material = clean_name(" ".join(rest)) or "default"
        elif key == "mtllib":
            library.read_all(rest, where)
        elif key not in IGNORED:
            notes.add("statements that are not honoured", clean_name(key))
    return reading


def _point(words: list[str], where: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(word) for word in words[:3])
    except ValueError:
        raise malformed(where, repr(" ".join(words))[:60], "three coordinates") from None
    if not all(abs(c) < 1e30 for c in (x, y, z)):
        raise malformed(where, repr(" ".join(words))[:60], "finite coordinates")
    return x, y, z


def _face(words: list[str], count: int, where: str) -> list[int]:
    """Corners of a polygon; negative indexes count back from the last vertex."""
    corners = []
    for word in words:
        try:
            index = int(word.split("/", 1)[0])
        except ValueError:
            raise malformed(where, repr(word)[:60], "a vertex index") from None
        corner = index - 1 if index > 0 else count + index
        if index == 0 or not 0 <= corner < count:
            raise malformed(where, f"vertex index {word[:60]}", f"1 to {count} or -1 to -{count}")
        corners.append(corner)
    if len(corners) < 3:
        raise malformed(where, f"a face of {len(corners)} corners", "at least 3")
    return corners


def _texel(words: list[str]) -> tuple[float, float]:
    """Texture coordinates; NaN if they cannot be read, since light does not depend on them."""
    try:
        u, v = (float(word) for word in (*words[:2], "0")[:2])
    except ValueError:
        return math.nan, math.nan
    return (u, v) if abs(u) < MOST_COORDINATE and abs(v) < MOST_COORDINATE else (math.nan, math.nan)


def _face_texels(words: list[str], count: int) -> list[int] | None:
    """Indexes of texture coordinates of a polygon's corners; None if a corner has none."""
    texels = []
    for word in words:
        _, *more = word.split("/")
        try:
            index = int(more[0]) if more else 0
        except ValueError:
            return None
        texel = index - 1 if index > 0 else count + index
        if index == 0 or not 0 <= texel < count:
            return None
        texels.append(texel)
    return texels
