# SPDX-License-Identifier: Apache-2.0
"""Sentences on the results of a comparison of methods, each decided by its figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

WORSE = 1.5  # ratio of the numbers of wrong samples from which a method is called worse
ERROR_MARGIN = 0.05  # RMS errors whose difference is smaller are called equal

Row = Mapping[str, Any]
_PLACES = {
    "very small": "On very small surfaces",
    "small": "On small surfaces",
    "edge": "Near the edges of large surfaces",
    "inside": "Inside large surfaces",
}


def findings(data: Row) -> list[str]:
    """The results of `deltalux compare-methods`, in a sentence or two each.

    Parameters
    ----------
    data : as returned by `MethodStudy.run`
    """
    methods = {row["name"]: row for row in data["methods"]}
    equal = {row["name"]: row for row in data["equal_count"]["rows"]}
    sentences = [_exact(data["methods"]), _lossy(methods), _fastest(data["methods"])]
    sentences += [_claim(data, equal, name) for name in _PLACES]
    sentences += [_fixed(data, equal), _plain(data)]
    return [text for text in sentences if text]


def _exact(rows: Sequence[Row]) -> str:
    exact = [row for row in rows if row["kind"] == "disc" and "equal" in row]
    wrong = [row["label"] for row in exact if not row["equal"]]
    if wrong:
        return f"Exactness is broken: {', '.join(wrong)} differ from the disc index; please report this."
    return f"All {len(exact)} exact disc methods have equal sums, to the last bit."


def _lossy(methods: Mapping[str, Row]) -> str:
    row = methods["sphere_cache_literal"]
    return f"The sphere cache as printed in the paper (literal) loses {row['lost']:.1%} of the light."


def _fastest(rows: Sequence[Row]) -> str:
    timed = [row for row in rows if row["kind"] == "disc" and row.get("cpu_seconds") is not None]
    cost = {row["label"]: row["cpu_seconds"] / max(row["samples"], 1) for row in timed}
    (first, least), (second, next_) = sorted(cost.items(), key=lambda item: item[1])[:2]
    ratio = f", {next_ / least:.1f} times less per sample than the {second}" if least > 0 else ""
    return f"Of the exact methods the {first} takes the least time{ratio}."


def _claim(data: Row, equal: Mapping[str, Row], name: str) -> str:
    """The photon map against discs with the same expected count, in one class of samples."""
    group = next(c for c in data["classes"] if c["name"] == name)
    photons, whole, clipped = (
        equal[key]["by_class"][name] for key in ("photon_map", "discs_of_k", "clipped_discs_of_k")
    )
    if photons is None or whole is None or clipped is None:
        return ""
    text = (
        f"{_PLACES[name]} ({group['samples']:,} samples) the photon map gives less than half of the light "
        f"at {photons['too_dark']:.1%} and more than twice at {photons['too_bright']:.1%} of the samples; "
        f"discs of the same expected count at {_wrong(whole)}, clipped to what they reach at "
        f"{_wrong(clipped)}."
    )
    if name != "very small":
        return text
    elsewhere = equal["photon_map"]["by_class"]["inside"]
    left = _share(whole)  # the paper's own discs
    if elsewhere is not None and _share(photons) <= WORSE * _share(elsewhere):
        return f"{text} That photon maps fail on very small surfaces (paper 1.2) does not show in this scene."
    if left > _share(photons) / WORSE:
        return f"{text} That photon maps fail on very small surfaces (paper 1.2) shows here; discs fail, too."
    ratio = f"{_share(photons) / left:.1f} times less often" if left > 0 else "nowhere"
    return f"{text} That photon maps fail on very small surfaces (paper 1.2) shows here; discs fail {ratio}."


def _share(row: Row) -> float:
    return float(row["too_dark"] + row["too_bright"])


def _wrong(row: Row) -> str:
    return f"{row['too_dark']:.1%} and {row['too_bright']:.1%}"


def _fixed(data: Row, equal: Mapping[str, Row]) -> str:
    """Discs of one radius against the k nearest crossings, which differ in nothing else."""
    area, count = equal["discs_of_k"]["by_class"], equal["ray_map_crossing"]["by_class"]
    table, parts = data["equal_count"], []
    for name, own in area.items():
        other = count[name]
        if own is None or other is None:
            continue
        ratio = own["rms_error"] / max(other["rms_error"], 1e-12)
        word = "less" if ratio < 1 - ERROR_MARGIN else "more" if ratio > 1 + ERROR_MARGIN else "as much"
        held = table["count_by_class"][name]
        parts.append(
            f"{name} {own['rms_error']:.0%} ({word}: {other['rms_error']:.0%}; {held:.0f} in a disc)"
        )
    return (
        f"Fixed area against fixed count (paper 2.2): discs of {100 * table['radius']:.0f} cm hold "
        f"{table['mean_count']:.1f} segments on average. Their RMS error, and in brackets that of the "
        f"{data['k']} nearest crossings: {', '.join(parts)}."
    )


def _plain(data: Row) -> str:
    k = data["k"]
    return (
        "The plain form of the photon map, which counts the k-th hit, gives "
        f"{data['plain_over_unbiased'] - 1:+.2%} "
        f"against the unbiased one; k / (k - 1) says {k / (k - 1) - 1:+.2%}."
    )
