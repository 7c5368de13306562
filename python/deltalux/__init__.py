# SPDX-License-Identifier: Apache-2.0
"""Deltalux: incremental global illumination, equal to baking again to the last bit."""

from . import estimate, model, scenes
from .client import connect
from .cluster import ClusterSession
from .errors import Cancelled, Error, FormatError, OptionError, SceneError
from .io import load
from .planning import Plan, plan
from .results import Estimate, Frame, Result
from .samples import Samples
from .scene import (
    Camera,
    DiffuseSurface,
    Material,
    Mesh,
    Node,
    PaneSurface,
    PointLight,
    Scene,
    SpotLight,
    SunLight,
)
from .segments import Segments, trace, uniform_lines
from .server import serve, view
from .session import Session
from .version import __version__

__all__ = [
    "Camera",
    "Cancelled",
    "ClusterSession",
    "DiffuseSurface",
    "Error",
    "Estimate",
    "FormatError",
    "Frame",
    "Material",
    "Mesh",
    "Node",
    "OptionError",
    "PaneSurface",
    "Plan",
    "PointLight",
    "Result",
    "Samples",
    "Scene",
    "SceneError",
    "Segments",
    "Session",
    "SpotLight",
    "SunLight",
    "__version__",
    "connect",
    "estimate",
    "load",
    "model",
    "plan",
    "scenes",
    "serve",
    "trace",
    "uniform_lines",
    "view",
]
