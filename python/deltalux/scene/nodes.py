# SPDX-License-Identifier: Apache-2.0
"""Nodes of the file that a scene was read from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Node:
    """One node of the input file's hierarchy, kept so that outputs can restore it.

    `parent` is an index into `Scene.nodes`, -1 for a root; parents precede their children. `matrix` is the
    transform to the parent, with scale and shear. `parts` lists (mesh name, first triangle, triangle count)
    in the scene. A movable's first node always has a part, possibly an empty one. inverse(mesh's pose as
    loaded) @ (the node's world matrix as loaded) transforms from the node's local space to the mesh's.
    `lights` names the scene's point, spot and sun lights on it; `label` selects this node alone if other
    nodes have the same name, None = the name suffices.
    """

    name: str
    parent: int
    matrix: np.ndarray
    parts: tuple[tuple[str, int, int], ...] = ()
    lights: tuple[str, ...] = ()
    label: str | None = None
