# SPDX-License-Identifier: Apache-2.0
"""`deltalux study`: the paper's experiments, as figures, tables, verdicts and one page."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from deltalux.cli.console import Terminal
from deltalux.cli.options import JsonOption, QuietOption, ThreadsOption
from deltalux.cli.places import ClusterOption, Place, WorkersOption, place_of
from deltalux.cli.targets import check_writable
from deltalux.segments import Progress
from deltalux.studies.experiment import Experiment
from deltalux.studies.experiments import EXPERIMENTS, experiment
from deltalux.studies.on_workers import run_on_workers
from deltalux.studies.record import Record
from deltalux.studies.report.drawing import check_drawing
from deltalux.studies.report.study_page import Run, study_page
from deltalux.studies.runner import run as run_experiment
from deltalux.studies.runner import run_key, settings_of

from .study_folder import StudyFolder

ALL, PAGE = "all", "study.html"  # of one experiment: its name.html
QUICK_NOTE = "A quick look: small sizes, whose verdicts may differ from those at the paper's sizes."
COLOURS = {"confirmed": "green", "refuted": "red", "open": "yellow"}

NameArgument = Annotated[
    str | None,
    typer.Argument(
        metavar="NAME|all", help="An experiment of [bold]--list[/], or all of them.", show_default=False
    ),
]
FolderOption = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="DIR",
        help="Folder for the page, and for each experiment's figures and tables.",
        show_default=False,
    ),
]
ListOption = Annotated[bool, typer.Option("--list", help="List the experiments.")]
QuickOption = Annotated[
    bool, typer.Option("--quick", help="Small sizes, about two minutes for all: a first look.")
]
SeedsOption = Annotated[
    list[int] | None,
    typer.Option(
        "-s",
        "--seed",
        min=0,
        metavar="N",
        help="Seed of one repetition (repeatable), in place of the experiment's own seeds.",
        show_default=False,
    ),
]
AgainOption = Annotated[bool, typer.Option("--again", help="Repeat experiments that are finished, too.")]


def run(
    context: typer.Context,
    name: NameArgument = None,
    output: FolderOption = None,
    quick: QuickOption = False,
    seed: SeedsOption = None,
    threads: ThreadsOption = None,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    again: AgainOption = False,
    list_only: ListOption = False,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Repeat the paper's experiments: what is confirmed, and what is not.

    Each experiment writes its figures (.svg, .png), its tables (.csv) and its verdicts, computed from the
    data, into a folder of its own; study.html (of one experiment: NAME.html) holds them all in one file.
    Finished experiments are skipped unless their settings or the program changed; after Ctrl-C the same
    command goes on.

    [bold]Examples[/]

    deltalux study all --quick -o study

    deltalux study curve-orders -o study

    deltalux study all --workers 4 -o study

    With --workers or --cluster each experiment, and what it does with each of its seeds, is a task for one
    worker. Counts are the same; times are less steady where workers share a machine.
    """
    terminal = Terminal(as_json, quiet)
    if list_only:
        terminal.result({"experiments": [_about(each) for each in EXPERIMENTS]}, _list())
        return
    if name is None:
        raise typer.BadParameter("found no experiment, expected 'all' or a name of --list")
    if output is None:
        raise typer.BadParameter("found no folder, expected one", param_hint="'-o'")
    chosen = EXPERIMENTS if name == ALL else (experiment(name),)
    settings = [settings_of(each, quick=quick, seeds=seed, threads=threads) for each in chosen]
    check_drawing()
    output.mkdir(parents=True, exist_ok=True)
    page = PAGE if name == ALL else f"{name}.html"
    check_writable(output / page)
    jobs = list(zip(chosen, settings, strict=True))
    with place_of(workers, cluster, threads, terminal) as place, terminal.progress() as progress:
        runs, skipped = _run(jobs, output, again, progress, place)
    command = shlex.join(["deltalux", *context.obj])
    StudyFolder(output).write_text(page, study_page(runs, command, QUICK_NOTE if quick else ""))
    data = {
        "page": str(output / page),
        "skipped": skipped,
        "experiments": [_outcome(each, record) for each, record, _ in runs],
    }
    terminal.result(data, _verdicts(runs), *_told(skipped), f"{page}, figures and tables are in {output}")


def _run(
    wanted: Sequence[tuple[Experiment, dict[str, Any]]],
    output: Path,
    again: bool,
    progress: Progress,
    place: Place,
) -> tuple[list[Run], list[str]]:
    """Run unfinished experiments and save each result at once. Returns runs and the names of skipped ones."""
    runs: dict[str, Run] = {}
    to_do: list[tuple[Experiment, dict[str, Any]]] = []

    def show(each: Experiment, folder: StudyFolder, record: Record) -> None:
        folder.draw(record)
        runs[each.name] = (each, record, folder.drawings(record))

    for each, settings in wanted:
        folder = StudyFolder(output / each.name)
        record = None if again else folder.finished(run_key(each, settings))
        if record is None:
            to_do.append((each, settings))
        else:
            show(each, folder, record)
    skipped = list(runs)
    for number, record in _new_records(to_do, progress, place):
        folder = StudyFolder(output / record.name)
        folder.keep(record)
        show(to_do[number][0], folder, record)
    return [runs[each.name] for each, _ in wanted], skipped


def _new_records(
    jobs: Sequence[tuple[Experiment, dict[str, Any]]], progress: Progress, place: Place
) -> Iterator[tuple[int, Record]]:
    """Number and record of each job, as it ends."""
    if place.client is not None:
        yield from run_on_workers(place.client, jobs, progress)
        return
    for number, (each, settings) in enumerate(jobs):
        yield number, run_experiment(each, settings, progress)


def _about(each: Experiment) -> dict[str, Any]:
    return {"name": each.name, "title": each.title, "source": each.source, "question": each.question}


def _outcome(each: Experiment, record: Record) -> dict[str, Any]:
    verdicts = [
        {"claim": verdict.claim, "outcome": verdict.outcome, "text": verdict.text}
        for verdict in record.findings.verdicts
    ]
    return _about(each) | {"seconds": record.seconds, "settings": record.settings, "verdicts": verdicts}


def _list() -> Table:
    table = Table()
    for column in ("name", "what", "source"):
        table.add_column(column)
    for each in EXPERIMENTS:
        table.add_row(each.name, each.title, each.source)
    return table


def _verdicts(runs: Sequence[Run]) -> Table:
    table = Table()
    for column in ("experiment", "outcome", "claim"):
        table.add_column(column, no_wrap=column != "claim")
    for each, record, _ in runs:
        for verdict in record.findings.verdicts:
            colour = COLOURS[verdict.outcome]
            table.add_row(each.name, Text(verdict.outcome, colour), verdict.claim)
    return table


def _told(skipped: list[str]) -> list[str]:
    return [f"finished before, not repeated (--again repeats): {', '.join(skipped)}"] if skipped else []
