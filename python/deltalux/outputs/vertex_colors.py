# SPDX-License-Identifier: Apache-2.0
"""Writes results as .glb: the display mesh with light as vertex colours, and exact values as attributes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pygltflib as gl

from deltalux.files import written_aside
from deltalux.mesh.display_mesh import DisplayMesh, movable_poses
from deltalux.mesh.surfaces import Surfaces
from deltalux.scene import Camera, Node
from deltalux.vectors import normals_by_area, unit
from deltalux.version import __version__

from .baked import Baked, about_text, display_of, keep_inputs, vertex_irradiance
from .covered import shown_values
from .gltf_binary import Binary
from .gltf_materials import GltfMaterials
from .gltf_places import Places
from .images import metered_exposure
from .node_tree import moved_matrices, world_matrices
from .shown_looks import Shown, shown_as
from .texture_coordinates import TextureCoordinates, split_at_seams

# display level of the typical luminance: lower than in pictures, because no tone curve follows
KEY = 0.2
UP = (0.0, 1.0, 0.0)


def write_glb(path: str | os.PathLike[str], baked: Baked) -> None:
    """Write the lit scene as one .glb.

    Every node of the scene keeps its name and place; its refined triangles carry COLOR_0 =
    min(1, exposure × irradiance), which multiplies the base colour (the reflectance) of an
    unlit material, and the unclamped linear values as _IRRADIANCE and _STANDARD_ERROR.
    In COLOR_0, samples covered by other surfaces take their neighbours' values.
    If the scene has a texture and coordinates, the base colour is a factor on the texture, and its
    product with the mean texel is the reflectance. Luminous materials have a white base colour and their
    radiance in COLOR_0. Cameras, lights and the transparency of materials are kept. `asset.extras` documents
    the numbers.

    Raises
    ------
    OptionError
        If the samples are not on the vertices of the display mesh, or the scene was read from `path`.
    """
    keep_inputs(path, baked)
    display = display_of(baked, ".glb")
    surfaces = Surfaces(baked.scene, display, baked.poses, baked.threads)
    irradiance = vertex_irradiance(baked, display)
    error = display.at_vertices(baked.result.standard_error)
    shown = shown_values(surfaces, irradiance)
    exposure = baked.exposure or _exposure(surfaces, shown, baked.camera)
    light = {"_IRRADIANCE": irradiance, "_STANDARD_ERROR": error}
    writer = _Writer(baked, display, light, shown, exposure)
    writer.add_nodes()
    writer.add_places()
    writer.document.asset.extras = {
        **about_text(baked.result),
        "exposure": exposure,
        "COLOR_0": "min(1, exposure * irradiance), more where a texture is too dark; luminous: "
        "min(1, exposure * (reflectance * irradiance + pi * radiance) / mean of their texture, if any)",
        "_IRRADIANCE": f"linear RGB, {baked.result.unit}",
        "_STANDARD_ERROR": f"linear RGB, {baked.result.unit}",
    }
    data = b"".join(writer.finished().save_to_bytes())
    with written_aside(path) as file:
        file.write(data)


def _exposure(surfaces: Surfaces, shown: np.ndarray, camera: Camera | None) -> float:
    """Factor on irradiance times reflectance; pictures meter radiance, which is this product over pi."""
    return metered_exposure(surfaces, shown, camera, KEY) / np.pi if shown.any() else 1.0


@dataclass(frozen=True, eq=False)
class _Part:
    """Display triangles that one node carries, and the transform from display space to the node's."""

    triangles: np.ndarray
    to_node: np.ndarray  # (3, 3)
    offset: np.ndarray  # (3,), subtracted before
    mirrored: bool


class _Writer:
    """Collects accessors and nodes of one document."""

    def __init__(
        self,
        baked: Baked,
        display: DisplayMesh,
        light: dict[str, np.ndarray],
        shown: np.ndarray,
        exposure: float,
    ) -> None:
        self._baked, self._display, self._exposure = baked, display, exposure
        # Values at vertices: by attribute name, and as COLOR_0 shows them.
        self._light, self._shown = light, shown
        self._coordinates = TextureCoordinates(baked.scene, display)
        self._materials: dict[tuple[int, bool], tuple[Shown, int]] = {}
        self._poses = movable_poses(baked.scene, baked.poses)
        self._index_of = {mesh.name: i for i, mesh in enumerate(baked.scene.meshes)}
        self._first = np.searchsorted(display.triangle_mesh, np.arange(len(baked.scene.meshes) + 1))
        self.document = gl.GLTF2(
            asset=gl.Asset(version="2.0", generator=f"deltalux {__version__}"),
            scene=0,
            scenes=[gl.Scene(nodes=[])],
            buffers=[gl.Buffer()],
        )
        self._binary = Binary(self.document)
        self._gltf_materials = GltfMaterials(self.document, self._binary)

    def add_nodes(self) -> None:
        """Add the scene's nodes, then one for each mesh that no node carries."""
        scene = self._baked.scene
        matrices = moved_matrices(scene, self._poses)
        worlds = world_matrices(scene.nodes)
        for node, matrix, world in zip(scene.nodes, matrices, worlds, strict=True):
            self._add_node(node.name, matrix, list(self._parts(node, world)))
        for index, node in enumerate(scene.nodes):
            parent = self.document.nodes[node.parent] if node.parent >= 0 else None
            (self.document.scenes[0].nodes if parent is None else parent.children).append(index)
        carried = {name for node in scene.nodes for name, _, _ in node.parts}
        for index, mesh in enumerate(scene.meshes):
            if mesh.name in carried:
                continue
            pose = self._poses.get(index, np.eye(4))
            here = np.arange(self._first[index], self._first[index + 1])
            parts = [] if pose is None else [_Part(here, np.eye(3), np.zeros(3), False)]
            self._add_node(mesh.name, np.eye(4) if pose is None else pose, parts)
            self.document.scenes[0].nodes.append(len(self.document.nodes) - 1)

    def add_places(self) -> None:
        """Add the scene's cameras, and its lights at their present places."""
        scene = self._baked.scene
        worlds = world_matrices(scene.nodes, moved_matrices(scene, self._poses))
        places = Places(self.document, worlds)
        places.add_cameras(scene)
        places.add_lights(scene, lambda movable: self._poses[self._index_of[movable]])

    def finished(self) -> gl.GLTF2:
        """The finished document with its binary part."""
        for node in self.document.nodes:
            node.children = node.children or None
        self._binary.finish()
        return self.document

    def _parts(self, node: Node, world: np.ndarray) -> Iterator[_Part]:
        scene = self._baked.scene
        for name, first, count in node.parts:
            index = self._index_of[name]
            if index in self._poses and self._poses[index] is None:
                continue
            mesh_triangles = slice(self._first[index], self._first[index + 1])
            source = self._display.source_triangle[mesh_triangles]
            low, high = np.searchsorted(source, (first, first + count)) + mesh_triangles.start
            # As loaded, the node's world matrix transforms the node to the world, and the pose transforms the
            # part.
            matrix = world
            if scene.meshes[index].movable:
                matrix = np.linalg.inv(scene.meshes[index].pose) @ world
            inverse = np.linalg.inv(matrix[:3, :3])
            mirrored = np.linalg.det(matrix[:3, :3]) < 0
            yield _Part(np.arange(low, high), inverse, matrix[:3, 3], bool(mirrored))

    def _add_node(self, name: str, matrix: np.ndarray, parts: list[_Part]) -> None:
        primitives = [p for part in parts for p in self._primitives(part)]
        mesh = None
        if primitives:
            mesh = len(self.document.meshes)
            self.document.meshes.append(gl.Mesh(name=name, primitives=primitives))
        own = None if np.array_equal(matrix, np.eye(4)) else matrix.T.ravel().tolist()
        self.document.nodes.append(gl.Node(name=name, mesh=mesh, matrix=own, children=[]))

    def _primitives(self, part: _Part) -> Iterator[gl.Primitive]:
        material = self._display.triangle_material[part.triangles]
        for index in np.unique(material):
            chosen = part.triangles[material == index]
            look = self._baked.scene.materials[index].look
            if look.colour is None and look.glow is None:
                yield self._primitive(part, chosen, int(index), None)
                continue
            coordinates = self._coordinates.of(chosen)
            known = np.isfinite(coordinates).all(axis=(1, 2))
            if known.any():
                yield self._primitive(part, chosen[known], int(index), coordinates[known])
            if not known.all():
                yield self._primitive(part, chosen[~known], int(index), None)

    def _primitive(
        self, part: _Part, chosen: np.ndarray, index: int, coordinates: np.ndarray | None
    ) -> gl.Primitive:
        display, material = self._display, self._baked.scene.materials[index]
        texels = None
        if coordinates is None:
            used, corners = np.unique(display.triangles[chosen], return_inverse=True)
            corners = corners.reshape(-1, 3)
        else:
            used, texels, corners = split_at_seams(display.triangles[chosen], coordinates)
        points = (display.points[used] - part.offset) @ part.to_node.T
        normals = _directions(display.normals[used] @ np.linalg.inv(part.to_node), points, corners)
        emits = np.zeros(len(used), dtype=bool)
        emits[corners[~display.reversed[chosen]].ravel()] = True
        shown, number = self._material(index, texels is not None)
        color = shown.colours(material, self._exposure, self._shown[used], emits)
        color = np.rint(65535 * np.column_stack([color, np.ones(len(color))]))
        attributes = gl.Attributes(
            POSITION=self._binary.vertices(points.astype(np.float32), bounds=True),
            NORMAL=self._binary.vertices(normals.astype(np.float32)),
            COLOR_0=self._binary.vertices(color.astype(np.uint16)),
        )
        if texels is not None and shown.texture is not None:
            attributes.TEXCOORD_0 = self._binary.vertices(texels)
        for name, values in self._light.items():
            setattr(attributes, name, self._binary.vertices(values[used].astype(np.float32)))
        # Viewers invert the winding of a mirrored node.
        indices = self._binary.indices(corners[:, (0, 2, 1)] if part.mirrored else corners)
        return gl.Primitive(attributes=attributes, indices=indices, material=number)

    def _material(self, index: int, textured: bool) -> tuple[Shown, int]:
        """How a material is shown on surfaces with or without texture coordinates, and its number."""
        key = (index, textured)
        if key not in self._materials:
            material = self._baked.scene.materials[index]
            light = self._mean_light(index) if material.emissive else np.zeros(3)
            how = shown_as(material, textured, light)
            self._materials[key] = how, self._gltf_materials.add(material, how)
        return self._materials[key]

    def _mean_light(self, material: int) -> np.ndarray:
        """(3,) mean irradiance of a material's surfaces."""
        display = self._display
        own = display.triangles[display.triangle_material == material]
        return self._shown[own.ravel()].mean(axis=0)


def _directions(normals: np.ndarray, points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3) of the vertices (n, 3) of triangles; where there is none, that of a triangle.

    Faces that look in opposite directions leave a vertex between them without one.
    """
    normals = unit(normals)
    if (none := ~normals.any(axis=1)).any():
        flat = np.zeros_like(normals)
        flat[corners] = unit(normals_by_area(points[corners]))[:, None]
        normals[none] = flat[none]
        normals[~normals.any(axis=1)] = UP  # in a triangle without area
    return normals
