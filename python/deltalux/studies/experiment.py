# SPDX-License-Identifier: Apache-2.0
"""Types of the study: experiments, and their findings (tables, figures, verdicts) as plain data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from deltalux.segments import Progress

Cell = str | int | float | bool | None
Outcome = Literal["confirmed", "refuted", "open"]


@dataclass(frozen=True)
class Table:
    """A table, written as one CSV file.

    Attributes
    ----------
    name : stem of the file name
    columns : names, with their unit in brackets where they have one
    rows : one cell per column; None = not measured
    """

    name: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True)
class Curve:
    """One curve of a figure.

    Attributes
    ----------
    label : for the legend
    x, y : coordinates of the points, of equal length
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
    name : stem of the file names
    caption : contents of the figure, seeds, and meaning of the error bars
    x_label, y_label : with units
    curves, marks : contents
    log_x, log_y : whether the axes are logarithmic
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
    """A claim, and its outcome on the data.

    Attributes
    ----------
    claim : one sentence, with its source
    outcome : "confirmed", "refuted", or "open" where the data do not decide
    text : the numbers that decide, computed from the data
    """

    claim: str
    outcome: Outcome
    text: str


@dataclass(frozen=True)
class Findings:
    """Results of one run of an experiment."""

    tables: Sequence[Table]
    figures: Sequence[Figure]
    verdicts: Sequence[Verdict]
    notes: Sequence[str] = field(default=())


@dataclass(frozen=True)
class Experiment:
    """A question, and the function that answers it.

    Attributes
    ----------
    name : argument of `deltalux study`
    title : heading
    source : section or figure of the paper
    question : one or two sentences
    run : (settings, progress) -> Findings; equal settings give equal counts, on any number of threads
    full : settings at the paper's sizes; JSON values, "seeds" among them
    quick : settings that replace those of `full` in a quick run, which takes seconds
    timed : whether the findings contain times, which vary from run to run
    """

    name: str
    title: str
    source: str
    question: str
    run: Callable[[Mapping[str, Any], Progress | None], Findings]
    full: Mapping[str, Any]
    quick: Mapping[str, Any]
    timed: bool = False
