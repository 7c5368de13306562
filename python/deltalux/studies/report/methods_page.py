# SPDX-License-Identifier: Apache-2.0
"""The comparison of all methods as one HTML page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from deltalux.report.page import Section, page

from .method_findings import findings

Row = Mapping[str, Any]
Cell = str | float | int
NONE = "–"

_COST_HEADER = (
    "method",
    "kind",
    "samples",
    "CPU s",
    "CPU µs per sample",
    "memory, MiB",
    "tests",
    "hits",
    "sums",
)
_COST_NOTES = (
    "CPU time is that of all threads together, preparation included: an index, a tree, a pass over the "
    "scene's triangles. Brute force is asked for fewer samples.",
    "Memory is measured: growth of the process up to its peak during the call, beside the segments and the "
    "scene, which all methods share. Tests are those that the method counts. "
    "The session's cost is not listed: it traces its own paths.",
)
_ERROR_NOTES = (
    "Root of the mean square of (estimate − reference) / max(reference, 10 % of the mean), over samples and "
    "channels: the noise of the paths, which all methods share, and each method's own systematic error. "
    "Brute force stands for its fewer samples.",
)
_BIAS_NOTES = ("Mean of (estimate − reference) / max(reference, 10 % of the mean). Below zero is too dark.",)
_SHARE_NOTES = (
    "Errors below −50 %, in the next table above +100 %. A few samples in bright places can carry a mean; "
    "this counts samples, noise included.",
)
_CLASS_HEADER = (
    "class",
    "samples",
    "noise of a mean error, %",
    "error of the reference, %",
    "segments in a disc",
)


def methods_page(title: str, about: str, data: Row, pictures: Sequence[tuple[Path, str]]) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    title : heading
    about : the command and settings that made it
    data : as returned by `MethodStudy.run`
    pictures : (PNG file, caption) pairs
    """
    header = ("method", "all", *(group["name"] for group in data["classes"]))

    def errors(title: str, notes: Sequence[str], rows: Sequence[Row], figure: str) -> Section:
        return Section(title, notes, header, [_errors(row, figure) for row in rows])

    methods, equal = data["methods"], data["equal_count"]
    count_note = (
        f"Discs of one radius, {equal['radius']:.3f} m, which {equal['mean_count']:.1f} segments cross on "
        f"average, beside methods that take the {data['k']} nearest (paper 2.2)."
    )
    return page(
        title,
        [
            Section("What was found", findings(data)),
            Section("What was compared", [about, *_setting(data)]),
            Section("Pictures", pictures=pictures),
            Section("Cost", _COST_NOTES, _COST_HEADER, [_cost(row) for row in methods]),
            errors("RMS error, %", _ERROR_NOTES, methods, "rms_error"),
            errors("Mean error (bias), %", _BIAS_NOTES, methods, "bias"),
            errors("Less than half of the light, % of the samples", _SHARE_NOTES, methods, "too_dark"),
            errors("More than twice the light, % of the samples", (), methods, "too_bright"),
            errors("Fixed area against fixed count: RMS error, %", [count_note], equal["rows"], "rms_error"),
            errors("Fixed area against fixed count: mean error, %", (), equal["rows"], "bias"),
            Section("Classes of samples", _class_notes(data), _CLASS_HEADER, _classes(data)),
        ],
    )


def _setting(data: Row) -> list[str]:
    return [
        f"{data['paths']:,} paths, {data['segments']:,} segments, of which {data['surface_hits']:,} end on a "
        f"surface; {data['samples']:,} samples, drawn from the vertices of the display mesh; "
        f"k = {data['k']}. {data['left_out']:,} more samples are covered or unlit (below 1 % of the mean) "
        "and left out.",
        f"Discs have the radius that a session chooses, in the median {data['disc_radius']:.3f} m, unless "
        "their count is said to be fixed.",
        f"The reference: a session on {data['reference_paths']:,} other paths, direct light by shadow rays, "
        "smaller discs, clipped to what they reach; what clipping gets wrong is not seen. Its own standard "
        f"error, {data['reference_error']:.1%} RMS, is taken out of the RMS errors.",
    ]


def _class_notes(data: Row) -> list[str]:
    return [
        f"On the average of all surfaces, k hits need {data['gather_area']:.3g} m², a disc of radius "
        f"{data['gather_radius']:.3g} m. A surface is what shades smoothly, one side of it. It is small "
        "below that area, and very small below a tenth of it. Samples of larger surfaces are at an edge "
        "where their surface ends nearer than that radius, else inside.",
        "The noise of a mean error is that of discs of fixed area, from eight separate parts of the paths.",
    ]


def _classes(data: Row) -> list[list[Cell]]:
    held = data["equal_count"]["count_by_class"]
    return [
        [
            group["name"],
            group["samples"],
            _percent(group["bias_noise"]),
            _percent(group["reference_error"]),
            NONE if held[group["name"]] is None else held[group["name"]],
        ]
        for group in data["classes"]
    ]


def _cost(row: Row) -> list[Cell]:
    seconds, memory = row.get("cpu_seconds"), row.get("memory_bytes")
    tests, hits = row.get("tests"), row.get("hits")
    each = None if seconds is None else 1e6 * seconds / max(row["samples"], 1)
    sums = NONE if "equal" not in row else "equal" if row["equal"] else f"{row['lost']:.1%} lost"
    return [
        row["label"],
        row["kind"],
        row["samples"],
        NONE if seconds is None else round(seconds, 2),
        NONE if each is None else round(each) if each >= 100 else round(each, 1),
        NONE if memory is None else round(memory / 2**20, 1),
        NONE if tests is None else tests,
        NONE if hits is None else hits,
        sums,
    ]


def _errors(row: Row, figure: str) -> list[Cell]:
    groups = (row, *row["by_class"].values())
    return [row["label"], *(_percent(group[figure] if group else None) for group in groups)]


def _percent(value: float | None) -> Cell:
    return NONE if value is None else round(100 * value, 1)
