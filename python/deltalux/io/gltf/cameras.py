# SPDX-License-Identifier: Apache-2.0
"""Cameras of a glTF document, each with its node's world pose."""

from __future__ import annotations

import math
from typing import Any

from deltalux.io.diagnostics import Notes, UniqueNames, element
from deltalux.scene import Camera
from deltalux.units import FARTHEST

from .document import Document
from .nodes import PlacedNode, rigid_part


def read_cameras(document: Document, nodes: list[PlacedNode]) -> list[Camera]:
    """The cameras of the scene; those that cannot show anything are dropped with a warning."""
    names = UniqueNames()
    cameras = []
    for node in nodes:
        if node.source.camera is None:
            continue
        source = element(document.gltf.cameras, node.source.camera, f"{node.place}.camera")
        view = _view(source, node.label, document.notes)
        if view is not None:
            cameras.append(Camera(names.take(node.name), rigid_part(node.world), **view))
    return cameras


def _view(source: Any, label: str, notes: Notes) -> dict[str, Any] | None:
    """Fields of a Camera besides name and pose; None for one that cannot show anything."""
    if source.perspective is not None:
        lens = source.perspective
        if not 0 < lens.yfov < math.pi:
            notes.add("cameras with a field of view outside 0 to pi are left out", label)
            return None
        near = lens.znear if (lens.znear or 0) > 0 else Camera.near
        return {
            "vertical_fov": lens.yfov,
            "aspect": lens.aspectRatio if (lens.aspectRatio or 0) > 0 else None,
            "near": near,
            "far": lens.zfar if (lens.zfar or 0) > near else None,
        }
    box = source.orthographic
    if box is None or box.xmag == 0 or not 0 < abs(box.ymag) <= FARTHEST / 2:
        notes.add("cameras without a perspective or an orthographic view are left out", label)
        return None
    near = max(box.znear, 0.0)
    return {
        "height": 2 * abs(box.ymag),
        "aspect": abs(box.xmag / box.ymag),
        "near": near,
        "far": box.zfar if box.zfar > near else None,
    }
