# SPDX-License-Identifier: Apache-2.0
"""Deltalux: incremental global illumination, equal to a full bake to the last bit."""

from . import scenes
from .errors import Cancelled, Error, FormatError, OptionError, SceneError
from .io import load
from .scene import Camera, Material, Mesh, Node, PointLight, Scene, SpotLight, SunLight

__all__ = [
    "Camera",
    "Cancelled",
    "Error",
    "FormatError",
    "Material",
    "Mesh",
    "Node",
    "OptionError",
    "PointLight",
    "Scene",
    "SceneError",
    "SpotLight",
    "SunLight",
    "load",
    "scenes",
]
