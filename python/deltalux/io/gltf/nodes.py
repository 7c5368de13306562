# SPDX-License-Identifier: Apache-2.0
"""The node tree of a glTF document: the scene's nodes in order, their transforms and their names."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux.io.diagnostics import UniqueNames, element, malformed

from .document import Document

VISIBILITY, LIGHT = "KHR_node_visibility", "KHR_lights_punctual"


@dataclass(frozen=True)
class PlacedNode:
    """One node of the scene that is loaded.

    `parent` is a position in the list of placed nodes, -1 for a root; a parent precedes its children.
    `label` is unique; among nodes of one name, those with a mesh come first. `local` and `world` are 4x4.
    """

    index: int
    parent: int
    source: Any  # pygltflib's record
    name: str
    label: str
    group: str | None
    local: np.ndarray
    world: np.ndarray

    @property
    def place(self) -> str:
        """Description of the node's place in the file."""
        return f"nodes[{self.index}]"


def place_nodes(document: Document, space: np.ndarray | None = None) -> list[PlacedNode]:
    """The nodes of the default scene, depth first, with world transforms.

    `space` transforms the file's space to the world, 4x4; it becomes a part of the roots' transforms.
    Raises FormatError for cycles, nodes with two parents, and transforms that are not affine or finite.
    """
    nodes = document.gltf.nodes
    parents = _parents(nodes)
    order = _depth_first(nodes, _roots(document, parents))
    nodes = _without_hidden(document, parents, order)
    position = {index: k for k, index in enumerate(order)}
    names = [_name(document, index) for index in order]
    labels = unique_labels(names, [nodes[index].mesh is not None for index in order])
    placed: list[PlacedNode] = []
    for k, index in enumerate(order):
        parent = position.get(parents[index], -1)
        local = _local_matrix(nodes[index], f"nodes[{index}]")
        group = nodes[index].extras.get("group")
        if parent >= 0:
            group = group or placed[parent].group
            world = finite_product(placed[parent].world, local, f"nodes[{index}]")
        elif space is not None:
            local = world = finite_product(space, local, f"nodes[{index}]")
        else:
            world = local
        placed.append(PlacedNode(index, parent, nodes[index], names[k], labels[k], group, local, world))
    return placed


def _parents(nodes: list[Any]) -> list[int]:
    parents = [-1] * len(nodes)
    for i, node in enumerate(nodes):
        for child in node.children:
            element(nodes, child, f"nodes[{i}].children")
            if parents[child] >= 0:
                raise malformed(
                    f"nodes[{child}]", f"a child of both node {parents[child]} and node {i}", "one parent"
                )
            parents[child] = i
    return parents


def _roots(document: Document, parents: list[int]) -> list[int]:
    gltf = document.gltf
    if not gltf.scenes:
        return [i for i, parent in enumerate(parents) if parent < 0]
    index = gltf.scene if gltf.scene is not None else 0
    scene = element(gltf.scenes, index, "scene")
    if gltf.scene is None and len(gltf.scenes) > 1:
        document.notes.add(f"{len(gltf.scenes)} scenes and no default: the first is loaded")
    elif len(gltf.scenes) > 1:
        document.notes.add(f"{len(gltf.scenes)} scenes: only the default one is loaded")
    place = f"scenes[{index}].nodes"
    for root in scene.nodes:
        element(gltf.nodes, root, place)
        if parents[root] >= 0:
            document.notes.add(
                "the scene lists nodes that are children of others: each stands once, below its parent where "
                "that is in the scene too",
                f"node {root}",
            )
    return _topmost(scene.nodes, parents, place)


def _topmost(listed: list[int], parents: list[int], place: str) -> list[int]:
    """The listed nodes that are below no other listed one.

    The specification requires roots only, and Khronos' validator reports others (SCENE_NON_ROOT_NODE).
    Exporters nevertheless list all nodes; viewers open such files, and those that show each node twice are
    wrong.
    """
    wanted = set(listed)
    top: dict[int, int] = {-1: -1}  # for each visited node: the topmost listed node above it, or itself
    for node in listed:
        chain: dict[int, None] = {}
        while node not in top:
            if node in chain:
                raise malformed(place, f"node {node}, which is its own ancestor", "nodes without cycles")
            chain[node] = None
            node = parents[node]
        found = top[node]
        for below in reversed(chain):
            found = below if found < 0 and below in wanted else found
            top[below] = found
    return list(dict.fromkeys(top[node] for node in listed))


def _depth_first(nodes: list[Any], roots: list[int]) -> list[int]:
    order = []
    stack = roots[::-1]
    while stack:  # not recursive: a chain of nodes may be longer than the call stack
        index = stack.pop()
        order.append(index)
        stack.extend(reversed(nodes[index].children))
    return order


def _without_hidden(document: Document, parents: list[int], order: list[int]) -> list[Any]:
    """The nodes, of which hidden ones and all below them have neither mesh nor light (KHR_node_visibility).

    Cameras see from hidden nodes, too.
    """
    nodes, hidden = list(document.gltf.nodes), set[int]()
    for index in order:  # parents come first
        if parents[index] in hidden or not nodes[index].extensions.get(VISIBILITY, {}).get("visible", True):
            hidden.add(index)
            found = nodes[index] = copy.copy(nodes[index])
            if found.mesh is not None or LIGHT in found.extensions:
                document.notes.add("hidden objects and lamps are left out", _name(document, index))
            found.mesh = found.skin = None
            found.extensions = {}
    return nodes


def _name(document: Document, index: int) -> str:
    node = document.gltf.nodes[index]
    if node.name:
        return node.name
    if node.mesh is not None:
        mesh = element(document.gltf.meshes, node.mesh, f"nodes[{index}].mesh")
        if mesh.name:
            return mesh.name
    return f"node{index}"


def unique_labels(names: list[str], with_mesh: list[bool]) -> list[str]:
    """The names, numbered if they repeat."""
    # Nodes with a mesh first: their labels become the names of meshes, so "room" below an empty "room"
    # is not "room#2".
    unique = UniqueNames()
    labels = [""] * len(names)
    for wanted in (True, False):
        for k, name in enumerate(names):
            if with_mesh[k] is wanted:
                labels[k] = unique.take(name)
    return labels


def _local_matrix(node: Any, place: str) -> np.ndarray:
    if node.matrix is not None:
        matrix = np.array(node.matrix).reshape(4, 4).T  # stored column by column
        if np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-6:
            raise malformed(f"{place}.matrix", f"last row {matrix[3].tolist()}", "[0, 0, 0, 1]")
        matrix[3] = (0, 0, 0, 1)
        return matrix
    return trs_matrix(
        node.translation or (0.0, 0.0, 0.0), node.rotation, node.scale or (1.0, 1.0, 1.0), place
    )


def finite_product(parent: np.ndarray, local: np.ndarray, place: str) -> np.ndarray:
    """`parent` @ `local`; FormatError if that exceeds float64."""
    with np.errstate(over="ignore", invalid="ignore"):
        world = parent @ local
    if not np.isfinite(world).all():
        raise malformed(place, "a world transform beyond float64", "a finite transform")
    return world


def trs_matrix(translation: Any, rotation: Any, scale: Any, place: str) -> np.ndarray:
    """4x4 matrix of a translation (3,), a quaternion x, y, z, w or None, and a scale (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3] = _rotation(rotation, place) * np.asarray(scale)
    matrix[:3, 3] = translation
    return matrix


def _rotation(quaternion: Any, place: str) -> np.ndarray:
    if quaternion is None:
        return np.eye(3)
    length = float(np.linalg.norm(quaternion))
    if length < 1e-6:
        raise malformed(f"{place}.rotation", quaternion, "a unit quaternion")
    x, y, z, w = (q / length for q in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rigid_part(matrix: np.ndarray) -> np.ndarray:
    """The rigid transform nearest to an affine one: its origin, and the rotation of its polar decomposition.

    A mirrored matrix is decomposed after turning round the axis that leaves the least rotation, the first one
    of several: a node that is only mirrored is not rotated.
    """
    linear = matrix[:3, :3]
    u, _, vt = np.linalg.svd(linear)
    rotation = u @ vt
    if np.linalg.det(linear) < 0:
        rotation = rotation * np.where(np.arange(3) == np.argmin(np.diag(rotation).round(9)), -1.0, 1.0)
    elif np.linalg.det(rotation) < 0:  # a singular matrix: any rotation is valid
        rotation = u @ np.diag((1.0, 1.0, -1.0)) @ vt
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = matrix[:3, 3]
    return pose


def rigid_inverse(pose: np.ndarray) -> np.ndarray:
    """The inverse of a rigid transform."""
    inverse = np.eye(4)
    inverse[:3, :3] = pose[:3, :3].T
    inverse[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return inverse
