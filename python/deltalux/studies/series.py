# SPDX-License-Identifier: Apache-2.0
"""Quantities as functions of one variable: columns of a table, curves of a figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .experiment import Cell, Curve, Table
from .repeats import mean_and_error
from .timing import Timing


@dataclass(frozen=True)
class Series:
    """One quantity at each value of a variable.

    Attributes
    ----------
    label : for the legend and the column
    unit : of the values
    values : (n,), NaN = not measured
    error : (n,) standard errors, or None without any
    theory : whether the values are predicted, not measured
    """

    label: str
    unit: str
    values: np.ndarray
    error: np.ndarray | None = None
    theory: bool = False

    @classmethod
    def of_seeds(cls, label: str, unit: str, rows: ArrayLike) -> Series:
        """Mean and standard error over seeds of (seeds, n) values."""
        mean, error = mean_and_error(rows)
        return cls(label, unit, np.array(mean), None if error is None else np.array(error))

    @classmethod
    def of_times(cls, label: str, times: Sequence[Timing]) -> Series:
        """Processor times in milliseconds; NaN for those lost in their noise (`Timing.known`)."""
        seconds = np.array([time.seconds if time.known else np.nan for time in times])
        return cls(label, "ms", 1e3 * seconds, 1e3 * np.array([time.error for time in times]))

    def curve(self, x: np.ndarray) -> Curve:
        """The points with finite values, as a curve."""
        there = np.isfinite(self.values)
        error = None if self.error is None else self.error[there].tolist()
        points = np.asarray(x)[there].tolist(), self.values[there].tolist()
        return Curve(self.label, *points, error, "theory" if self.theory else "measured")


def series_table(name: str, x_column: str, x: np.ndarray, series: Sequence[Series]) -> Table:
    """One row per point, with a column per quantity and one for each standard error."""
    columns = [x_column]
    data = [np.asarray(x, float)]
    for each in series:
        columns.append(f"{each.label} [{each.unit}]")
        data.append(each.values)
        if each.error is not None:
            columns.append(f"{each.label}, standard error [{each.unit}]")
            data.append(np.where(np.isfinite(each.values), each.error, np.nan))
    return Table(name, columns, [[_cell(value) for value in row] for row in zip(*data, strict=True)])


def _cell(value: float) -> Cell:
    return float(value) if np.isfinite(value) else None
