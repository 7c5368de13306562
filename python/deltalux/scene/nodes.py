# SPDX-License-Identifier: Apache-2.0
"""Nodes of the file that a scene was read from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Node:
    """One node of the input file's hierarchy, kept so that outputs can restore it.

    `parent` is an index into `Scene.nodes`, -1 for a root; parents come first. `matrix` is the transform to
    the parent, scale and shear included. `parts` lists (mesh name, first triangle, triangle count) in the
    scene. A movable's first node always has a part, if an empty one. inverse(mesh's pose as loaded) @ (the
    node's world matrix as loaded) takes a node's own space to the mesh's local one. `lights` names the
    scene's point, spot and sun lights on it; `label` is what selects it alone where other nodes bear the same
    name, None = the name.
    """

    name: str
    parent: int
    matrix: np.ndarray
    parts: tuple[tuple[str, int, int], ...] = ()
    lights: tuple[str, ...] = ()
    label: str | None = None
