# SPDX-License-Identifier: Apache-2.0
"""Determines which nodes of a glTF document are movable, and which nodes belong to each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from deltalux.errors import OptionError
from deltalux.io.diagnostics import ALL_NAMES, Notes, UniqueNames
from deltalux.scene.naming import candidates, matches

from .nodes import PlacedNode

PREFIX = "MOVE_"


@dataclass(frozen=True)
class Ownership:
    """`owner[k]`: position of the movable node that node k belongs to (itself, if it is one), or None.

    `mesh_name[k]`: the name of the mesh made from node k, for movable roots and static nodes.
    """

    owner: list[int | None]
    mesh_name: dict[int, str]


def assign_owners(nodes: list[PlacedNode], names: Sequence[str], notes: Notes) -> Ownership:
    """Determine the movables: the nodes in `names`, those named MOVE_..., and those with extras.movable.

    A name selects every node with that name; if there are several, "name#1" selects only the first. If no
    node has that name, ``*``, ``?`` and ``[...]`` in it select several nodes, of which those with content
    are used. Everything below a movable belongs to it. Raises OptionError for a name that no node has, or
    whose nodes have no content.
    """
    content = _with_content(nodes)
    wanted = _wanted(nodes, names, content, notes)
    owner: list[int | None] = []
    for k, node in enumerate(nodes):
        above = owner[node.parent] if node.parent >= 0 else None
        if above is not None and k in wanted and node.name != nodes[above].name:
            notes.add(
                "movable objects inside another one move with it", f'"{node.label}" in "{nodes[above].label}"'
            )
        owner.append(above if above is not None else k if k in wanted else None)
    return Ownership(owner, _mesh_names(nodes, owner))


def _with_content(nodes: list[PlacedNode]) -> list[bool]:
    """Whether there is a mesh or a light at or below each node."""
    content = [n.source.mesh is not None or "KHR_lights_punctual" in n.source.extensions for n in nodes]
    for k in range(len(nodes) - 1, -1, -1):
        if content[k] and nodes[k].parent >= 0:
            content[nodes[k].parent] = True
    return content


def _wanted(nodes: list[PlacedNode], names: Sequence[str], content: list[bool], notes: Notes) -> set[int]:
    wanted: set[int] = set()
    for k, node in enumerate(nodes):
        if node.name.startswith(PREFIX) or node.source.extras.get("movable"):
            if content[k]:
                wanted.add(k)
            else:
                notes.add("nodes marked as movable have nothing to move", node.label)
    for name in names:
        bearing = _bearing(nodes, name)
        moving = [k for k in bearing if content[k]]
        if not moving:
            raise OptionError(
                _unknown(name, bool(bearing), [n.label for k, n in enumerate(nodes) if content[k]])
            )
        wanted.update(moving)
    return wanted


def _bearing(nodes: list[PlacedNode], word: str) -> list[int]:
    """Positions of the nodes of that name, else of the one of that label, else of those that match it."""
    alone = [node.label if node.label != node.name else f"{node.name}#1" for node in nodes]
    return (
        [k for k, node in enumerate(nodes) if node.name == word]
        or [k for k, label in enumerate(alone) if label == word]
        or [k for k, node in enumerate(nodes) if matches(word, node.name) or matches(word, node.label)]
    )


def _unknown(word: str, exists: bool, movable: list[str]) -> str:
    found = "a node with neither mesh nor light at or below it" if exists else "no node of that name"
    names = candidates(word, movable) or "none, nothing can move"
    return f'movable "{word}": found {found}, expected one of: {names}; {ALL_NAMES}'


def _mesh_names(nodes: list[PlacedNode], owner: list[int | None]) -> dict[int, str]:
    # Labels of nodes with a mesh do not depend on movables; a movable node without a mesh of its own gets its
    # plain name if that is free (its mesh child may have had it).
    names: dict[int, str] = {}
    unique = UniqueNames()
    roots = [k for k, node in enumerate(nodes) if owner[k] in (None, k) and node.source.mesh is not None]
    for k in roots:
        names[k] = unique.take(nodes[k].label)
    for k, node in enumerate(nodes):
        if owner[k] == k and k not in names:
            names[k] = unique.take(node.name)
    return names
