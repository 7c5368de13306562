# SPDX-License-Identifier: Apache-2.0
"""Cameras and lamps of a .glb, each as a node of its own at its place in the world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pygltflib as gl

from deltalux.cameras import Camera
from deltalux.scene import Light, PointLight, Scene, SpotLight, SunLight
from deltalux.units import LUX

from .camera import look_at

PUNCTUAL = "KHR_lights_punctual"
LUMENS_PER_WATT = 683.0  # what viewers take radiometric light for


def add_cameras(document: gl.GLTF2, scene: Scene) -> None:
    """Add the scene's cameras.

    An orthographic view that has no end of its own ends behind the scene, as glTF wants it to end somewhere.
    """
    for camera in scene.cameras:
        made = gl.Camera(name=camera.name, type="perspective" if camera.height is None else "orthographic")
        if camera.height is None:
            made.perspective = gl.Perspective(
                yfov=float(camera.vertical_fov), aspectRatio=camera.aspect, znear=camera.near, zfar=camera.far
            )
        else:
            ymag = camera.height / 2
            made.orthographic = gl.Orthographic(
                xmag=ymag * (camera.aspect or 1.0), ymag=ymag, znear=camera.near, zfar=_far_end(camera, scene)
            )
        document.cameras.append(made)
        number = len(document.cameras) - 1
        _add_node(document, camera.name, np.asarray(camera.pose, dtype=np.float64), camera=number)


def _far_end(camera: Camera, scene: Scene) -> float:
    if camera.far is not None:
        return camera.far
    low, high = scene.bounds
    reach = float(np.linalg.norm(high - low) + np.linalg.norm(np.asarray(camera.pose)[:3, 3] - low))
    return camera.near + reach + 1.0


def add_lights(document: gl.GLTF2, scene: Scene, moved: Callable[[str], np.ndarray | None]) -> None:
    """Add point, spot and sun lights where they are now.

    `moved` tells where a movable's own space is in the world, by the movable's name; None = nowhere.
    """
    factor = 1.0 if scene.unit == LUX else LUMENS_PER_WATT
    definitions: list[dict[str, Any]] = []
    for light in scene.lights:
        at = _light_matrix(light)
        if light.attached_to is not None:
            pose = moved(light.attached_to)
            if pose is None:
                continue
            at = pose @ at
        _add_node(document, light.name, at, extensions={PUNCTUAL: {"light": len(definitions)}})
        definitions.append(_light_definition(light, factor))
    if definitions:
        document.extensions[PUNCTUAL] = {"lights": definitions}
        document.extensionsUsed.append(PUNCTUAL)


def _add_node(document: gl.GLTF2, name: str, matrix: np.ndarray, **fields: Any) -> None:
    document.nodes.append(gl.Node(name=name, matrix=matrix.T.ravel().tolist(), children=[], **fields))
    document.scenes[0].nodes.append(len(document.nodes) - 1)


def _light_matrix(light: Light) -> np.ndarray:
    """To the world from a light's own space, where it shines along -Z."""
    towards = np.array((0.0, 0.0, -1.0) if isinstance(light, PointLight) else light.direction)
    matrix = look_at(np.zeros(3), towards)
    if not isinstance(light, SunLight):
        matrix[:3, 3] = light.position
    return matrix


def _light_definition(light: Light, factor: float) -> dict[str, Any]:
    """The light as KHR_lights_punctual has it: candela or lux, `factor` times its own intensity."""
    power = factor * np.asarray(light.irradiance if isinstance(light, SunLight) else light.intensity)
    brightest = float(power.max())
    kind = {PointLight: "point", SpotLight: "spot", SunLight: "directional"}[type(light)]
    made: dict[str, Any] = {"name": light.name, "type": kind, "intensity": brightest}
    if brightest > 0:
        made["color"] = (power / brightest).tolist()
    if isinstance(light, SpotLight):
        made["spot"] = {"innerConeAngle": light.inner_angle, "outerConeAngle": light.outer_angle}
    return made
