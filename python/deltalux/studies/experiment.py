# SPDX-License-Identifier: Apache-2.0
"""What an experiment of the study is, and what it finds: tables, figures and verdicts as plain data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from deltalux.segments import Progress

Cell = str | int | float | bool | None
Outcome = Literal["confirmed", "refuted", "open"]


@dataclass(frozen=True)
class Table:
    """One CSV file.

    Attributes
    ----------
    name : stem of the file
    columns : names, with their unit in brackets where they have one
    rows : as wide as `columns`; None = not measured
    """

    name: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True)
class Curve:
    """Points of a figure.

    Attributes
    ----------
    label : for the legend
    x, y : of equal length
    error : standard error of each y, or None where y is theory and has none
    style : "measured" (points and line), "theory" (dashed line) or "bars"
    """

    label: str
    x: Sequence[float]
    y: Sequence[float]
    error: Sequence[float] | None = None
    style: Literal["measured", "theory", "bars"] = "measured"


@dataclass(frozen=True)
class Mark:
    """A vertical line with a text, such as a predicted crossover."""

    x: float
    text: str


@dataclass(frozen=True)
class Figure:
    """A diagram to be drawn as vectors and as pixels.

    Attributes
    ----------
    name : stem of the files
    caption : what is shown, with seeds and what the error bars are
    x_label, y_label : with units
    curves, marks : what is drawn
    log_x, log_y : logarithmic axes
    """

    name: str
    caption: str
    x_label: str
    y_label: str
    curves: Sequence[Curve]
    marks: Sequence[Mark] = ()
    log_x: bool = False
    log_y: bool = False


@dataclass(frozen=True)
class Verdict:
    """A claim, and what the data say of it.

    Attributes
    ----------
    claim : one sentence, with its source
    outcome : "confirmed", "refuted", or "open" where the data cannot tell
    text : the figures that decide, computed from the data
    """

    claim: str
    outcome: Outcome
    text: str


@dataclass(frozen=True)
class Findings:
    """What one run of an experiment found."""

    tables: Sequence[Table]
    figures: Sequence[Figure]
    verdicts: Sequence[Verdict]
    notes: Sequence[str] = field(default=())


@dataclass(frozen=True)
class Experiment:
    """A question with the program that answers it.

    Attributes
    ----------
    name : as typed after `deltalux study`
    title : heading
    source : section or figure of the paper
    question : one or two sentences
    run : (settings, progress) -> Findings; equal settings give equal counts, on any number of threads
    full : settings at the paper's sizes; JSON values, "seeds" among them
    quick : the settings that differ in a quick look, which takes seconds
    timed : findings hold times, which vary from run to run
    """

    name: str
    title: str
    source: str
    question: str
    run: Callable[[Mapping[str, Any], Progress | None], Findings]
    full: Mapping[str, Any]
    quick: Mapping[str, Any]
    timed: bool = False
