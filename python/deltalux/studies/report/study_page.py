# SPDX-License-Identifier: Apache-2.0
"""The study as one HTML page: every claim with its result, then each experiment."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from deltalux.report.page import Link, Section, page
from deltalux.studies.experiment import Cell, Experiment, Outcome, Table
from deltalux.studies.record import Record

from .study_tables import table_csv

TITLE = "A study of incremental update of global illumination: the paper's claims, and what was counted"
NONE = "–"
INTRODUCTION = (
    "Source: R. García, C. Ureña, M. Lastra, R. Montes, J. Revelles, A study of incremental update of global "
    "illumination algorithms, WSCG 2007. Each experiment states its settings and seeds; its verdicts are "
    "computed from its data: confirmed, refuted, or open where the data cannot tell.",
    "Counts are the same for equal settings on any processor and number of threads, but times are not.",
)


Run = tuple[Experiment, Record, Mapping[str, Path]]  # and its figures' SVG files, by figure name


def study_page(runs: Sequence[Run], command: str, note: str = "") -> str:
    """Return the page as HTML.

    Parameters
    ----------
    runs : experiments with their records and their figures' SVG files, by figure name
    command : the command that made the page
    note : remark on all runs, for example that they were quick
    """
    about = [text for text in (*INTRODUCTION, _tally(runs), note, f"Made by: {command}") if text]
    sections = [Section("Claims and outcomes", about, ("outcome", "claim", "experiment"), _claims(runs))]
    for experiment, record, drawings in runs:
        sections += _sections(experiment, record, drawings)
    return page(TITLE, sections)


def _tally(runs: Sequence[Run]) -> str:
    outcomes = Counter(verdict.outcome for _, record, _ in runs for verdict in record.findings.verdicts)
    counted = ", ".join(f"{outcomes[outcome]} {outcome}" for outcome in get_args(Outcome))
    return f"{outcomes.total()} claims: {counted}."


def _claims(runs: Sequence[Run]) -> list[tuple[str, str, Link]]:
    return [
        (verdict.outcome, verdict.claim, Link(experiment.name, experiment.name))
        for experiment, record, _ in runs
        for verdict in record.findings.verdicts
    ]


def _sections(experiment: Experiment, record: Record, drawings: Mapping[str, Path]) -> list[Section]:
    findings = record.findings
    about = [
        experiment.question,
        f"Source: {experiment.source}. Settings: {_pairs(record.settings)}.",
        f"Ran {record.seconds:.0f} s on {_pairs(record.environment)}."
        + (" Times vary from run to run." if experiment.timed else ""),
        *findings.notes,
    ]
    verdicts = [(verdict.outcome, verdict.claim, verdict.text) for verdict in findings.verdicts]
    return [
        Section(experiment.title, about, anchor=experiment.name),
        Section("What the data say", (), ("outcome", "claim", "data"), verdicts, level=3),
        Section(
            "Figures",
            pictures=[(drawings[figure.name], figure.caption) for figure in findings.figures],
            level=3,
        ),
        *(_table(table) for table in findings.tables),
    ]


def _table(table: Table) -> Section:
    rows = [[_cell(cell) for cell in row] for row in table.rows]
    file = f"{table.name}.csv", table_csv(table)
    return Section(f"Table {table.name}", (), table.columns, rows, level=3, folded=True, download=file)


def _cell(cell: Cell) -> str | int | float:
    if cell is None:
        return NONE
    return ("yes" if cell else "no") if isinstance(cell, bool) else cell


def _pairs(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {_value(value)}" for name, value in values.items())


def _value(value: Any) -> str:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "/".join(_value(each) for each in value)
    if value is None:
        return "automatic"
    return (
        f"{value:,}" if isinstance(value, int) else f"{value:g}" if isinstance(value, float) else str(value)
    )
