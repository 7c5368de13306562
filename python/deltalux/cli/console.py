# SPDX-License-Identifier: Apache-2.0
"""Output to the terminal: results on stdout; progress, warnings and errors on stderr."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import Any

import numpy as np
from rich.cells import cell_len
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from deltalux.pace import Overall, Step

_WIDEST = 10_000  # columns of a table in a pipe

ProgressCallback = Callable[[str, float], bool]


def print_error(message: str) -> None:
    """Print a failure on one line of stderr."""
    line = " ".join(message.split())
    _console(stderr=True).print(f"error: {line}", style="red", highlight=False, soft_wrap=True)


def _console(stderr: bool = False) -> Console:
    """A console that prints names of files and objects as they are, also with brackets and colons in them."""
    return Console(stderr=stderr, markup=False, emoji=False)


class Terminal:
    """Output of one command, as `--json` and `-q` require.

    Parameters
    ----------
    as_json : print results as one JSON object instead of tables
    quiet : print no tables, progress or warnings
    """

    def __init__(self, as_json: bool, quiet: bool) -> None:
        self.as_json, self._quiet = as_json, quiet
        self._out = _console()
        if not self._out.is_terminal:  # a pipe or a file has no width
            self._out.width = _WIDEST
        self._err = _console(stderr=True)

    def warn(self, warnings: Iterable[str]) -> None:
        """Print each warning once, on stderr."""
        if self._quiet:
            return
        for text in dict.fromkeys(warnings):
            line = f"warning: {text}"
            self._err.print(line, style="yellow", highlight=False, soft_wrap=True)

    def result(self, data: dict[str, Any], *renderables: Any) -> None:
        """Print the result: `data` with --json, else the rich `renderables` unless -q."""
        if self.as_json:
            self._out.file.write(json.dumps(data, indent=2, default=_plain) + "\n")
        elif not self._quiet:
            for renderable in renderables:
                if isinstance(renderable, Table):
                    _keep_whole(renderable)
                self._out.print(renderable, highlight=False, soft_wrap=isinstance(renderable, str))

    def say(self, text: str) -> None:
        """Print a line that is not a result: neither with --json nor -q."""
        if not self.as_json and not self._quiet:
            self._line(text)

    def record(self, data: dict[str, Any], text: str | None = None) -> None:
        """Print one of many results on one line at once: `data` with --json, else `text` unless -q."""
        if self.as_json:
            self._line(json.dumps(data, default=_plain))
        elif text is not None:
            self.say(text)

    def _line(self, text: str) -> None:
        self._out.file.write(text + "\n")
        self._out.file.flush()

    @contextmanager
    def working(self, text: str) -> Iterator[None]:
        """Show on stderr, if it is a terminal, that work without a measure of progress is running."""
        if self._quiet or not self._err.is_terminal:
            yield
            return
        with self._err.status(Text(text)):
            yield

    @contextmanager
    def overall(self, steps: Iterable[Step]) -> Iterator[Overall]:
        """Provide an `Overall` for a job of these steps, shown as one bar with the time left.

        It is drawn on stderr if that is a terminal, and advances even while nothing is reported.
        """
        overall = Overall(steps)
        with OverallBar(overall, self._err, disable=self._quiet or not self._err.is_terminal) as bar:
            overall.on_step = bar.refresh
            yield overall
            overall.end()

    @contextmanager
    def progress(self) -> Iterator[ProgressCallback]:
        """Provide a callback (stage, fraction) that draws one bar with ETA per stage.

        Bars are drawn on stderr if that is a terminal; the callback never cancels, because
        Ctrl-C reaches it as KeyboardInterrupt.
        """
        bars = Progress(
            TextColumn("{task.description:<22}", markup=False),
            BarColumn(),
            TaskProgressColumn(),
            TimeRemainingColumn(elapsed_when_finished=True),
            console=self._err,
            disable=self._quiet or not self._err.is_terminal,
        )
        tasks: dict[str, Any] = {}
        latest = ""

        def report(stage: str, fraction: float) -> bool:
            nonlocal latest
            if stage and stage != latest:
                if latest:
                    bars.update(tasks[latest], completed=1.0)
                if stage in tasks:  # a stage repeats if the bake continues with more paths
                    bars.reset(tasks[stage], total=1.0)
                else:
                    tasks[stage] = bars.add_task(stage, total=1.0)
                latest = stage
            if latest:
                bars.update(tasks[latest], completed=min(max(fraction, 0.0), 1.0))
            return True

        with bars:
            yield report
            for task in tasks.values():
                bars.update(task, completed=1.0)


class OverallBar(Progress):
    """One bar for all steps of a job: drawn ten times a second from the present state of `overall`.

    Parameters
    ----------
    overall : Overall
    console : where the bar is drawn
    disable : draw nothing
    """

    def __init__(self, overall: Overall, console: Console, disable: bool) -> None:
        self._overall = overall
        super().__init__(
            TextColumn("{task.fields[stage]:<20}", markup=False),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.fields[elapsed]}", "progress.elapsed"),
            TextColumn("ETA"),
            TextColumn("{task.fields[left]}", "progress.remaining"),
            console=console,
            disable=disable,
        )
        self.add_task("", total=1.0, stage="", elapsed="", left="")

    def get_renderables(self) -> Iterable[Any]:
        """The bar in its present state."""
        now = self._overall.state()
        for task in self.tasks:  # none while the bar is being constructed
            self.update(
                task.id, completed=now.share, stage=now.stage, elapsed=_clock(now.elapsed),
                left=_clock(now.remaining),
            )  # fmt: skip
        yield from super().get_renderables()


def _keep_whole(table: Table) -> None:
    """Never truncate a cell with an ellipsis: numbers keep their width, texts wrap."""
    for column in table.columns:
        column.overflow = "fold"
        if column.justify == "right":
            column.min_width = max((cell_len(str(cell)) for cell in column.cells), default=0)


def _clock(seconds: float | None) -> str:
    """Hours, minutes and seconds."""
    return "-:--:--" if seconds is None else str(timedelta(seconds=math.ceil(seconds)))


def _plain(value: Any) -> Any:
    """Convert NumPy values to JSON values."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no JSON form")
