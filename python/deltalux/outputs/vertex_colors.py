# SPDX-License-Identifier: Apache-2.0
"""Results as .glb: the display mesh with vertex colours that show the light, and its exact values beside."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pygltflib as gl

from deltalux.display_mesh import DisplayMesh, movable_poses
from deltalux.files import written_aside
from deltalux.scene import Camera, Light, Material, Node, PointLight, SpotLight, SunLight
from deltalux.surfaces import Surfaces
from deltalux.units import LUX
from deltalux.version import __version__

from .baked import Baked, about_text, display_of, keep_inputs, vertex_irradiance
from .camera import look_at
from .covered import shown_values
from .images import metered_exposure
from .node_tree import move_since_load, moved_matrices, world_matrices

KEY = 0.2  # where the typical luminance of a picture lands: below that of pictures, no tone curve follows
NEAR = 0.01  # metres, of cameras
UNLIT, PUNCTUAL = "KHR_materials_unlit", "KHR_lights_punctual"
LUMENS_PER_WATT = 683.0  # what viewers take radiometric light for


def write_glb(path: str | os.PathLike[str], baked: Baked) -> None:
    """Write the lit scene as one .glb.

    Every node of the scene keeps its name and place; its refined triangles carry COLOR_0 =
    min(1, exposure × irradiance), which multiplies the base colour (the reflectance) of an
    unlit material, and the unclamped linear values as _IRRADIANCE and _STANDARD_ERROR.
    In COLOR_0, samples under something else take their neighbours' values.
    Luminous materials have a white base colour and their radiance in COLOR_0. What the numbers
    mean stands in `asset.extras`.

    Raises
    ------
    OptionError
        Where the samples are not on the vertices of the display mesh, or the scene was read from `path`.
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
    writer.add_cameras()
    writer.add_lights()
    writer.document.asset.extras = {
        **about_text(baked.result),
        "exposure": exposure,
        "COLOR_0": "min(1, exposure * irradiance); luminous materials: "
        "min(1, exposure * (reflectance * irradiance + pi * radiance))",
        "_IRRADIANCE": f"linear RGB, {baked.result.unit}",
        "_STANDARD_ERROR": f"linear RGB, {baked.result.unit}",
    }
    data = b"".join(writer.finished().save_to_bytes())
    with written_aside(path) as file:
        file.write(data)


def _exposure(surfaces: Surfaces, shown: np.ndarray, camera: Camera | None) -> float:
    """Factor on irradiance times reflectance; pictures meter radiance, which is that over pi."""
    return metered_exposure(surfaces, shown, camera, KEY) / np.pi if shown.any() else 1.0


def _light_matrix(light: Light) -> np.ndarray:
    """To the world from a light's own space, where it shines along -Z."""
    towards = np.array((0.0, 0.0, -1.0) if isinstance(light, PointLight) else light.direction)
    matrix = look_at(np.zeros(3), towards)
    if not isinstance(light, SunLight):
        matrix[:3, 3] = light.position
    return matrix


def _light_definition(light: Light, factor: float) -> dict[str, Any]:
    """The light as KHR_lights_punctual has it: candela or lux, `factor` times its own intensity."""
    power = factor * np.asarray(light.irradiance if isinstance(light, SunLight) else light.intensity)
    brightest = float(power.max())
    kind = {PointLight: "point", SpotLight: "spot", SunLight: "directional"}[type(light)]
    made: dict[str, Any] = {"name": light.name, "type": kind, "intensity": brightest}
    if brightest > 0:
        made["color"] = (power / brightest).tolist()
    if isinstance(light, SpotLight):
        made["spot"] = {"innerConeAngle": light.inner_angle, "outerConeAngle": light.outer_angle}
    return made


@dataclass(frozen=True, eq=False)
class _Part:
    """Display triangles that one node carries, and the map from display space into the node's."""

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
        # Of each vertex: by the attribute's name, and as COLOR_0 shows it.
        self._light, self._shown = light, shown
        self._bytes = bytearray()
        self._materials: dict[int, int] = {}
        self._poses = movable_poses(baked.scene, baked.poses)
        self._index_of = {mesh.name: i for i, mesh in enumerate(baked.scene.meshes)}
        self._first = np.searchsorted(display.triangle_mesh, np.arange(len(baked.scene.meshes) + 1))
        self.document = gl.GLTF2(
            asset=gl.Asset(version="2.0", generator=f"deltalux {__version__}"),
            extensionsUsed=[UNLIT],
            scene=0,
            scenes=[gl.Scene(nodes=[])],
            buffers=[gl.Buffer()],
        )

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

    def add_cameras(self) -> None:
        """Add the scene's cameras, each as a node of its own at its place in the world."""
        for camera in self._baked.scene.cameras:
            perspective = gl.Perspective(yfov=float(camera.vertical_fov), znear=NEAR)
            self.document.cameras.append(
                gl.Camera(name=camera.name, type="perspective", perspective=perspective)
            )
            matrix = np.asarray(camera.pose, dtype=np.float64).T.ravel().tolist()
            number = len(self.document.cameras) - 1
            self.document.nodes.append(gl.Node(name=camera.name, camera=number, matrix=matrix, children=[]))
            self.document.scenes[0].nodes.append(len(self.document.nodes) - 1)

    def add_lights(self) -> None:
        """Add point, spot and sun lights where they are now, each as a node of its own."""
        scene = self._baked.scene
        factor = 1.0 if scene.unit == LUX else LUMENS_PER_WATT
        definitions: list[dict[str, Any]] = []
        for light in scene.lights:
            at = _light_matrix(light)
            if light.attached_to is not None:
                index = self._index_of[light.attached_to]
                if self._poses[index] is None:
                    continue
                at = move_since_load(scene, index, self._poses) @ at
            place = {PUNCTUAL: {"light": len(definitions)}}
            matrix = at.T.ravel().tolist()
            self.document.nodes.append(gl.Node(name=light.name, matrix=matrix, children=[], extensions=place))
            self.document.scenes[0].nodes.append(len(self.document.nodes) - 1)
            definitions.append(_light_definition(light, factor))
        if definitions:
            self.document.extensions[PUNCTUAL] = {"lights": definitions}
            self.document.extensionsUsed.append(PUNCTUAL)

    def finished(self) -> gl.GLTF2:
        """The document with its binary part."""
        for node in self.document.nodes:
            node.children = node.children or None
        self.document.buffers[0].byteLength = len(self._bytes)
        self.document.set_binary_blob(bytes(self._bytes))
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
            # As loaded, the node's world matrix takes its space to the world, the pose the part's.
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
            yield self._primitive(part, chosen, int(index))

    def _primitive(self, part: _Part, chosen: np.ndarray, material: int) -> gl.Primitive:
        display = self._display
        used, corners = np.unique(display.triangles[chosen], return_inverse=True)
        corners = corners.reshape(-1, 3)
        if part.mirrored:  # a viewer turns the winding of a mirrored node round
            corners = corners[:, (0, 2, 1)]
        points = (display.points[used] - part.offset) @ part.to_node.T
        normals = display.normals[used] @ np.linalg.inv(part.to_node)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        emits = np.zeros(len(used), dtype=bool)
        emits[corners[~display.reversed[chosen]].ravel()] = True
        color = self._color(self._baked.scene.materials[material], self._shown[used], emits)
        attributes = gl.Attributes(
            POSITION=self._accessor(points.astype(np.float32), "VEC3", bounds=True),
            NORMAL=self._accessor(normals.astype(np.float32), "VEC3"),
            COLOR_0=self._accessor(color, "VEC4", normalized=True),
        )
        for name, values in self._light.items():
            setattr(attributes, name, self._accessor(values[used].astype(np.float32), "VEC3"))
        indices = self._accessor(corners.ravel().astype(np.uint32), "SCALAR", gl.ELEMENT_ARRAY_BUFFER)
        return gl.Primitive(attributes=attributes, indices=indices, material=self._material(material))

    def _color(self, material: Material, irradiance: np.ndarray, emits: np.ndarray) -> np.ndarray:
        color = self._exposure * irradiance
        if material.emissive:
            shown = emits | material.two_sided
            color = material.reflectance * color
            color += np.pi * self._exposure * material.emission * shown[:, None]
        clamped = np.clip(np.column_stack([color, np.ones(len(color))]), 0, 1)
        return np.rint(65535 * clamped).astype(np.uint16)

    def _material(self, index: int) -> int:
        if index not in self._materials:
            material = self._baked.scene.materials[index]
            base = np.ones(3) if material.emissive else material.reflectance
            self._materials[index] = len(self.document.materials)
            self.document.materials.append(
                gl.Material(
                    name=material.name,
                    pbrMetallicRoughness=gl.PbrMetallicRoughness(
                        baseColorFactor=[*base.tolist(), 1.0], metallicFactor=0.0, roughnessFactor=1.0
                    ),
                    extensions={UNLIT: {}},
                    alphaMode=None,
                    alphaCutoff=None,
                )
            )
        return self._materials[index]

    def _accessor(
        self, values: np.ndarray, kind: str, target: int = gl.ARRAY_BUFFER,
        normalized: bool = False, bounds: bool = False,
    ) -> int:  # fmt: skip
        component = {"f": gl.FLOAT, "H": gl.UNSIGNED_SHORT, "I": gl.UNSIGNED_INT}[values.dtype.char]
        view = gl.BufferView(buffer=0, byteOffset=len(self._bytes), byteLength=values.nbytes, target=target)
        self._bytes += np.ascontiguousarray(values).tobytes()  # all items have multiples of 4 bytes
        self.document.bufferViews.append(view)
        self.document.accessors.append(
            gl.Accessor(
                bufferView=len(self.document.bufferViews) - 1,
                componentType=component,
                count=len(values),
                type=kind,
                normalized=normalized or None,
                min=values.min(axis=0).tolist() if bounds else None,
                max=values.max(axis=0).tolist() if bounds else None,
            )
        )
        return len(self.document.accessors) - 1
