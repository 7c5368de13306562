# SPDX-License-Identifier: Apache-2.0
"""The comparison of all methods as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

Row = Mapping[str, Any]
COST = ("samples", "cpu_seconds", "seconds", "memory_bytes", "tests", "hits", "equal", "lost")
FIGURES = ("rms_error", "bias", "median", "too_dark", "too_bright")


def methods_csv(data: Row) -> str:
    """One row per method: costs, then error figures over all samples and by class, as shares of 1.

    Parameters
    ----------
    data : as returned by `MethodStudy.run`
    """
    return _csv(data, data["methods"], ("name", "kind", *COST))


def equal_count_csv(data: Row) -> str:
    """One row per method with the same expected count, figures as in `methods_csv`."""
    return _csv(data, data["equal_count"]["rows"], ("name",))


def _csv(data: Row, rows: Sequence[Row], columns: Sequence[str]) -> str:
    names = [group["name"] for group in data["classes"]]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    by_class = [f"{figure}_{name.replace(' ', '_')}" for name in names for figure in FIGURES]
    writer.writerow([*columns, *FIGURES, *by_class])
    for row in rows:
        groups = [row["by_class"][name] or {} for name in names]
        cells = [row.get(column) for column in (*columns, *FIGURES)]
        writer.writerow(cells + [group.get(figure) for group in groups for figure in FIGURES])
    return text.getvalue()
