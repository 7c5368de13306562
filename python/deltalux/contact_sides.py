# SPDX-License-Identifier: Apache-2.0
"""Which sides of the lines where surfaces meet are open, and which are covered by what stands there."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _core
from .contact_lines import ContactLines
from .covered_places import covered_places
from .vectors import normals_by_area

NOTHING = 0xFFFFFFFF


def open_sides(
    lines: ContactLines, normals: np.ndarray, faces: np.ndarray, aside: float, spacing: float
) -> np.ndarray:
    """Ask beside the middle of each line whether something covers the surface there.

    Parameters
    ----------
    lines : on a surface
    normals : (k, 3), unit, of the surface
    faces : (f, 3, 3) of all surfaces, counter-clockwise on a side that light may reach; a face of which
        it may reach both appears twice
    aside : metres from the line
    spacing : metres, of samples there

    Returns
    -------
    (k, 2) bool: open to the left and to the right of the line's direction, as seen from above.
    """
    if len(lines) == 0:
        return np.zeros((0, 2), dtype=bool)
    is_open = _Faces(faces).is_open
    middle = lines.start + 0.5 * lines.length[:, None] * lines.along
    left = aside * np.cross(normals, lines.along)
    covered = [covered_places(middle + way, normals, spacing, is_open) for way in (left, -left)]
    return ~np.stack(covered, axis=1)


class _Faces:
    """Faces that rays are cast at; of one that appears twice, either winding may be met."""

    def __init__(self, faces: np.ndarray) -> None:
        self._origin = 0.5 * (faces.min(axis=(0, 1)) + faces.max(axis=(0, 1)))
        vertices = (faces - self._origin).astype(np.float32).reshape(-1, 3)
        _, place = np.unique(vertices, axis=0, return_inverse=True)
        places = np.sort(place.reshape(-1, 3), axis=1)
        _, one, count = np.unique(places, axis=0, return_index=True, return_counts=True)
        self._both = count > 1
        self._normals = normals_by_area(faces[one])
        self._caster: Any = _core.RayCaster(
            vertices, np.arange(3 * len(faces), dtype=np.uint32).reshape(-1, 3)[one]
        )

    def is_open(self, origins: np.ndarray, directions: np.ndarray, contact: float) -> np.ndarray:
        """See `covered_places`."""
        distance, face, _, _ = self._caster.intersect(
            (origins - self._origin).astype(np.float32), directions.astype(np.float32)
        )
        hit = face != NOTHING
        number = np.where(hit, face, 0)
        facing = self._both[number] | (np.einsum("ij,ij->i", directions, self._normals[number]) < 0)
        return ~hit | (facing & (distance > contact))
