# SPDX-License-Identifier: Apache-2.0
"""Spatial indices over discs that count their work per ray: study code in NumPy, slow and plain."""

from .counting import RayCosts
from .grid import DiscGrid
from .trees import DiscTree, kd_tree, octree

__all__ = ["DiscGrid", "DiscTree", "RayCosts", "kd_tree", "octree"]
