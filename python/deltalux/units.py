# SPDX-License-Identifier: Apache-2.0
"""Units of results and the weights that turn linear RGB into one photopic value."""

import numpy as np

LUX = "lux"
WATTS_PER_SQUARE_METRE = "W/m2"
UNITS = (LUX, WATTS_PER_SQUARE_METRE)
FARTHEST = 1e15  # metres; beyond it, products of coordinates could overflow

# Luminance weights of linear Rec. 709 / sRGB primaries.
PHOTOPIC_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def photopic(rgb: np.ndarray) -> np.ndarray:
    """Photopic value of linear RGB.

    Parameters
    ----------
    rgb : (..., 3) array

    Returns
    -------
    (...) float64 array, in the unit of the input.
    """
    return np.asarray(rgb, dtype=np.float64) @ PHOTOPIC_WEIGHTS
