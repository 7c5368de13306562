# SPDX-License-Identifier: Apache-2.0
"""Moves a movable: its new pose, the new scene, and the segments that the move changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from deltalux.scene import Scene, replace_scene
from deltalux.segments import Segments

MOST_BOUNCES = 256  # bounce numbers fit into 8 bits


def shifted(pose: np.ndarray, offset: Sequence[float]) -> np.ndarray:
    """A copy of a pose, translated by `offset`, metres."""
    moved = pose.copy()
    moved[:3, 3] += offset
    return moved


def with_moved(scene: Scene, name: str, offset: Sequence[float]) -> Scene:
    """The scene with the movable `name` moved by `offset`, metres."""
    meshes = [
        replace(mesh, pose=shifted(mesh.pose, offset)) if mesh.name == name else mesh for mesh in scene.meshes
    ]
    return replace_scene(scene, meshes=meshes)


def changed_segments(before: Segments, after: Segments) -> tuple[Segments, Segments]:
    """Old and new segments: those of `before` that are not in `after`, and vice versa.

    Parameters
    ----------
    before, after : traced with the same seed and number of paths
    """
    _, ours, theirs = np.intersect1d(_keys(before), _keys(after), assume_unique=True, return_indices=True)
    same = np.ones(len(ours), bool)
    for name in ("origin", "direction", "length", "extended", "quanta"):
        one, other = getattr(before, name)[ours], getattr(after, name)[theirs]
        same &= (one == other).reshape(len(same), -1).all(axis=1)
    old, new = np.ones(len(before), bool), np.ones(len(after), bool)
    old[ours[same]] = new[theirs[same]] = False
    return before.select(old), after.select(new)


def _keys(segments: Segments) -> np.ndarray:
    """One number for each path and bounce."""
    return segments.path.astype(np.int64) * MOST_BOUNCES + segments.bounce


def joined(first: Segments, second: Segments) -> Segments:
    """One set of segments with the powers of two sets that have the same quantum."""
    columns = [
        np.concatenate([getattr(part, name) for part in (first, second)])
        for name in ("origin", "direction", "length", "power", "extended")
    ]
    return Segments(*columns)
