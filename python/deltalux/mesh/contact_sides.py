# SPDX-License-Identifier: Apache-2.0
"""Finds which sides of contact lines are open, and which are covered by a surface that stands there."""

from __future__ import annotations

import numpy as np

from .contact_lines import ContactLines
from .covered_places import Cover


def open_sides(lines: ContactLines, normals: np.ndarray, cover: Cover, aside: float) -> np.ndarray:
    """Test beside the midpoint of each line whether something covers the surface there.

    Parameters
    ----------
    lines : contact lines on a surface
    normals : (k, 3), unit, of the surface
    cover : all surfaces that may cover it
    aside : metres from the line

    Returns
    -------
    (k, 2) bool: open to the left and to the right of the line's direction, as seen from above.
    """
    if len(lines) == 0:
        return np.zeros((0, 2), dtype=bool)
    middle = lines.start + 0.5 * lines.length[:, None] * lines.along
    left = aside * np.cross(normals, lines.along)
    covered = [cover.covers(middle + way, normals) for way in (left, -left)]
    return ~np.stack(covered, axis=1)
