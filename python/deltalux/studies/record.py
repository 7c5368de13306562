# SPDX-License-Identifier: Apache-2.0
"""Findings with their settings and environment, to and from JSON text."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from deltalux.errors import FormatError

from .experiment import Curve, Figure, Findings, Mark, Table, Verdict


@dataclass(frozen=True)
class Record:
    """One run of an experiment.

    Attributes
    ----------
    name : name of the experiment
    key : equal for runs with equal findings, see `run_key`
    settings : settings that the experiment ran with
    environment : versions and processor
    seconds : wall-clock time of the run
    findings : Findings
    """

    name: str
    key: str
    settings: Mapping[str, Any]
    environment: Mapping[str, Any]
    seconds: float
    findings: Findings


def to_json(record: Record) -> str:
    """The record as JSON text.

    Raises
    ------
    ValueError
        For numbers that are not finite; experiments use None for values that they could not measure.
    """
    return json.dumps(asdict(record), indent=1, allow_nan=False, default=_plain) + "\n"


def from_json(text: str) -> Record:
    """The record in a JSON text of `to_json`.

    Raises
    ------
    FormatError
        For any other text.
    """
    try:
        data = json.loads(text)
        return Record(**data | {"findings": _findings(data["findings"])})
    except (ValueError, TypeError, KeyError) as error:
        raise FormatError(
            f"findings: found a text that is no record of an experiment ({error}), expected one that "
            "`deltalux study` wrote; repeat it with --again"
        ) from None


def _findings(data: Mapping[str, Any]) -> Findings:
    return Findings(
        tables=[Table(**each) for each in data["tables"]],
        figures=[_figure(each) for each in data["figures"]],
        verdicts=[Verdict(**each) for each in data["verdicts"]],
        notes=data["notes"],
    )


def _figure(data: Mapping[str, Any]) -> Figure:
    curves = [Curve(**each) for each in data["curves"]]
    return Figure(**{**data, "curves": curves, "marks": [Mark(**each) for each in data["marks"]]})


def _plain(value: Any) -> Any:
    """Convert NumPy values to JSON values."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no JSON form")
