# SPDX-License-Identifier: Apache-2.0
"""The folder of one experiment: its record, and the figures and tables made from it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from deltalux.errors import FormatError
from deltalux.files import written_aside
from deltalux.studies.record import Record, from_json, to_json
from deltalux.studies.report.drawing import draw
from deltalux.studies.report.study_tables import table_csv

RECORD = "findings.json"
MADE = (".svg", ".png", ".csv")


@dataclass(frozen=True)
class StudyFolder:
    """Writes and reads the files of one experiment.

    Attributes
    ----------
    path : the folder; created when something is written
    """

    path: Path

    def finished(self, key: str) -> Record | None:
        """The record of a run with this key; None if there is none.

        Parameters
        ----------
        key : see `run_key`
        """
        try:
            record = from_json((self.path / RECORD).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, FormatError):
            return None
        return record if record.key == key else None

    def keep(self, record: Record) -> None:
        """Write the record, so that the run need not be repeated."""
        self.path.mkdir(parents=True, exist_ok=True)
        self.write_text(RECORD, to_json(record))

    def draw(self, record: Record) -> None:
        """Write figures and tables; also for an earlier run, because they may be drawn differently now."""
        figures, tables = record.findings.figures, record.findings.tables
        for figure in figures:
            drawing = draw(figure)
            self.write_text(f"{figure.name}.svg", drawing.svg)
            with written_aside(self.path / f"{figure.name}.png") as file:
                file.write(drawing.png)
        for table in tables:
            self.write_text(f"{table.name}.csv", table_csv(table))
        wanted = {*(figure.name for figure in figures), *(table.name for table in tables)}
        for left in self.path.iterdir():  # files of a run with other settings
            if left.suffix in MADE and left.stem not in wanted:
                left.unlink()

    def drawings(self, record: Record) -> dict[str, Path]:
        """SVG files of a record's figures, by figure name."""
        return {figure.name: self.path / f"{figure.name}.svg" for figure in record.findings.figures}

    def write_text(self, name: str, text: str) -> None:
        """Write one text file whole."""
        with written_aside(self.path / name) as file:
            file.write(text.encode())
