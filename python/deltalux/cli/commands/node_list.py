# SPDX-License-Identifier: Apache-2.0
"""The tree of a scene's nodes as a list: contents of each node, and the movable it belongs to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

import deltalux as dl
from deltalux.quantities import significant
from deltalux.scene import Node
from deltalux.scene.outward_light import inner_shares
from deltalux.units import LUX, photopic
from deltalux.vectors import triangle_areas


@dataclass
class _Content:
    """Contents of a node, or of its subtree: bounds in metres, triangles, names of lights, their power."""

    low: np.ndarray = field(default_factory=lambda: np.full(3, np.inf))
    high: np.ndarray = field(default_factory=lambda: np.full(3, -np.inf))
    triangles: int = 0
    lights: list[dict[str, Any]] = field(default_factory=list)

    def include(self, other: _Content) -> None:
        """Add the contents of a child."""
        self.low, self.high = np.minimum(self.low, other.low), np.maximum(self.high, other.high)
        self.triangles += other.triangles
        self.lights += other.lights


def node_facts(scene: dl.Scene) -> list[dict[str, Any]]:
    """Facts of each node, parents first; for a scene without nodes, of its meshes and lamps.

    Returns
    -------
    list of dict with `name` (what `--movable` calls that node alone), `parent` (index into this list, -1 for
    a root), `size` (metres along X, Y and Z, None where there is no surface), `triangles`, `lights` (name,
    and power in the unit of `Scene.info`, None for suns), each with what is below the node, and `moves_with`:
    the movable that it is or belongs to, or None.
    """
    nodes = scene.nodes or _plain_nodes(scene)
    content = _contents(scene, nodes)
    names = _names(nodes)
    movable = set(scene.movable)
    attached = {light.name: light.attached_to for light in scene.lights}
    owners: list[str | None] = []
    for node in nodes:
        meshes = [*(part[0] for part in node.parts), *(attached[name] for name in node.lights)]
        above = owners[node.parent] if node.parent >= 0 else None
        owners.append(next((name for name in meshes if name in movable), above))
    return [
        {
            "name": name,
            "parent": node.parent,
            "size": (own.high - own.low).tolist() if own.triangles else None,
            "triangles": own.triangles,
            "lights": own.lights,
            "moves_with": owner,
        }
        for name, node, own, owner in zip(names, nodes, content, owners, strict=True)
    ]


def _plain_nodes(scene: dl.Scene) -> list[Node]:
    meshes = [Node(m.name, -1, m.pose, ((m.name, 0, len(m.triangles)),)) for m in scene.meshes]
    return [*meshes, *(Node(light.name, -1, np.eye(4), (), (light.name,)) for light in scene.lights)]


def _contents(scene: dl.Scene, nodes: Sequence[Node]) -> list[_Content]:
    """Contents of each node's subtree."""
    meshes = {mesh.name: mesh for mesh in scene.meshes}
    corners = {name: mesh.world_vertices for name, mesh in meshes.items()}
    luminous = {m.name: m for m in scene.materials if m.emissive}
    lights = {light.name: light for light in scene.lights}
    found = []
    for node in nodes:
        own = _Content()
        for name, first, count in node.parts:
            mesh, these = meshes[name], slice(first, first + count)
            points = corners[name][mesh.triangles[these]]
            if count:
                own.include(_Content(points.min(axis=(0, 1)), points.max(axis=(0, 1)), count))
            areas = triangle_areas(points)
            inner: np.ndarray | None = None
            for i, material in enumerate(mesh.material):
                lit = luminous.get(material)
                uses = mesh.material_index[these] == i
                area = float(areas[uses].sum())
                if lit is not None and area > 0:
                    if lit.two_sided:
                        inner = inner_shares(mesh.vertices, mesh.triangles)[these] if inner is None else inner
                        area += float((areas * inner)[uses].sum())
                    power = np.pi * area * lit.emission
                    own.lights.append({"name": f"{name} ({material})", "power": float(photopic(power))})
        own.lights += [{"name": name, "power": lights[name].power()} for name in node.lights]
        found.append(own)
    for node, own in zip(reversed(nodes), reversed(found), strict=True):
        if node.parent >= 0:
            found[node.parent].include(own)
    return found


def _names(nodes: Sequence[Node]) -> list[str]:
    """The name by which `--movable` selects each node alone."""
    bearers = Counter(node.name for node in nodes)
    labels = [node.name if node.label is None else node.label for node in nodes]
    return [
        f"{label}#1" if label == node.name and bearers[node.name] > 1 else label
        for label, node in zip(labels, nodes, strict=True)
    ]


def node_table(facts: Sequence[Mapping[str, Any]], unit: str) -> Table:
    """`node_facts` as a table whose names are indented like the tree."""
    table = Table(title="nodes", title_justify="left")
    table.add_column("node", overflow="fold")  # never truncated: users type it
    table.add_column("size (m)", justify="right")
    table.add_column("triangles", justify="right")
    table.add_column(f"lights ({'lm' if unit == LUX else 'W'})", justify="right")
    table.add_column("moves")
    depths: list[int] = []
    for node in facts:
        parent, owner = node["parent"], node["moves_with"]
        depths.append(depths[parent] + 1 if parent >= 0 else 0)
        inherited = parent >= 0 and facts[parent]["moves_with"] == owner
        table.add_row(
            Text("  " * depths[-1] + node["name"]),
            "–" if node["size"] is None else " × ".join(significant(s, 3) for s in node["size"]),
            f"{node['triangles']:,}",
            _lights([light["power"] for light in node["lights"]]),
            "" if owner is None else "with it" if inherited else "yes",
        )
    table.caption = (
        "--movable takes a name, or a pattern such as 'chair*'; all figures are with what is below"
    )
    table.caption_justify = "left"
    return table


def _lights(powers: Sequence[float | None]) -> str:
    """Number of lights, and the sum of the bounded powers."""
    if not powers:
        return ""
    bounded = [power for power in powers if power is not None]
    total = significant(sum(bounded)) if bounded else "unbounded"
    return total if len(powers) == 1 else f"{len(powers)}: {total}"
