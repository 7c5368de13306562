# SPDX-License-Identifier: Apache-2.0
"""The input file's node hierarchy, with the movables at their present poses."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from deltalux.scene import Node, Scene


def world_matrices(nodes: tuple[Node, ...], matrices: list[np.ndarray] | None = None) -> list[np.ndarray]:
    """4x4 invertible local-to-world matrix of each node.

    `matrices` transform from each node to its parent, see `moved_matrices`; None = as loaded.
    """
    matrices = [_invertible(node.matrix) for node in nodes] if matrices is None else matrices
    worlds = [np.eye(4)] * len(nodes)
    for index in _parents_first(nodes):
        parent = nodes[index].parent
        worlds[index] = (worlds[parent] if parent >= 0 else np.eye(4)) @ matrices[index]
    return worlds


def _invertible(matrix: np.ndarray) -> np.ndarray:
    """The matrix, with scales of zero replaced by one.

    The geometry below a node that flattens it is written flat, so that the node need not flatten it.
    """
    u, scale, vt = np.linalg.svd(matrix[:3, :3])
    flat = scale <= 1e-12 * scale[0]
    if not flat.any():
        return matrix
    result = matrix.copy()
    result[:3, :3] = (u * np.where(flat, 1.0, scale)) @ vt
    return result


def moved_matrices(scene: Scene, poses: Mapping[int, np.ndarray | None]) -> list[np.ndarray]:
    """4x4 matrix of each node relative to its parent, with movables at `poses` (by mesh index).

    Only the topmost node of a moved object changes: its descendants follow it.
    """
    nodes = scene.nodes
    worlds = world_matrices(nodes)
    index_of = {mesh.name: i for i, mesh in enumerate(scene.meshes)}
    moves = [np.eye(4)] * len(nodes)
    matrices = [_invertible(node.matrix) for node in nodes]
    for index in _parents_first(nodes):
        node = nodes[index]
        parent_move = moves[node.parent] if node.parent >= 0 else np.eye(4)
        names = [*(name for name, _, _ in node.parts), node.name]
        mesh = next((index_of[name] for name in names if name in index_of), None)
        # An empty node or a lamp moves with its parent.
        moves[index] = parent_move if mesh is None else move_since_load(scene, mesh, poses)
        if not np.array_equal(moves[index], parent_move):
            parent_world = worlds[node.parent] if node.parent >= 0 else np.eye(4)
            matrices[index] = np.linalg.inv(parent_move @ parent_world) @ moves[index] @ worlds[index]
            matrices[index][3] = (0, 0, 0, 1)
    return matrices


def move_since_load(scene: Scene, mesh: int, poses: Mapping[int, np.ndarray | None]) -> np.ndarray:
    """The motion of a mesh since it was loaded, world to world."""
    loaded, now = scene.meshes[mesh].pose, poses.get(mesh)
    if now is None or np.array_equal(now, loaded):
        return np.eye(4)
    return now @ np.linalg.inv(loaded)


def _parents_first(nodes: tuple[Node, ...]) -> list[int]:
    children: dict[int, list[int]] = {}
    for index, node in enumerate(nodes):
        children.setdefault(node.parent, []).append(index)
    order = list(children.get(-1, ()))
    for index in order:  # the list grows during the loop
        order.extend(children.get(index, ()))
    return order
