# SPDX-License-Identifier: Apache-2.0
"""EXT_mesh_gpu_instancing: expands a node's instances to child nodes."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from deltalux.io.diagnostics import malformed
from deltalux.io.scene_size import require_memory_for_nodes

from .accessors import Accessors
from .nodes import PlacedNode, finite_product, trs_matrix, unique_labels

NAME = "EXT_mesh_gpu_instancing"
_KINDS = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
_STILL = {"TRANSLATION": (0.0, 0.0, 0.0), "ROTATION": (0.0, 0.0, 0.0, 1.0), "SCALE": (1.0, 1.0, 1.0)}


def expand_instances(nodes: list[PlacedNode], accessors: Accessors) -> list[PlacedNode]:
    """The nodes, with the mesh of an instanced node moved to one child per instance, of the same name.

    Raises FormatError for attributes that do not fit together, SceneError if there is not enough memory for
    so many nodes.
    """
    counts = [_count(node, accessors) for node in nodes]
    if all(count is None for count in counts):
        return nodes
    require_memory_for_nodes(len(nodes) + sum(count or 0 for count in counts))
    expanded: list[PlacedNode] = []
    position: list[int] = []
    for node, count in zip(nodes, counts, strict=True):
        position.append(len(expanded))
        own = replace(node, parent=position[node.parent] if node.parent >= 0 else -1)
        if count is None:
            expanded.append(own)
            continue
        source = copy.copy(node.source)
        source.mesh = source.skin = None
        expanded.append(replace(own, source=source))
        for matrix in _matrices(node, count, accessors):
            instance = copy.copy(node.source)
            instance.camera, instance.extensions, instance.extras = None, {}, {}
            world = finite_product(node.world, matrix, node.place)
            expanded.append(replace(node, parent=position[-1], source=instance, local=matrix, world=world))
    labels = unique_labels([n.name for n in expanded], [n.source.mesh is not None for n in expanded])
    return [replace(node, label=label) for node, label in zip(expanded, labels, strict=True)]


def _attributes(node: PlacedNode) -> dict[str, int]:
    found = node.source.extensions[NAME].get("attributes", {})
    return {name: found[name] for name in _KINDS if name in found}


def _count(node: PlacedNode, accessors: Accessors) -> int | None:
    """Number of instances of a node; None if it is not instanced."""
    if NAME not in node.source.extensions or node.source.mesh is None:
        return None
    place = f"{node.place}.extensions.{NAME}.attributes"
    counts = {name: accessors.count(index, f"{place}.{name}") for name, index in _attributes(node).items()}
    if len(set(counts.values())) != 1:
        raise malformed(place, counts or "none of its attributes", f"the same count of {', '.join(_KINDS)}")
    return next(iter(counts.values()))


def _matrices(node: PlacedNode, count: int, accessors: Accessors) -> Iterator[np.ndarray]:
    """4x4 matrix of each instance, to the node's local space."""
    place = f"{node.place}.extensions.{NAME}.attributes"
    given = _attributes(node)
    values = {
        name: accessors.vectors(given[name], f"{place}.{name}", kind)
        if name in given
        else np.tile(_STILL[name], (count, 1))
        for name, kind in _KINDS.items()
    }
    for i in range(count):
        move, turn, scale = (values[name][i] for name in _KINDS)
        yield trs_matrix(move, turn, scale, f"{place}: instance {i}")
