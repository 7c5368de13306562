# SPDX-License-Identifier: Apache-2.0
"""Scenes: what a user writes or a file holds, and how the core gets it."""

from .adding import with_lamp, with_sun
from .cameras import Camera
from .lights import Light, PointLight, SpotLight, SunLight
from .nodes import Node
from .scene import Material, Mesh, Scene, make_movable, replace_scene, rigid_pose
from .surfaces import DiffuseSurface, PaneSurface, Surface

__all__ = [
    "Camera",
    "DiffuseSurface",
    "Light",
    "Material",
    "Mesh",
    "Node",
    "PaneSurface",
    "PointLight",
    "Scene",
    "SpotLight",
    "SunLight",
    "Surface",
    "make_movable",
    "replace_scene",
    "rigid_pose",
    "with_lamp",
    "with_sun",
]
