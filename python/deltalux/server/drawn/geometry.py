# SPDX-License-Identifier: Apache-2.0
"""What a page draws: display mesh, parts, materials and cameras, as JSON and one binary block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from deltalux.errors import OptionError
from deltalux.mesh.closed_meshes import closed_meshes
from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.mesh.surfaces import Surfaces
from deltalux.outputs.camera import automatic_camera
from deltalux.scene import Camera, Material, PaneSurface, Scene
from deltalux.scene.look import Texture, images_of
from deltalux.server.edits import pose_numbers
from deltalux.session import Session

from .drawn_mesh import DrawnMesh, drawn_mesh

PROTOCOL = 1
NOTHING_SHOWN = 2.0  # least alpha that no texel has


@dataclass(frozen=True, eq=False)
class Geometry:
    """What pages draw; numbered, because it can change.

    Parameters
    ----------
    description : `scene.json` without `run`, `folder` and `lit`
    data : `geometry.bin`
    drawn : the mesh that both describe
    images : those of textures, encoded, once each
    """

    description: dict[str, Any]
    data: bytes
    drawn: DrawnMesh
    images: Sequence[bytes]  # of textures, encoded

    @property
    def number(self) -> int:
        """0 for the first, one more each time that the mesh was refined anew."""
        return self.description["geometry"]


def display_of(session: Session) -> DisplayMesh:
    """The display mesh on whose vertices the samples are; OptionError if there is none."""
    display, count = session.samples.display, len(session.samples)
    if display is None or len(display.sample_vertices) != count:
        raise OptionError(
            f"view: found {count} samples that are not on the vertices of a display mesh (a working plane "
            "has none), expected Samples.on_vertices(scene); leave out --grid"
        )
    return display


def geometry_of(session: Session) -> Geometry:
    """Describe the scene and its display mesh.

    Raises
    ------
    OptionError
        If the samples are not on the vertices of a display mesh.
    """
    display = display_of(session)
    return _with_mesh(_constant(session, display) | {"version": 0}, 0, session.scene, display)


def remade_geometry(before: Geometry, session: Session) -> Geometry:
    """Another version of the scene: other movables, other light groups."""
    display = display_of(session)
    description = _constant(session, display) | {"version": before.description["version"] + 1}
    return _with_mesh(description, before.number + 1, session.scene, display)


def _constant(session: Session, display: DisplayMesh) -> dict[str, Any]:
    """What the mesh's refinement does not change."""
    scene = session.scene
    low, high = scene.bounds
    numbers = {id(image): i for i, image in enumerate(_images(scene))}
    return {
        "protocol": PROTOCOL,
        "name": Path(scene.source).stem if scene.source else "scene",
        "unit": scene.unit,
        "bounds": [low.tolist(), high.tolist()],
        "materials": [
            {
                "name": m.name,
                "reflectance": m.reflectance.tolist(),
                "emission": m.emission.tolist(),
                "group": group,
                "two_sided": m.two_sided,
                "colour": _texture(m.look.colour, numbers),
                "glow": _texture(m.look.glow, numbers),
                **_transparency(m),
            }
            for m, group in _drawn_materials(scene)[0]
        ],
        "groups": list(session.dim_factors),
        "cameras": [_camera(c) for c in (*_perspective(scene), _good_view(session, display))],
    }


def refined_geometry(before: Geometry, session: Session) -> Geometry:
    """The same scene, after its display mesh was refined anew."""
    return _with_mesh(before.description, before.number + 1, session.scene, display_of(session))


def _with_mesh(description: dict[str, Any], number: int, scene: Scene, display: DisplayMesh) -> Geometry:
    order = np.lexsort((display.reversed, display.triangle_material, display.triangle_mesh))
    drawn = drawn_mesh(scene, display)
    detail, corners, weights = drawn.detail(display)
    arrays = {
        "points": drawn.at(display.points).astype("<f4"),
        "normals": drawn.at(display.normals).astype("<f4"),
        "indices": drawn.triangles[order].astype("<u4"),
        "coordinates": drawn.coordinates.astype("<f4"),
        "copies": drawn.copies.astype("<u4"),
        "detail": detail.astype("<u4"),
        "detail_corners": corners.astype("<u4"),
        "detail_weights": weights.astype("<f4"),
    }
    of_mesh = {
        "geometry": number,
        "vertices": len(drawn.at(display.points)),
        "triangles": len(order),
        "arrays": _layout(arrays),
        "parts": _parts(display, order, _drawn_materials(scene)[1]),
        "meshes": _meshes(scene, display, drawn.at(display.vertex_mesh)),
    }
    data = b"".join(array.tobytes() for array in arrays.values())
    return Geometry(description | of_mesh, data, drawn, _images(scene))


def _layout(arrays: dict[str, np.ndarray]) -> dict[str, dict[str, Any]]:
    ends = np.cumsum([0, *(array.nbytes for array in arrays.values())]).tolist()
    return {
        name: {"offset": offset, "length": array.nbytes, "type": f"{array.dtype.kind}32"}
        for (name, array), offset in zip(arrays.items(), ends[:-1], strict=True)
    }


def _drawn_materials(
    scene: Scene,
) -> tuple[list[tuple[Material, str | None]], dict[tuple[int, int], int]]:
    """The scene's materials, each with its light group, then those that shine in several groups again.

    Returns
    -------
    materials with their groups, None of those that do not shine; and the number of what differs from the
    scene's, by (mesh, number in the scene)
    """
    drawn: list[tuple[Material, str | None]] = [(m, None) for m in scene.materials]
    number = {m.name: i for i, m in enumerate(scene.materials)}
    known: dict[tuple[int, str], int] = {}
    others: dict[tuple[int, int], int] = {}
    for mesh_number, mesh in enumerate(scene.meshes):
        for name in mesh.material:
            own = number[name]
            material, group = scene.materials[own], scene.materials[own].group or mesh.name
            if not material.emissive:
                continue
            if drawn[own][1] is None:
                drawn[own], known[own, group] = (material, group), own
            if (own, group) not in known:
                known[own, group] = len(drawn)
                drawn.append((material, group))
            others[mesh_number, own] = known[own, group]
    return drawn, others


def _parts(
    display: DisplayMesh, order: np.ndarray, drawn: Mapping[tuple[int, int], int]
) -> list[dict[str, Any]]:
    columns = (display.triangle_mesh, display.triangle_material, display.reversed)
    mesh, material, reverse = (column[order] for column in columns)
    new = np.r_[True, (np.diff(mesh) != 0) | (np.diff(material) != 0) | (reverse[1:] != reverse[:-1])]
    return [
        {
            "mesh": int(mesh[first]),
            "material": drawn.get((int(mesh[first]), int(material[first])), int(material[first])),
            "first": first,
            "count": end - first,
            "reversed": bool(reverse[first]),
        }
        for first, end in pairwise([*np.flatnonzero(new).tolist(), len(order)])
    ]


def _meshes(scene: Scene, display: DisplayMesh, vertex_mesh: np.ndarray) -> list[dict[str, Any]]:
    """Meshes with their ranges of vertices: vertices are numbered mesh by mesh."""
    assert (np.diff(vertex_mesh) >= 0).all()
    first = np.searchsorted(vertex_mesh, np.arange(len(scene.meshes) + 1)).tolist()
    closed = closed_meshes(display, len(scene.meshes)).tolist()
    return [
        {
            "name": m.name,
            "movable": m.movable,
            "closed": is_closed,
            "first_vertex": start,
            "vertex_count": end - start,
        }
        for m, is_closed, (start, end) in zip(scene.meshes, closed, pairwise(first), strict=True)
    ]


def _images(scene: Scene) -> list[bytes]:
    return images_of(texture for m in scene.materials for texture in m.look.textures)


def _transparency(material: Material) -> dict[str, Any]:
    """How much of what is behind the material a page shows."""
    look = material.look
    pane = material.surface if isinstance(material.surface, PaneSurface) else None
    cut_out = None
    if look.colour is not None and look.alpha_mode == "MASK":
        cut_out = min(look.alpha_cutoff / max(look.alpha, 1e-9), NOTHING_SHOWN)
    return {
        "opacity": 1.0 if pane is None else 1 - pane.passes,
        "scattered": 1.0 if pane is None else pane.scattered,
        "by_alpha": pane is not None and look.colour is not None and look.opacity is not None,
        "cut_out": cut_out,
    }


def _texture(texture: Texture | None, numbers: Mapping[int, int]) -> dict[str, Any] | None:
    if texture is None:
        return None
    return {
        "image": numbers[id(texture.image)],
        "mean": texture.mean.tolist(),
        "wrap": list(texture.wrap),
        "mag_filter": texture.mag_filter,
        "min_filter": texture.min_filter,
        "matrix": texture.matrix.ravel().tolist(),
    }


def _good_view(session: Session, display: DisplayMesh) -> Camera:
    """The automatic camera; as there may be no light yet, all surfaces count as lit."""
    surfaces = Surfaces(session.scene, display, session.poses, session.options["threads"] or 0)
    return automatic_camera(surfaces, np.ones(len(display.points)))


def _perspective(scene: Scene) -> list[Camera]:
    """The scene's perspective cameras; the page has no other kind."""
    return [camera for camera in scene.cameras if camera.height is None]


def _camera(camera: Camera) -> dict[str, Any]:
    return {
        "name": camera.name,
        "pose": pose_numbers(camera.pose),
        "vertical_fov": float(camera.vertical_fov),
    }
