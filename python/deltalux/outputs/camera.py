# SPDX-License-Identifier: Apache-2.0
"""Chooses a view of a scene without a camera: tries many with few rays and takes the best one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from deltalux.mesh.surfaces import Hits, Surfaces
from deltalux.scene import Camera, Scene

from .view import camera_rays

EYE_HEIGHT = 1.6  # metres above the floor
# metres; scenes with other heights are not in metres, or not rooms for people
ROOM_HEIGHTS = (2.2, 40.0)
INSIDE_FOV, OUTSIDE_FOV = 1.15, 0.7
# Elevation and azimuth step in degrees, and the initial score of such a view.
LEVEL, FROM_ABOVE = (2.0, 90.0, 0.4), (25.0, 30.0, 0.55)  # into an open box; onto objects
LEAST_DISTANCE = 1e-9  # from what is in one place, as a share of its coordinates
TRIAL_SIZE = (24, 16)
ENOUGH, TOO_MUCH = 0.03, 0.3  # shares of the picture that show movables


def scene_camera(scene: Scene) -> Camera | None:
    """The scene's first camera."""
    return scene.cameras[0] if scene.cameras else None


def automatic_camera(surfaces: Surfaces, light: np.ndarray, aspect: float = 1.6) -> Camera:
    """Choose a view of movables; from inside a room, across it; from outside an object, three-quarter.

    Parameters
    ----------
    surfaces : Surfaces
    light : (n,) photopic values at the display mesh's vertices; lit sides are preferred
    aspect : width / height of the picture
    """
    low, high = surfaces.bounds
    lit = _lit_triangles(surfaces, light)
    pixels = _trial_pixels(aspect)
    best, best_score = None, -np.inf
    subjects = _subjects(surfaces)
    for camera, prior in (*_inside(surfaces, low, high), *_outside(low, high, aspect)):
        hits = surfaces.intersect(*camera_rays(camera, TRIAL_SIZE, *pixels))
        score = _score(surfaces, hits, lit, prior, subjects)
        if best is None or score > best_score:
            best, best_score = camera, score
    assert best is not None  # views from outside always exist
    return best


def look_at(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """4x4 pose of a level camera at `eye` that looks towards `target`."""
    backward = np.asarray(eye, dtype=np.float64) - target
    backward /= np.linalg.norm(backward)
    up = np.array([0.0, 1.0, 0.0]) if abs(backward[1]) < 0.999 else np.array([0.0, 0.0, -1.0])
    right = np.cross(up, backward)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = right, np.cross(backward, right), backward, eye
    return pose


def _middle() -> np.ndarray:
    """(rays,) bool: whether a ray is not near the edge of a trial picture."""
    width, height = TRIAL_SIZE
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return ((x >= 2) & (x < width - 2) & (y >= 2) & (y < height - 2)).ravel()


_MIDDLE = _middle()


def _trial_pixels(aspect: float) -> tuple[np.ndarray, np.ndarray]:
    """Centres of the trial picture's pixels; x is scaled to the picture's aspect."""
    width, height = TRIAL_SIZE
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    stretch = aspect / (width / height)
    return (x.ravel() - width / 2) * stretch + width / 2, y.ravel()


def _inside(surfaces: Surfaces, low: np.ndarray, high: np.ndarray) -> Iterator[tuple[Camera, float | None]]:
    extent = high - low
    shares = (0.07, 0.27, 0.5, 0.73, 0.93)
    x, z = np.meshgrid(low[0] + extent[0] * np.array(shares), low[2] + extent[2] * np.array(shares))
    heights = (0.5,) if not ROOM_HEIGHTS[0] <= extent[1] <= ROOM_HEIGHTS[1] else (0.15, 0.6)
    for height in heights:
        start = np.stack([x.ravel(), np.full(x.size, low[1] + height * extent[1]), z.ravel()], axis=1)
        if len(heights) > 1:
            below = surfaces.intersect(start, np.broadcast_to([0.0, -1.0, 0.0], start.shape))
            floor = np.where(below.hit, start[:, 1] - below.distance, low[1])
            start[:, 1] = np.minimum(floor + EYE_HEIGHT, low[1] + 0.9 * extent[1])
        for eye in start:
            for azimuth in np.radians(np.arange(0, 360, 22.5)):
                ahead = np.array([np.sin(azimuth), -0.12, np.cos(azimuth)])
                yield Camera("automatic", look_at(eye, eye + ahead), INSIDE_FOV), None


def _outside(low: np.ndarray, high: np.ndarray, aspect: float) -> Iterator[tuple[Camera, float | None]]:
    corners = np.array(
        [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )
    centre = 0.5 * (low + high)
    across = np.tan(OUTSIDE_FOV / 2) * np.array([aspect, 1.0])
    for elevation, step, prior in (LEVEL, FROM_ABOVE):
        rise = np.radians(elevation)
        for azimuth in np.radians(np.arange(0, 360, step)):
            away = np.array([np.sin(azimuth) * np.cos(rise), np.sin(rise), np.cos(azimuth) * np.cos(rise)])
            pose = look_at(centre + away, centre)
            local = (corners - centre) @ pose[:3, :3]
            # Each corner requires a distance; the largest one shows them all.
            distance = 1.04 * (local[:, 2:] + np.abs(local[:, :2]) / across).max()
            distance = max(distance, LEAST_DISTANCE * np.abs(centre).max()) or 1.0
            pose = look_at(centre + distance * away, centre)
            yield Camera("automatic", pose, OUTSIDE_FOV), prior


def _subjects(surfaces: Surfaces) -> np.ndarray:
    """(triangles,) bool: whether a triangle is present and part of a movable."""
    movable = [i for i, mesh in enumerate(surfaces.scene.meshes) if mesh.movable]
    return np.isin(surfaces.display.triangle_mesh, movable) & (surfaces.area > 0)


def _lit_triangles(surfaces: Surfaces, light: np.ndarray) -> np.ndarray:
    mean = light[surfaces.display.triangles].mean(axis=1)
    if not surfaces.area.any():  # everything was removed
        return np.zeros(len(mean), dtype=bool)
    typical = np.average(mean, weights=surfaces.area)
    return mean > 0.03 * typical


def _score(
    surfaces: Surfaces, hits: Hits, lit: np.ndarray, prior: float | None, subjects: np.ndarray
) -> float:
    """Score of a view: lit surfaces on their sampled side, far enough away, variety, and movables above all.

    `prior` is the initial score of a view from outside, None inside.
    The weights were set by looking at rooms, halls, single objects and open boxes.
    """
    display = surfaces.display
    seen = hits.facing
    if not seen.any():
        return -np.inf
    triangle = hits.triangle[seen]
    mesh_share = _shares(display.triangle_mesh[triangle])
    variety = np.exp(-(mesh_share * np.log(mesh_share)).sum())
    faces = np.round(surfaces.normals[triangle]) @ (1, 3, 9)
    directions = (_shares((faces + 13).astype(np.int64)) > 0.03).sum()
    score = 0.04 * min(variety, 8) + 0.06 * min(directions, 5)
    if subjects.any():
        score += _shown(subjects[triangle], _MIDDLE[seen])

    bright = lit[triangle].mean() * seen.mean()
    wrong_side = (hits.hit & ~seen).mean()
    if prior is not None:  # a view from outside is framed to fit, so its share of the picture means nothing
        return float(score + prior + (bright - 2 * wrong_side) / hits.hit.mean())
    low, high = surfaces.bounds
    diagonal = np.linalg.norm(high - low)
    missed = (~hits.hit).mean()
    near = (hits.distance < 0.1 * diagonal).mean()
    depth = min(np.median(hits.distance[seen]) / diagonal, 0.6)
    return float(score + bright - 2 * wrong_side - 0.8 * missed - 1.5 * near + 0.8 * depth)


def _shown(subject: np.ndarray, middle: np.ndarray) -> float:
    """Score of how well the picture shows movables: not at its edge, neither tiny nor filling it.

    Parameters
    ----------
    subject, middle : (k,) bool of rays: whether they hit a movable, and are in the middle of the picture
    """
    share, cut = (subject & middle).mean(), (subject & ~middle).mean()
    if share == 0:
        return -1.0  # hidden by a wall, or behind the camera
    return float(0.6 * min(max(share - cut, 0.0) / ENOUGH, 1.0) - 2 * max(share - TOO_MUCH, 0.0))


def _shares(numbers: np.ndarray) -> np.ndarray:
    counts = np.bincount(numbers)
    return counts[counts > 0] / len(numbers)
