# SPDX-License-Identifier: Apache-2.0
"""Pictures of one scene by several methods: the whole view, and a close-up of its smallest surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from deltalux.mesh.surfaces import Surfaces
from deltalux.outputs.camera import automatic_camera, look_at, scene_camera
from deltalux.outputs.covered import shown_values
from deltalux.outputs.images import Picture, lit_picture, side_by_side
from deltalux.outputs.view import View, camera_rays
from deltalux.scene import Camera
from deltalux.studies import MethodStudy

ZOOM = 5  # magnification of the close-up
GRID = 20  # number of candidate windows along each side
COLUMNS = 2
GAP = 6  # pixels between rows


@dataclass(frozen=True, eq=False)
class Views:
    """Two cameras' views of a display mesh."""

    whole: View
    close_up: View

    @property
    def vertices(self) -> np.ndarray:
        """Indices of the vertices that pictures need: those of all triangles around a visible vertex."""
        triangles = self.whole.surfaces.display.triangles
        seen = np.concatenate([v.triangle[v.triangle >= 0] for v in (self.whole, self.close_up)])
        near = np.zeros(len(self.whole.surfaces.display.points), bool)
        near[triangles[seen].ravel()] = True
        return np.unique(triangles[near[triangles].any(axis=1)])


def make_views(study: MethodStudy, size: tuple[int, int]) -> Views:
    """A view through the scene's camera, and one from there of the place with most small surfaces."""
    surfaces = Surfaces(study.scene, study.display, threads=study.threads or 0)
    everything = np.ones(len(study.display.points))
    camera = scene_camera(study.scene) or automatic_camera(surfaces, everything, size[0] / size[1])
    whole = View(surfaces, camera, size)
    return Views(whole, View(surfaces, _close_up(whole, study.classes.number), size))


def _close_up(whole: View, classes: np.ndarray) -> Camera:
    """A camera at the same eye whose picture shows the window with most small surfaces."""
    width, height = whole.size
    smallness = np.square(classes / 3.0)  # small surfaces count, very small ones most
    shown = np.nan_to_num(whole.pixels(whole.values(smallness)[:, None])[..., 0])
    total = np.pad(np.cumsum(np.cumsum(shown, axis=0), axis=1), ((1, 0), (1, 0)))
    wide, tall = max(1, width // ZOOM), max(1, height // ZOOM)
    x, y = (np.linspace(0, whole_side - part, GRID).astype(int) for whole_side, part in
            ((width, wide), (height, tall)))  # fmt: skip
    x, y = (a.ravel() for a in np.meshgrid(x, y))
    inside = total[y + tall, x + wide] - total[y, x + wide] - total[y + tall, x] + total[y, x]
    best = int(np.argmax(inside))
    centre = np.array([x[best] + wide / 2]), np.array([y[best] + tall / 2])
    origin, direction = camera_rays(whole.camera, whole.size, *centre)
    narrow = 2 * np.arctan(np.tan(whole.camera.vertical_fov / 2) / ZOOM)
    low = None if whole.camera.height is None else whole.camera.height / ZOOM
    return Camera("close-up", look_at(origin[0], origin[0] + direction[0]), float(narrow), low)


def sheets(views: Views, values: Mapping[str, np.ndarray]) -> tuple[Picture, Picture]:
    """Draw the whole and the close-up sheet, one tile for each method.

    Parameters
    ----------
    views : the cameras
    values : label -> (n, 3) irradiance of the display mesh; the first one sets the exposure
    """
    stacked = shown_values(views.whole.surfaces, np.concatenate(list(values.values()), axis=1))
    tiles = np.split(stacked, len(values), axis=1)
    return _sheet(views.whole, tiles, list(values)), _sheet(views.close_up, tiles, list(values))


def _sheet(view: View, tiles: list[np.ndarray], labels: list[str]) -> Picture:
    first = lit_picture(view, tiles[0])
    pictures = [first, *(lit_picture(view, tile, first.exposure) for tile in tiles[1:])]
    blank = Picture(np.zeros_like(first.pixels))
    missing = -len(pictures) % COLUMNS
    pictures, labels = pictures + missing * [blank], labels + missing * [""]
    rows = [
        side_by_side(pictures[i : i + COLUMNS], labels[i : i + COLUMNS]).pixels
        for i in range(0, len(pictures), COLUMNS)
    ]
    gap = np.zeros((GAP, rows[0].shape[1], 3), np.uint8)
    return Picture(np.concatenate([part for row in rows for part in (gap, row)][1:]), camera=view.camera)
