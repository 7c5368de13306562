# SPDX-License-Identifier: Apache-2.0
"""The comparison of all methods as one HTML page and as tables for other programs."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .method_findings import findings
from .page import Section, page

Row = Mapping[str, Any]
Cell = str | float | int
NONE = "–"
COST = ("samples", "cpu_seconds", "seconds", "memory_bytes", "tests", "hits", "equal", "lost")


def methods_page(title: str, about: str, data: Row, pictures: Sequence[tuple[Path, str]]) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    title : heading
    about : how it was made
    data : as `MethodStudy.run` returns it
    pictures : (PNG file, caption) pairs
    """
    equal = data["equal_count"]
    names = [group["name"] for group in data["classes"]]
    classes = [(g["name"], g["samples"], _percent(g["bias_noise"]), _percent(g["reference_error"]),
                _number(equal["count_by_class"][g["name"]])) for g in data["classes"]]  # fmt: skip
    return page(
        title,
        [
            Section("What was found", findings(data)),
            Section("What was compared", [about, *_setting(data)]),
            Section("Pictures", pictures=pictures),
            Section("Cost", _COST_NOTES, _COST_HEADER, [_cost(row) for row in data["methods"]]),
            Section(
                "RMS error, %",
                _error_notes(data),
                ("method", "all", *names),
                _table(data["methods"], "rms_error"),
            ),
            Section(
                "Mean error (bias), %",
                _BIAS_NOTES,
                ("method", "all", *names),
                _table(data["methods"], "bias"),
            ),
            Section(
                "Too dark by half or more, % of the samples",
                _WRONG_NOTES,
                ("method", "all", *names),
                _table(data["methods"], "too_dark"),
            ),
            Section(
                "Twice too bright or more, % of the samples",
                (),
                ("method", "all", *names),
                _table(data["methods"], "too_bright"),
            ),
            Section(
                "Fixed area against fixed count",
                [
                    f"Discs of one radius, {equal['radius']:.3f} m, which {equal['mean_count']:.1f} segments "
                    "cross "
                    f"on average, beside methods that take the {data['k']} nearest (paper 2.2). RMS error, %."
                ],
                ("method", "all", *names),
                _table(equal["rows"], "rms_error"),
            ),
            Section(
                "Fixed area against fixed count: mean error, %",
                (),
                ("method", "all", *names),
                _table(equal["rows"], "bias"),
            ),
            Section("Classes of samples", _class_notes(data), _CLASS_HEADER, classes),
        ],
    )


def methods_csv(data: Row) -> str:
    """One row per method: costs, errors, and errors by class (a share of 1, not percent)."""
    return _csv(data, data["methods"], ("name", "kind", *COST))


def equal_count_csv(data: Row) -> str:
    """One row per method of equal expected count, errors as in `methods_csv`."""
    return _csv(data, data["equal_count"]["rows"], ("name",))


def _csv(data: Row, rows: Sequence[Row], columns: Sequence[str]) -> str:
    names = [group["name"] for group in data["classes"]]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    figures = ("rms_error", "bias", "median", "too_dark", "too_bright")
    by_class = [f"{figure}_{name.replace(' ', '_')}" for name in names for figure in figures]
    writer.writerow([*columns, *figures, *by_class])
    for row in rows:
        groups = [row["by_class"][name] or {} for name in names]
        cells = [row.get(column) for column in (*columns, *figures)]
        writer.writerow(cells + [group.get(figure) for group in groups for figure in figures])
    return text.getvalue()


_COST_HEADER = (
    "method",
    "kind",
    "samples",
    "CPU s",
    "CPU µs per sample",
    "memory, MB",
    "tests",
    "hits",
    "sums",
)
_COST_NOTES = (
    "CPU time is that of all threads together, preparation included: an index, a tree, a pass over the "
    "scene's "
    "triangles. Slow methods are asked for fewer samples; the fewer there are, the more preparation each "
    "bears.",
    "Memory is measured: growth of the process up to its peak during the call, beside the segments and the "
    "scene, "
    "which all methods share. Tests are those that the method counts; the photon map's tree counts none. "
    "The session's cost is not listed: it traces its own paths.",
)
_BIAS_NOTES = (
    "Mean over samples of (estimate − reference) / max(reference, 10 % of the mean). Below zero is too dark.",
)
_WRONG_NOTES = ("A few samples in bright places can carry a mean; this counts samples, noise included.",)
_CLASS_HEADER = (
    "class",
    "samples",
    "noise of a mean error, %",
    "error of the reference, %",
    "segments in a disc",
)


def _setting(data: Row) -> list[str]:
    return [
        f"{data['paths']:,} paths, {data['segments']:,} segments, {data['surface_hits']:,} of which end on a "
        "surface; "
        f"{data['samples']:,} samples, drawn from the vertices of the display mesh; k = {data['k']}. "
        f"{data['left_out']:,} more samples are covered or unlit (below 1 % of the mean) and left out.",
        f"Discs have the radius that a session chooses, {data['disc_radius']:.3f} m in the middle, unless "
        "their count "
        "is said to be fixed.",
        f"The reference: a session on {data['reference_paths']:,} other paths, direct light by shadow rays, "
        "smaller "
        f"discs. Its own standard error, {data['reference_error']:.1%} RMS, is taken out of the errors "
        "below.",
    ]


def _error_notes(data: Row) -> list[str]:
    return [
        "Root of the mean square of (estimate − reference) / max(reference, 10 % of the mean), over samples "
        "and "
        "channels. It holds the noise of the paths, which is the same for all methods, and each method's own "
        "systematic error.",
    ]


def _class_notes(data: Row) -> list[str]:
    area, radius = data["gather_area"], data["gather_radius"]
    return [
        f"On the average of all surfaces, k hits need {area:.3g} m², a disc of radius {radius:.3g} m. A "
        "surface is what "
        "shades smoothly, one side of it. It is small below that area, and very small below a tenth of it. "
        "Samples of "
        "larger surfaces are at an edge where their surface ends nearer than that radius.",
        "The noise of a mean error is a disc method's, from eight separate parts of the paths.",
    ]


def _cost(row: Row) -> list[Cell]:
    seconds, memory = row.get("cpu_seconds"), row.get("memory_bytes")
    sums = NONE if "equal" not in row else "equal" if row["equal"] else f"{row['lost']:.1%} lost"
    return [
        row["label"],
        row["kind"],
        row["samples"],
        NONE if seconds is None else round(seconds, 2),
        NONE if seconds is None else round(1e6 * seconds / max(row["samples"], 1), 1),
        NONE if memory is None else round(memory / 2**20, 1),
        _number(row.get("tests")),
        _number(row.get("hits")),
        sums,
    ]


def _table(rows: Sequence[Row], figure: str) -> list[list[Cell]]:
    return [
        [
            row["label"],
            *(_percent(group[figure] if group else None) for group in (row, *row["by_class"].values())),
        ]
        for row in rows
    ]


def _percent(value: float | None) -> Cell:
    return NONE if value is None else round(100 * value, 1)


def _number(value: float | int | None) -> Cell:
    return NONE if value is None else value
