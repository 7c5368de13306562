# SPDX-License-Identifier: Apache-2.0
"""glTF 2.0 (.gltf, .glb) to Scene: static meshes, movable objects, lights, cameras and the node tree."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from deltalux.errors import SceneError
from deltalux.io.decoding.process import DecoderProcess
from deltalux.io.diagnostics import MISSING_REFLECTANCE, element
from deltalux.io.glass import LITERAL
from deltalux.io.scene_size import require_memory_for_triangles
from deltalux.scene import Mesh, Node, Scene, replace_scene
from deltalux.scene.adding import NO_LIGHT
from deltalux.scene.scene import MAX_GROUPS

from .accessors import Accessors
from .buffers import Buffers
from .cameras import read_cameras
from .document import Document, read_document
from .instances import expand_instances
from .lights import UNIT_OF, Lights
from .materials import Materials
from .movables import Ownership, assign_owners
from .nodes import PlacedNode, place_nodes, rigid_inverse, rigid_part
from .primitives import Primitives, joined_coordinates
from .textures import Textures

# How lamps without a group in the file are grouped: each alone, by equal node names, or each alone unless
# there would be more groups than have their own sums.
BY_LAMP, BY_NAME, BY_COUNT = GROUPINGS = ("lamp", "name", "auto")


def load_gltf(
    path: Path,
    movable: Sequence[str] = (),
    light_units: str = "spec",
    space: np.ndarray | None = None,
    groups: str = BY_COUNT,
    *,
    glass: str = LITERAL,
    reflectance: float = MISSING_REFLECTANCE,
) -> Scene:
    """Read a glTF file; see `deltalux.load`.

    A static node with a mesh becomes one Mesh with world vertices and the identity as pose. A movable node
    becomes one Mesh with everything below it: the pose is the rigid part of its world transform, scale and
    shear are applied to the vertices, and lights below it are attached to it. Skins and morph targets are
    read in their authored state.
    """
    document = read_document(path)
    with DecoderProcess() as decoder:
        buffers = Buffers(document, decoder)
        accessors = Accessors(document, buffers)
        nodes = expand_instances(place_nodes(document, space), accessors)
        ownership = assign_owners(nodes, movable, document.notes)
        assembly = _Assembly(
            document, nodes, ownership, light_units, buffers, accessors, decoder,
            Materials(document, Textures(document, buffers), glass, reflectance),
        )  # fmt: skip
        assembly.check_size()
        scene = assembly.scene(groups == BY_NAME)
        if groups == BY_COUNT and len(scene.groups) > MAX_GROUPS:
            apart, scene = scene, assembly.scene(by_name=True)
            if len(scene.groups) < len(apart.groups):
                document.notes.add(
                    f"{len(apart.groups)} lamps, more than the {MAX_GROUPS} light groups that are dimmed at "
                    "once: those of one name share a group; --groups lamp keeps them apart"
                )
    scene = replace_scene(
        scene,
        cameras=read_cameras(document, nodes),
        source=str(path.absolute()),
        files=document.files(),
    )
    _check_content(scene, document)
    areas = [(light["name"], light["power"]) for light in scene.info()["lights"] if light["kind"] == "area"]
    assembly.lights.note_plausibility(areas)
    return replace_scene(scene, warnings=document.notes.lines())


class _Assembly:
    """Converts placed nodes to meshes, materials and lights."""

    def __init__(
        self,
        document: Document,
        nodes: list[PlacedNode],
        ownership: Ownership,
        light_units: str,
        buffers: Buffers,
        accessors: Accessors,
        decoder: DecoderProcess,
        materials: Materials,
    ) -> None:
        self.document = document
        self.nodes = nodes
        self.ownership = ownership
        self.materials = materials
        users = {node.source.mesh: node.label for node in reversed(nodes) if node.source.mesh is not None}
        self.primitives = Primitives(document, accessors, buffers, decoder, self.materials, users)
        self.light_units = light_units
        self._begin(by_name=False)

    def _begin(self, by_name: bool) -> None:
        self.by_name = by_name
        self.materials.begin()
        self.lights = Lights(self.document, self.light_units, by_name)
        self.meshes: list[Mesh] = []
        self.kept: list[Node] = []

    def check_size(self) -> None:
        """Refuse, before any array is read, a file whose instances would exceed the memory."""
        sizes: dict[int, tuple[int, int]] = {}
        triangles = vertices = 0
        for node in self.nodes:
            mesh = node.source.mesh
            if mesh is None:
                continue
            element(self.document.gltf.meshes, mesh, f"{node.place}.mesh")
            if mesh not in sizes:
                sizes[mesh] = self.primitives.size(mesh)
            triangles += sizes[mesh][0]
            vertices += sizes[mesh][1]
        require_memory_for_triangles(triangles, vertices)

    def scene(self, by_name: bool) -> Scene:
        """Meshes, materials, lights and nodes.

        Each lamp forms its own light group, or, `by_name`, lamps on nodes of one name share a group.
        """
        self._begin(by_name)
        self._put_together()
        return Scene(
            self.meshes,
            self.materials.used,
            self.lights.found,
            unit=UNIT_OF[self.light_units],
            nodes=self.kept,
        )

    def _put_together(self) -> None:
        """Process all nodes in order; the members of a movable follow its root directly."""
        members: dict[int, list[int]] = {}
        for k, owner in enumerate(self.ownership.owner):
            if owner is not None:
                members.setdefault(owner, []).append(k)
        for k, node in enumerate(self.nodes):
            self._note_unhonoured(node)
            owner = self.ownership.owner[k]
            if owner == k:
                self._add_mesh(k, members[k], rigid_part(node.world))
            elif owner is None and self._has_triangles(node):
                self._add_mesh(k, [k], np.eye(4))
            elif owner is None:
                lights = self.lights.add(node, node.world, None)
                self.kept.append(Node(node.name, node.parent, node.local, (), lights, node.label))

    def _has_triangles(self, node: PlacedNode) -> bool:
        mesh = node.source.mesh
        return mesh is not None and len(self.primitives.surface(mesh).triangles) > 0

    def _add_mesh(self, root: int, members: list[int], pose: np.ndarray) -> None:
        """Add one Mesh of the nodes `members`, with materials, lights and the records of its nodes."""
        movable = self.ownership.owner[root] == root
        name = self.ownership.mesh_name[root]
        # The mesh's name differs from the node's if several nodes have the same name.
        shared = self.by_name and name != self.nodes[root].name
        default_group = self.nodes[root].name if shared else None
        to_local = rigid_inverse(pose)
        vertices, triangles, index = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
        coordinates: list[np.ndarray | None] = [None]
        names: dict[str, int] = {}
        vertex_count = triangle_count = 0
        for k in members:
            node = self.nodes[k]
            matrix = to_local @ node.world
            parts: tuple[tuple[str, int, int], ...] = ((name, triangle_count, 0),) if k == root else ()
            if node.source.mesh is not None:
                surface = self.primitives.surface(node.source.mesh)
                points, corners, texels = surface.placed(matrix)
                coordinates.append(texels)
                parts = ((name, triangle_count, len(corners)),)
                vertices.append(points)
                triangles.append(corners + vertex_count)
                index.append(self._material_index(surface.materials, node, default_group, names))
                vertex_count += len(points)
                triangle_count += len(corners)
            lights = self.lights.add(node, matrix, name if movable else None)
            self.kept.append(Node(node.name, node.parent, node.local, parts, lights, node.label))
        self.meshes.append(
            Mesh(
                name,
                np.concatenate(vertices),
                np.concatenate(triangles),
                tuple(names),
                np.concatenate(index),
                pose,
                movable,
                coordinates=joined_coordinates(coordinates, [len(part) for part in triangles]),
            )
        )

    def _material_index(
        self, materials: np.ndarray, node: PlacedNode, default_group: str | None, names: dict[str, int]
    ) -> np.ndarray:
        """Index of each triangle's material among `names`, which is extended as needed."""
        used, where = np.unique(materials, return_inverse=True)
        found = [self.materials.material(int(m), node.group, default_group).name for m in used]
        return np.array([names.setdefault(n, len(names)) for n in found], np.int64)[where]

    def _note_unhonoured(self, node: PlacedNode) -> None:
        if node.source.mesh is None:
            return
        self.primitives.note_unhonoured(node.source.mesh, node.label)
        if node.source.skin is not None:
            self.document.notes.add("skins are not applied: vertices stand as authored", node.label)


def _check_content(scene: Scene, document: Document) -> None:
    areas = np.concatenate([np.zeros(0), *(mesh.triangle_areas() for mesh in scene.meshes)])
    if not len(areas):
        raise SceneError("scene: found no triangles, expected some surface to light; export the meshes too")
    flat = int((areas == 0).sum())
    if flat:
        document.notes.add(f"{flat:,} of {len(areas):,} triangles have no area")
    if not scene.lights and not any(material.emissive for material in scene.materials):
        document.notes.add(NO_LIGHT)
