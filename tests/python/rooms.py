# SPDX-License-Identifier: Apache-2.0
"""A small closed room with everything that can be edited, for tests of sessions."""

from __future__ import annotations

from dataclasses import replace

import deltalux as dl
import numpy as np
from deltalux.scene.look import Look, Texture


def box(size, centre=(0.0, 0.0, 0.0), inward=False):
    """Vertices and triangles of a box of `size` metres about `centre`."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float) / 2
    vertices = corners * size + np.asarray(centre)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    outward = (np.cross(b - a, c - a) * (a + b + c)).sum(axis=1) > 0
    wrong = outward == inward
    triangles[wrong] = triangles[wrong][:, [0, 2, 1]]
    return vertices, triangles


def translation(*offset):
    pose = np.eye(4)
    pose[:3, 3] = offset
    return pose


def turn(angle):
    """Rotation about +Y, radians."""
    pose = np.eye(4)
    pose[0, 0] = pose[2, 2] = np.cos(angle)
    pose[0, 2], pose[2, 0] = np.sin(angle), -np.sin(angle)
    return pose


def room(groups: int = 2) -> dl.Scene:
    """A closed room with a ceiling lamp, a movable block, a movable lamp with a spot, and a bulb."""
    lamp_corners = np.array([[-0.4, 1.99, -0.4], [0.4, 1.99, -0.4], [0.4, 1.99, 0.4], [-0.4, 1.99, 0.4]])
    bulbs = [
        dl.PointLight(f"bulb{i}", (1.5 - 0.2 * i, 1.0, 1.2), intensity=(1, 2, 1), group=f"bulb{i}")
        for i in range(groups - 2)
    ]
    return dl.Scene(
        [
            dl.Mesh("walls", *box((4, 2, 3), (0, 1, 0), inward=True), "wall"),
            dl.Mesh("ceiling lamp", lamp_corners, [(0, 1, 2), (0, 2, 3)], "ceiling glow"),
            dl.Mesh("block", *box((0.5, 0.6, 0.4)), "paint", pose=translation(0.7, 0.31, 0.4), movable=True),
            dl.Mesh(
                "lamp",
                *box((0.2, 0.2, 0.2)),
                material=("glow", "paint"),
                material_index=np.arange(12) // 6,
                pose=translation(-1.0, 0.6, -0.5),
                movable=True,
            ),
        ],
        [
            dl.Material("wall", (0.6, 0.5, 0.4)),
            dl.Material("paint", (0.3, 0.5, 0.7)),
            dl.Material("ceiling glow", (0, 0, 0), emission=(5, 5, 5), group="ceiling", two_sided=True),
            dl.Material("glow", (0.1, 0.1, 0.1), emission=(3, 2, 1), group="desk"),
            dl.Material("own glow", (0.2, 0.2, 0.2), emission=(4, 3, 5)),  # of no mesh as yet
        ],
        [
            dl.SpotLight(
                "spot", (0, 0, 0.2), (0, -1, 0.5), intensity=(2, 2, 2), outer_angle=0.7,
                group="desk", attached_to="lamp",
            ),
            *bulbs,
        ],
    )  # fmt: skip


def samples_in(scene: dl.Scene) -> dl.Samples:
    """Some on the walls, the block and the lamp; one in free air."""
    parts = [dl.Samples.on_vertices(scene, spacing=0.6, radius=0.15)]
    parts.append(dl.Samples([(0.2, 0.8, 0.1)], [(0, 1, 0)], radius=0.2))
    return dl.Samples.concatenate(parts)


def with_texture(scene: dl.Scene) -> dl.Scene:
    """The scene with a picture on its first mesh."""
    from builders.gltf import png  # here, since programs beside the suite import rooms alone

    image = Texture(png(np.full((2, 2, 3), 99, np.uint8)), (0.5, 0.5, 0.5), offset=(0.5, 0.5))
    materials = [replace(scene.materials[0], look=Look(image, None, "MASK")), *scene.materials[1:]]
    coordinates = np.random.default_rng(1).uniform(-2, 2, (len(scene.meshes[0].triangles), 3, 2))
    meshes = [replace(scene.meshes[0], coordinates=coordinates), *scene.meshes[1:]]
    return dl.scene.replace_scene(scene, meshes=meshes, materials=materials)
