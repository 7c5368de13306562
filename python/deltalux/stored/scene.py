# SPDX-License-Identifier: Apache-2.0
"""Scenes as entries of a session file's index and arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from deltalux.errors import FormatError
from deltalux.scene import Camera, Material, Mesh, Node, Scene
from deltalux.scene.arrays import NUMBER
from deltalux.scene.lights import KINDS as LIGHTS
from deltalux.scene.lights import Light
from deltalux.scene.surfaces import KINDS as SURFACES
from deltalux.scene.surfaces import Surface
from deltalux.units import FARTHEST

from .archive import ArchiveReader, ArchiveWriter
from .fields import Fields
from .looks import FIELDS as LOOK_FIELDS
from .looks import pack_looks, unpack_looks, write_looks

_LIGHT = ("kind", "name", "group", "attached_to")
_MESH = ("name", "material", "pose", "movable", "smooth_angle", "vertices", "triangles")
_MATERIAL = ("name", "reflectance", "emission", "group", "two_sided", "surface")
_CAMERA = ("name", "pose", "vertical_fov", "height", "aspect", "near", "far")
_NODE = ("name", "parent", "matrix", "parts", "lights", "label")
_TINY = np.finfo(float).tiny
_MOST = 2**31  # vertices or triangles of a mesh; the arrays hold no more than the file
# no session moves a mesh that far; sums of such coordinates cannot overflow
_FARTHEST_POSE = 2 * FARTHEST

FIELDS = ("unit", "warnings", "source", "meshes", "materials", "looks", "lights", "cameras", "nodes")


def pack_scene(scene: Scene, folder: Path) -> dict[str, Any]:
    """The index entry, for a file in `folder`; `write_scene` writes the arrays."""
    return {
        "unit": scene.unit,
        "warnings": list(scene.warnings),
        "source": None if scene.source is None else _from_folder(Path(scene.source), folder),
        "meshes": [
            {
                "name": mesh.name,
                "material": list(mesh.material),
                "pose": mesh.pose.tolist(),
                "movable": bool(mesh.movable),
                "smooth_angle": float(mesh.smooth_angle),
                "vertices": len(mesh.vertices),
                "triangles": len(mesh.triangles),
            }
            for mesh in scene.meshes
        ],
        "materials": [
            {
                "name": m.name,
                "reflectance": m.reflectance.tolist(),
                "emission": m.emission.tolist(),
                "group": m.group,
                "two_sided": bool(m.two_sided),
                "surface": _pack_kind(m.surface, ("kind",)),
            }
            for m in scene.materials
        ],
        "looks": pack_looks(scene),
        "lights": [_pack_kind(light, _LIGHT) for light in scene.lights],
        "cameras": [_pack_camera(camera) for camera in scene.cameras],
        "nodes": [
            {
                "name": n.name,
                "parent": n.parent,
                "matrix": np.asarray(n.matrix).tolist(),
                "parts": n.parts,
                "lights": n.lights,
                "label": n.label,
            }
            for n in scene.nodes
        ],
    }


def _from_folder(source: Path, folder: Path) -> str:
    """Relative if the source lies in `folder`, so that both can be moved together; else absolute."""
    absolute = source.absolute()
    try:
        return str(absolute.relative_to(folder.absolute()))
    except ValueError:
        return str(absolute)


def write_scene(scene: Scene, archive: ArchiveWriter) -> None:
    """Write the geometry and the looks of all meshes, one mesh after the other."""
    archive.add_array("meshes/vertices", "<f8", [m.vertices for m in scene.meshes], 3)
    archive.add_array("meshes/triangles", "<i8", [m.triangles for m in scene.meshes], 3)
    archive.add_array("meshes/material_index", "<i8", [m.material_index for m in scene.meshes])
    write_looks(scene, archive)


def _pack_camera(camera: Camera) -> dict[str, Any]:
    numbers = {name: getattr(camera, name) for name in _CAMERA[2:]}
    return {
        "name": camera.name,
        "pose": np.asarray(camera.pose).tolist(),
        **{name: None if value is None else float(value) for name, value in numbers.items()},
    }


def _pack_kind(thing: Light | Surface, common: tuple[str, ...]) -> dict[str, Any]:
    return {name: np.asarray(getattr(thing, name)).tolist() for name in (*common, *thing.fields)}


def unpack_scene(data: Fields, archive: ArchiveReader, folder: Path) -> Scene:
    """Restore the scene from an index entry and the arrays of a file in `folder`.

    Raises
    ------
    FormatError, SceneError, OptionError
    """
    meshes = [_unpack_mesh(entry, archive) for entry in data.objects("meshes", _MESH)]
    materials = [
        _unpack_material(entry, f"index.scene.materials[{i}].surface")
        for i, entry in enumerate(data.objects("materials", _MATERIAL))
    ]
    if data.any("looks") is not None:
        meshes, materials = unpack_looks(data.child("looks", LOOK_FIELDS), meshes, materials, archive)
    sizes = {mesh.name: len(mesh.triangles) for mesh in meshes}
    source = data.optional_text("source")
    lights = [
        _unpack_light(entry, f"index.scene.lights[{i}]") for i, entry in enumerate(_list(data, "lights"))
    ]
    known = {light.name for light in lights}
    return Scene(
        meshes,
        materials,
        lights,
        unit=data.text("unit"),
        cameras=[_unpack_camera(entry) for entry in data.objects("cameras", _CAMERA)],
        nodes=[_unpack_node(entry, i, sizes, known) for i, entry in enumerate(data.objects("nodes", _NODE))],
        warnings=data.texts("warnings"),
        source=None if source is None else str(folder.absolute() / source),
    )


def _list(data: Fields, name: str) -> list[Any]:
    values = data.any(name)
    if not isinstance(values, list):
        raise FormatError(f"index.scene.{name}: found {type(values).__name__}, expected a list")
    return values


def _unpack_mesh(entry: Fields, archive: ArchiveReader) -> Mesh:
    triangles = entry.integer("triangles", 0, _MOST)
    return Mesh(
        entry.text("name"),
        archive.rows("meshes/vertices", "<f8", entry.integer("vertices", 0, _MOST), 3),
        archive.rows("meshes/triangles", "<i8", triangles, 3),
        entry.texts("material"),
        archive.rows("meshes/material_index", "<i8", triangles),
        entry.numbers("pose", 4, 4, least=-_FARTHEST_POSE, most=_FARTHEST_POSE),
        entry.boolean("movable"),
        entry.number("smooth_angle"),
    )


def _unpack_material(entry: Fields, where: str) -> Material:
    kind, _, values = _unpack_kind(entry.any("surface"), where, SURFACES, ("kind",))
    return Material(
        entry.text("name"),
        entry.numbers("reflectance", 3),
        entry.numbers("emission", 3),
        entry.optional_text("group"),
        entry.boolean("two_sided"),
        surface=kind(**values),
    )


def _unpack_light(entry: Any, where: str) -> Light:
    kind, fields, values = _unpack_kind(entry, where, LIGHTS, _LIGHT)
    group, attached_to = fields.optional_text("group"), fields.optional_text("attached_to")
    return kind(fields.text("name"), group=group, attached_to=attached_to, **values)


def _unpack_kind(
    entry: Any, where: str, kinds: Mapping[str, Any], common: tuple[str, ...]
) -> tuple[Any, Fields, dict[str, Any]]:
    """The class of a light or a surface, its entry with the fields `common`, and the values of the others."""
    name = entry.get("kind") if isinstance(entry, dict) else None
    if not isinstance(name, str) or name not in kinds:
        raise FormatError(f"{where}: found kind {name!r:.60}, expected one of {list(kinds)}")
    shapes = kinds[name].fields
    fields = Fields(entry, where, (*common, *shapes))
    values = {
        key: fields.number(key) if shape == NUMBER else fields.numbers(key, *shape)
        for key, shape in shapes.items()
    }
    return kinds[name], fields, values


def _unpack_camera(entry: Fields) -> Camera:
    return Camera(
        entry.text("name"),
        entry.numbers("pose", 4, 4),
        entry.number("vertical_fov"),
        entry.optional_number("height", _TINY, FARTHEST),
        entry.optional_number("aspect", _TINY),
        entry.number("near", 0),
        entry.optional_number("far", 0),
    )


def _unpack_node(entry: Fields, number: int, sizes: dict[str, int], known: set[str]) -> Node:
    """`sizes`: triangles of each mesh; `known`: names of lights."""
    parts = entry.any("parts")
    good = isinstance(parts, list) and all(_is_part(part, sizes) for part in parts)
    if not good:
        raise FormatError(
            f"index.scene.nodes[{number}].parts: found {parts!r:.60}, expected names of meshes with the "
            "first of their triangles and how many"
        )
    lights = tuple(entry.texts("lights"))
    if not known.issuperset(lights):
        raise FormatError(
            f"index.scene.nodes[{number}].lights: found {lights!r:.60}, expected names of lights"
        )
    return Node(
        entry.text("name"),
        entry.integer("parent", -1, number - 1),
        entry.numbers("matrix", 4, 4),
        tuple((part[0], part[1], part[2]) for part in parts),
        lights,
        entry.optional_text("label"),
    )


def _is_part(part: Any, sizes: dict[str, int]) -> bool:
    if not isinstance(part, list) or list(map(type, part)) != [str, int, int] or part[0] not in sizes:
        return False
    return part[1] >= 0 and part[2] >= 0 and part[1] + part[2] <= sizes[part[0]]
