# SPDX-License-Identifier: Apache-2.0
"""Errors against a noisy reference, over all samples and by class."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux.units import PHOTOPIC_WEIGHTS

from .sample_classes import CLASSES

DARK = 0.1  # share of a channel's mean: errors of darker samples are relative to this
FEWEST = 20  # samples that a class needs for an error figure
TOO_DARK, TOO_BRIGHT = -0.5, 1.0  # relative errors: half and twice the reference


class Reference:
    """Reference irradiance, to which estimates are compared.

    Parameters
    ----------
    irradiance, standard_error : (n, 3)
    classes : (n,) int, index into `CLASSES`
    """

    def __init__(self, irradiance: np.ndarray, standard_error: np.ndarray, classes: np.ndarray) -> None:
        self.irradiance, self.classes = irradiance, classes
        # A channel without any light has no scale of its own: its mean counts as 1.
        mean = irradiance.mean(axis=0)
        self._scale = np.maximum(irradiance, DARK * np.where(mean > 0, mean, 1.0))
        self._noise = np.square(standard_error / self._scale).mean(axis=1)

    def noise(self, where: np.ndarray) -> float:
        """RMS of the reference's own standard error, relative in the same way as `relative`."""
        return float(np.sqrt(self._noise[where].mean()))

    def relative(self, values: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(m, 3) errors of `values` at these samples over max(reference, 10 % of the channel's mean)."""
        return (values - self.irradiance[rows]) / self._scale[rows]

    def figures(self, values: np.ndarray, rows: np.ndarray) -> dict[str, Any]:
        """Error figures of estimates at some samples.

        Returns
        -------
        dict with `rms_error`, `bias` (mean error), `median` error, `too_dark` and `too_bright` (shares of
        the samples), and `by_class`, the same for each class with at least 20 of the samples (else
        None). The reference's noise is subtracted in the RMS.
        """
        relative = self.relative(values, rows)
        own = self.classes[rows]
        by_class = {
            name: self._figure(relative, rows, own == number) if (own == number).sum() >= FEWEST else None
            for number, name in enumerate(CLASSES)
        }
        return {**self._figure(relative, rows, np.full(len(rows), True)), "by_class": by_class}

    def _figure(self, relative: np.ndarray, rows: np.ndarray, which: np.ndarray) -> dict[str, float]:
        own = relative[which]
        square = float(np.square(own).mean()) - float(self._noise[rows[which]].mean())
        light = own @ PHOTOPIC_WEIGHTS
        return {
            "rms_error": float(np.sqrt(max(0.0, square))),
            "bias": float(own.mean()),
            "median": float(np.median(light)),
            "too_dark": float((light < TOO_DARK).mean()),
            "too_bright": float((light > TOO_BRIGHT).mean()),
        }
