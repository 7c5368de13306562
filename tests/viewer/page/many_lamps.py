# SPDX-License-Identifier: Apache-2.0
"""A room of many lamps, by rooms and by numbers, as lighting plans name them."""

from __future__ import annotations

import deltalux as dl
import numpy as np
from rooms import box, translation

IN_ROOMS = [f"{room} / lamp {i}" for room in ("hall", "stairs") for i in range(1, 4)]
NAMES = [*IN_ROOMS, "spot 1", "spot 2", "sign"]


def make_session() -> dl.Session:
    """A session of the room, without light: a floor and its lamps."""
    vertices, triangles = box((4.0, 2.5, 4.0), (0.0, 1.25, 0.0), inward=True)
    is_front = (vertices[triangles][:, :, 2] > 1.99).all(axis=1)
    meshes = [dl.Mesh("room", vertices, triangles[~is_front], "plaster")]
    materials = [dl.Material("plaster", (0.7, 0.7, 0.7))]
    for i, name in enumerate(NAMES):
        place = (-1.5 + 1.5 * (i % 3), 2.4, -1.5 + 1.5 * (i // 3))
        meshes.append(dl.Mesh(f"mesh of {name}", *box((0.3, 0.02, 0.3), place), name))
        materials.append(dl.Material(name, (0, 0, 0), emission=(500, 500, 500), group=name))
    camera = dl.scene.Camera("front", translation(0.0, 1.2, 5.0), np.radians(40))
    scene = dl.Scene(meshes, materials, unit="lux", cameras=[camera])
    samples = dl.Samples.on_vertices(scene, spacing=0.5, radius=0.2)
    return dl.Session(scene, samples, paths=20_000, gather="off", threads=2)
