# SPDX-License-Identifier: Apache-2.0
"""Tables of the study as CSV."""

from __future__ import annotations

import csv
import io

from deltalux.studies.experiment import Table


def table_csv(table: Table) -> str:
    """The table as CSV; cells that were not measured are empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(table.rows)
    return text.getvalue()
