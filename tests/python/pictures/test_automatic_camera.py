# SPDX-License-Identifier: Apache-2.0
"""The automatic camera looks at what can move, from the free space that it stands in."""

from __future__ import annotations

import numpy as np
import pytest
from deltalux.mesh.surfaces import Surfaces
from deltalux.outputs.view import camera_rays
from deltalux.scene import Camera
from test_images import box, chosen, scene_of


def seen_place(camera: Camera, surfaces: Surfaces, place) -> tuple[np.ndarray, str]:
    """Where a place lies in the picture, 0 at its middle, 1 at its edges; and the mesh that is seen there."""
    local = (np.asarray(place, float) - camera.pose[:3, 3]) @ camera.pose[:3, :3]
    reach = np.tan(camera.vertical_fov / 2) * np.array([1.6, 1])
    ray = np.asarray(place, float) - camera.pose[:3, 3]
    hit = surfaces.intersect(camera.pose[None, :3, 3], ray[None] / np.linalg.norm(ray))
    mesh = surfaces.display.triangle_mesh[hit.triangle[0]]
    return np.abs(local[:2] / -local[2] / reach), surfaces.scene.meshes[mesh].name


@pytest.mark.parametrize(
    ("corner", "extent"),
    [((0.4, 0.3), (14, 6, 9)), ((13.2, 8.3), (14, 6, 9)), ((7, 4.5), (14, 6, 9)), ((21, 17), (70, 9, 50))],
)
def test_what_can_move_is_seen_whole_wherever_it_stands(corner, extent):
    low = np.array([corner[0], 0, corner[1]])
    trolley = box("trolley", low, low + np.array((0.5, 0.8, 0.4)), movable=True)
    hall = box("hall", (0, 0, 0), extent, inward=True)
    screen = box("screen", (5, 0, 3), (5.2, 2.5, 7))
    camera, surfaces, _ = chosen(scene_of(hall, screen, trolley))
    place, mesh = seen_place(camera, surfaces, low + np.array((0.25, 0.4, 0.2)))
    assert (place < 0.8).all()
    assert mesh == "trolley"
    hits = surfaces.intersect(*camera_rays(camera, (48, 30), *pixel_centres(48, 30)))
    share = (surfaces.display.triangle_mesh[hits.triangle] == 2).mean()
    assert 0.01 < share < 0.3


def pixel_centres(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    y, x = np.divmod(np.arange(width * height), width)
    return x + 0.5, y + 0.5


def test_what_can_move_is_not_looked_for_behind_walls():
    """A house that is lit on more of its outside than of its inside, with a chair in it."""
    outside, roof = box("outside", (0, 0, 0), (12, 4, 8)), box("roof", (0, 4, 0), (12, 5, 2))
    inside = box("inside", (0.3, 0.1, 0.3), (11.7, 3.7, 7.7), inward=True, skip=2)
    vase = box("vase", (2, 0.1, 2), (2.5, 1, 2.5))
    chair = box("chair", (9, 0.1, 4.8), (9.6, 1, 5.4), movable=True)
    camera, surfaces, _ = chosen(scene_of(outside, chair, vase, roof, inside))
    eye = camera.pose[:3, 3]
    assert (eye > (0.3, 0.1, 0.3)).all() and (eye < (11.7, 3.7, 7.7)).all()
    assert seen_place(camera, surfaces, (9.3, 0.55, 5.1))[1] == "chair"
