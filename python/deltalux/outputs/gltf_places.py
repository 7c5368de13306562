# SPDX-License-Identifier: Apache-2.0
"""Cameras and lamps of a .glb, on the nodes of the scene's tree or on additional ones."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pygltflib as gl

from deltalux.scene import Camera, Light, Scene
from deltalux.units import LUX

from .camera import look_at

PUNCTUAL = "KHR_lights_punctual"
# metres, and again as much per metre from the world's origin
SAME_PLACE = 1e-6
LUMENS_PER_WATT = 683.0  # the conversion that viewers assume for radiometric light


class Places:
    """Adds cameras and lamps to `document`.

    A camera or lamp is put on the node with its name if that has the same pose, as in the file that was
    read; otherwise it gets a node of its own. `worlds` are the present world matrices of the document's
    first nodes.
    """

    def __init__(self, document: gl.GLTF2, worlds: list[np.ndarray]) -> None:
        self._document = document
        self._nodes: dict[str, list[tuple[gl.Node, np.ndarray]]] = {}
        for node, world in zip(document.nodes, worlds, strict=False):
            self._nodes.setdefault(node.name, []).append((node, world))

    def add_cameras(self, scene: Scene) -> None:
        """Add the scene's cameras.

        An orthographic view without a far plane ends behind the scene, because glTF requires a far plane.
        """
        for camera in scene.cameras:
            pose = np.asarray(camera.pose, dtype=np.float64)
            self._node(camera.name, pose, "camera", _same_pose).camera = len(self._document.cameras)
            self._document.cameras.append(_camera_definition(camera, scene))

    def add_lights(self, scene: Scene, moved: Callable[[str], np.ndarray | None]) -> None:
        """Add the lights that glTF supports at their present places.

        `moved` returns a movable's present local-to-world matrix by its name; None = removed.
        """
        factor = 1.0 if scene.unit == LUX else LUMENS_PER_WATT
        definitions: list[dict[str, Any]] = []
        for light in scene.lights:
            own = light.gltf()
            if own is None:
                continue
            at = _light_matrix(light)
            if light.attached_to is not None:
                pose = moved(light.attached_to)
                if pose is None:
                    continue
                at = pose @ at
            node = self._node(light.name, at, "extensions", partial(_same_light, light))
            node.extensions = {PUNCTUAL: {"light": len(definitions)}}
            definitions.append(_light_definition(light, own, factor))
        if definitions:
            self._document.extensions[PUNCTUAL] = {"lights": definitions}
            self._document.extensionsUsed.append(PUNCTUAL)

    def _node(
        self, name: str, matrix: np.ndarray, slot: str, same: Callable[[np.ndarray, np.ndarray], bool]
    ) -> gl.Node:
        """The node for an object at `matrix`, whose `slot` must be free."""
        for node, world in self._nodes.get(name, ()):
            if getattr(node, slot) in (None, {}) and same(world, matrix):
                return node
        added = gl.Node(name=name, matrix=matrix.T.ravel().tolist(), children=[])
        self._document.nodes.append(added)
        self._document.scenes[0].nodes.append(len(self._document.nodes) - 1)
        return added


def _same_pose(world: np.ndarray, pose: np.ndarray) -> bool:
    return bool(np.allclose(world, pose, rtol=0, atol=SAME_PLACE * (1 + np.abs(pose).max())))


def _same_light(light: Light, world: np.ndarray, at: np.ndarray) -> bool:
    """Whether the light shines equally from both: scale and rotation about its axis do not matter."""
    near = SAME_PLACE * (1 + np.abs(at[:3, 3]).max())
    placed = light.place is None or np.allclose(world[:3, 3], at[:3, 3], rtol=0, atol=near)
    along = world[:3, 2] / np.linalg.norm(world[:3, 2])
    return bool(placed and (light.axis is None or np.allclose(along, at[:3, 2], atol=SAME_PLACE)))


def _camera_definition(camera: Camera, scene: Scene) -> gl.Camera:
    if camera.height is None:
        lens = gl.Perspective(
            yfov=float(camera.vertical_fov), aspectRatio=camera.aspect, znear=camera.near, zfar=camera.far
        )
        return gl.Camera(name=camera.name, type="perspective", perspective=lens)
    ymag, far = camera.height / 2, _far_end(camera, scene)
    box = gl.Orthographic(xmag=ymag * (camera.aspect or 1.0), ymag=ymag, znear=camera.near, zfar=far)
    return gl.Camera(name=camera.name, type="orthographic", orthographic=box)


def _far_end(camera: Camera, scene: Scene) -> float:
    if camera.far is not None:
        return camera.far
    low, high = scene.bounds
    reach = float(np.linalg.norm(high - low) + np.linalg.norm(np.asarray(camera.pose)[:3, 3] - low))
    return camera.near + reach + 1.0


def _light_matrix(light: Light) -> np.ndarray:
    """Local-to-world matrix of a light that shines along local -Z."""
    towards = np.array((0.0, 0.0, -1.0)) if light.axis is None else light.axis
    matrix = look_at(np.zeros(3), towards)
    if light.place is not None:
        matrix[:3, 3] = light.place
    return matrix


def _light_definition(light: Light, own: dict[str, Any], factor: float) -> dict[str, Any]:
    """The light in KHR_lights_punctual: candela or lux, `factor` times its own intensity.

    `own`: the properties of its kind there.
    """
    power = factor * light.strength
    brightest = float(power.max())
    made: dict[str, Any] = {"name": light.name, "type": own["type"], "intensity": brightest}
    if brightest > 0:
        made["color"] = (power / brightest).tolist()
    return made | own
